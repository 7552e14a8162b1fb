"""What feet and their forces do between the stages of an element."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.contact.kinds import SLIDING_INSIDE_CONE
from fesd_robot.fesd import Transcription
from fesd_robot.fesd.added_rows import SLACK, BoundBetween
from fesd_robot.fesd.polishing import BranchMotion, BranchTranscription
from fesd_robot.fesd.refinement import violated_between_stages
from fesd_robot.fesd.refinement.between_stages import CLEARANCE, PENETRATION, STRICTER
from fesd_robot.ocp import formulate
from fesd_robot.task import load_task
from tests.bodies_in_space import MASS, written

TASKS = Path(__file__).parents[2] / "tasks"


@pytest.mark.parametrize(
    ("lowest", "closed", "held"),
    [(-5e-7, [], CLEARANCE), (-5e-7, [5], None), (-5e-6, [5], -PENETRATION), (1e-7, [], None)],
)
def test_a_flight_does_not_touch_the_ground(lowest: float, closed: list[int], held: float | None) -> None:
    """In the middle of a flight a gap stays positive; beside a contact it may be negative by what rounds off.

    The gap of element 4 is a parabola of the stages' three nodes whose lowest point lies between them.
    """
    motion = formulate(load_task(TASKS / "hopper_one_jump.yaml", ["method.grid=uniform"]))
    transcription = Transcription(motion.ocp, motion.fesd)
    conditions, tableau = BranchTranscription(transcription).conditions, motion.fesd.tableau
    gap = next(one.invariant_state for one in conditions.members if one.invariant_state is not None)
    nodes = 1e-3 * (np.array([0.0, *tableau.c]) - 0.6) ** 2 + lowest
    elements = transcription.unpack(transcription.problem.start)
    for e, element in enumerate(elements):
        at_nodes = nodes if e == 4 else np.full(len(nodes), nodes[0])
        left, x = element.x_left.copy(), element.x.copy()
        left[gap], x[:, gap] = at_nodes[0], at_nodes[1:]
        elements[e] = replace(element, x_left=left, x=x)
    modes = [ActiveFactor.G if e in closed else ActiveFactor.H for e in range(len(elements))]
    factors = tuple((mode,) * len(conditions.members) for mode in modes)
    branch = Branch(tuple(conditions.labels), factors, (False,) * len(elements))
    violated = violated_between_stages(BranchMotion.of(transcription, transcription.pack(elements), branch))
    found = [one.bound for one in violated]
    bounds = [one for one in found if isinstance(one, BoundBetween) and one.variable == gap and one.element == 4]
    assert bounds == ([] if held is None else [BoundBetween(4, gap, -1, held, of_mode=held > 0)])


@pytest.mark.parametrize("hit", [False, True])
@pytest.mark.parametrize("shrunk", [False, True])
def test_a_foot_may_leave_the_ground_with_a_force_in_an_impact_and_where_controls_jump(hit: bool, shrunk: bool) -> None:
    """Inside a control interval a force ends at zero, unless another foot lands hard as this one takes off, or the rest
    of the interval has shrunk to nothing: then the force ends at its end."""
    motion = formulate(load_task(TASKS / "solo12_jump.yaml", ["method.grid=uniform"]))
    transcription = Transcription(motion.ocp, motion.fesd)
    polisher, n_x = BranchTranscription(transcription), motion.ocp.system.state.numel()
    conditions = polisher.conditions
    elements = transcription.unpack(transcription.problem.start)
    front = [i for i, label in enumerate(conditions.labels) if label.contact == "front"]
    forces = {
        variable - n_x
        for i in front
        if conditions.members[i].invariant_state is not None
        for variable in conditions.variables(conditions.members[i].H)
    }
    first = transcription.elements[0]
    elements[first].z[:, sorted(forces)] = 0.04
    for e in range(first + 1, first + transcription.elements[1]):
        elements[e] = replace(elements[e], step=1e-13 if shrunk else elements[e].step)
    closed = (ActiveFactor.G,) * len(conditions.members)
    taken_off = tuple(ActiveFactor.H if i in front else ActiveFactor.G for i in range(len(closed)))
    landing = tuple(
        ActiveFactor.COMPLEMENT if hit and i not in front and one.complement is not None else factor
        for i, (one, factor) in enumerate(zip(conditions.members, taken_off, strict=True))
    )
    factors = ((closed,) * (first + 1) + (landing,) + (taken_off,) * len(elements))[: len(elements)]
    w = transcription.pack(elements)
    branch = polisher.branch_of_exact(Branch(tuple(conditions.labels), factors, (False,) * len(elements)), w)
    violated = violated_between_stages(BranchMotion.of(transcription, w, branch))
    ends = [one for one in violated if isinstance(one.bound, BoundBetween) and one.bound.end_only]
    held = {(one.bound.element, one.bound.variable - n_x) for one in ends if isinstance(one.bound, BoundBetween)}
    assert held == (set() if hit or shrunk else {(first, force) for force in forces})
    assert all(one.violation == pytest.approx(0.04) for one in ends)


@pytest.mark.parametrize("slides", [False, True])
def test_a_force_leaves_its_cone_between_the_stages_although_what_is_unused_does_not(
    tmp_path: Path, slides: bool
) -> None:
    """What is unused of a cone is a product: at the left end of an element that of the forces there counts.

    It is not held above zero where its branch holds it at zero, as of a foot that slides while it hits the ground: no
    motion on the branch would keep that.

    The forces (0.4, 0.4) and (-0.6, -0.6) of the two stages, in units of mu f_n, are 0.9 (1, 1) there, outside of the
    cone by 0.62 of its square, while the unused parts 0.68 and 0.28 are 0.88. The bound makes up for the difference.
    """
    task = written(
        tmp_path,
        MASS,
        "robot: {model: model.urdf, root: fixed}\nground: {type: plane, friction: 0.5}\n"
        "contacts: {foot: {frame: mass}}\nhorizon: {duration: 1, intervals: 8}\n"
        "initial: {configuration: {x: 0, y: 0, z: 0}}\ngoal: {configuration: {x: 0.5, y: 0.3, z: 0}}\n",
    )
    motion = formulate(load_task(task, ["method.grid=uniform"]))
    transcription = Transcription(motion.ocp, motion.fesd)
    conditions, system = BranchTranscription(transcription).conditions, motion.ocp.system
    names, beta, n_x = list(system.algebraic_names), 1e-3, system.state.numel()
    z = np.zeros((2, len(names)))
    for row, share, unused in zip(z, (0.4, -0.6), (0.68, 0.28), strict=True):
        for side, sign in (("theta_+", -1), ("theta_-", 1), ("theta_right", -1), ("theta_left", 1)):
            row[names.index(f"{side}[foot]")] = beta * (1 + sign * share) / 2
        row[names.index("1 - beta[foot]")] = 1 - beta
        row[names.index("unused friction[foot]")] = unused * beta**2
    elements = transcription.unpack(transcription.problem.start)
    elements[4] = replace(elements[4], z=z)
    factor = ActiveFactor.H if slides else ActiveFactor.G
    own = tuple(factor if one.kind == SLIDING_INSIDE_CONE else ActiveFactor.G for one in conditions.labels)
    branch = Branch(tuple(conditions.labels), (own,) * len(elements), (False,) * len(elements))
    violated = violated_between_stages(BranchMotion.of(transcription, transcription.pack(elements), branch))
    variable = n_x + names.index("unused friction[foot]")
    bounds = [one for one in violated if isinstance(one.bound, BoundBetween) and one.bound.variable == variable]
    assert len(bounds) == (not slides)
    for one in bounds:
        assert isinstance(one.bound, BoundBetween)
        assert one.bound.element == 4 and one.violation == pytest.approx(0.62e-6, rel=1e-6)
        assert one.bound.limit == pytest.approx(STRICTER * (0.88 + 0.62) * 1e-6 + SLACK, rel=1e-6)
