"""Feet that touch the ground between the stages of an element."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.fesd import Transcription
from fesd_robot.fesd.added_rows import BoundBetween
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.fesd.refinement import violated_between_stages
from fesd_robot.fesd.refinement.between_stages import CLEARANCE, PENETRATION
from fesd_robot.ocp import formulate
from fesd_robot.task import load_task

TASKS = Path(__file__).parents[2] / "tasks"


@pytest.mark.parametrize(
    ("lowest", "closed", "held"),
    [(-5e-7, [], CLEARANCE), (-5e-7, [5], None), (-5e-6, [5], -PENETRATION), (1e-7, [], None)],
)
def test_a_flight_does_not_touch_the_ground(lowest: float, closed: list[int], held: float | None) -> None:
    """In the middle of a flight a gap stays positive; beside a contact it may be negative by what rounds off.

    The gap of element 4 is a parabola of the stages' three nodes whose lowest point lies between them.
    """
    motion = formulate(load_task(TASKS / "hopper_one_jump.yaml"))
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
    violated = violated_between_stages(transcription, conditions, transcription.pack(elements), branch)
    found = [one.bound for one in violated]
    bounds = [one for one in found if isinstance(one, BoundBetween) and one.variable == gap and one.element == 4]
    assert bounds == ([] if held is None else [BoundBetween(4, gap, -1, held, of_mode=held > 0)])
