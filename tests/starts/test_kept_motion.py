"""A task with other numbers is solved again without a function made, and a plan's own point at once."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

from fesd_robot import plan
from fesd_robot.errors import OptionError
from fesd_robot.fesd.polishing import BranchMotion
from fesd_robot.mpcc import NlpReport, Run
from fesd_robot.native import compiler
from fesd_robot.nlp import NEAR
from fesd_robot.ocp import MotionProblem, formulate, homotopy_options
from fesd_robot.plans import Plan, read_plan, write_plan
from fesd_robot.starts import kept_motion
from fesd_robot.task import load_task

TASK = Path(__file__).parents[2] / "tasks" / "hopper_one_jump.yaml"
QUICK = ("solver.effort=quick", "output.page=false")


@pytest.fixture(scope="module")
def motion() -> MotionProblem:
    return formulate(load_task(TASK, QUICK))


@pytest.fixture(scope="module")
def jump(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    """A plan of the jump, from its file."""
    found = plan(load_task(TASK, QUICK))
    assert found.status.solved and found.status.exact
    return read_plan(write_plan(found, tmp_path_factory.mktemp("kept") / "jump"))


def kept(motion: MotionProblem, jump: Plan) -> BranchMotion:
    found = kept_motion(jump, motion)
    assert found is not None
    return found


def test_a_plan_is_solved_again_from_its_own_point(motion: MotionProblem, jump: Plan) -> None:
    """With its multipliers the branch NLP of a plan takes at most two iterations, and nothing changes."""
    own = kept(motion, jump)
    end = own.solved(Run(homotopy_options(motion.task)))
    assert end is not None and end.exact and end.iterations <= 2
    assert end.residuals.objective == pytest.approx(jump.statistics.objective, rel=1e-9)
    assert end.w == pytest.approx(own.w, abs=1e-7)


def test_a_warm_start_begins_where_the_plan_ended(jump: Plan, tmp_path: Path) -> None:
    """Without a search a task that names its own plan is that plan after a handful of iterations."""
    folder, reports = write_plan(jump, tmp_path / "jump"), list[NlpReport]()
    again = plan(load_task(TASK, [*QUICK, f"solver.warm_start={folder}"]), progress=reports.append)
    assert again.status.solved and again.statistics.iterations <= 10
    assert again.statistics.objective == pytest.approx(jump.statistics.objective, rel=1e-7)


@contextmanager
def nothing_made() -> Iterator[list[str]]:
    """Note every CasADi function that is made, and every file that is compiled."""
    made: list[str] = []
    with pytest.MonkeyPatch.context() as patch:

        def noted(owner: Any, name: str) -> None:
            original = getattr(owner, name)

            def call(*arguments: Any, **options: Any) -> Any:
                made.append(f"{name} {str(arguments[-1:])[:60]}")
                return original(*arguments, **options)

            patch.setattr(owner, name, call)

        for owner, name in ((ca.Function, "__init__"), (ca, "nlpsol"), (ca, "external"), (compiler._BACKGROUND, "run")):
            noted(owner, name)
        yield made


@pytest.mark.parametrize(
    "change",
    [
        "initial.configuration.root_x=0.105",
        "initial.configuration.root_pitch=0.01",
        "initial.velocity.root_pitch=0.05",
        "goal.configuration.root_x=1.02",
        "reference.apex.root_z=1.02",
        "costs.control.leg_force=0.011",
    ],
)
def test_other_numbers_make_no_function(motion: MotionProblem, jump: Plan, change: str) -> None:
    """Another start, goal, reference or weight is solved with the functions that there are; the motion is that of the
    task formulated anew."""
    run, own = Run(homotopy_options(motion.task)), kept(motion, jump)
    assert own.solved(run, NEAR) is not None
    for compiling in compiler._BACKGROUND._begun.values():
        compiling.join()
    assert own.solved(run, NEAR) is not None, "now with machine code"
    task = load_task(TASK, [*QUICK, change])
    with nothing_made() as made:
        moved = motion.with_numbers_of(task)
        found = own.with_numbers(moved.ocp).solved(run, NEAR)
    assert made == []
    assert found is not None and found.exact
    anew = BranchMotion.of(own.polisher, own.w, own.branch).with_numbers(formulate(task).ocp).solved(run, NEAR)
    assert anew is not None and anew.exact
    assert found.residuals.objective == pytest.approx(anew.residuals.objective, rel=1e-6)
    assert found.residuals.objective != pytest.approx(jump.statistics.objective, rel=1e-6)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("horizon.duration=1.1", "another 'horizon' changes the equations"),
        ("ground.friction=0.3", "another 'ground' changes the equations"),
        ("costs.control.leg_force=0", "'costs.control.leg_force' is no longer given"),
        ("goal.tolerance.configuration.root_x=0.02", "other names, tolerances or weights"),
    ],
)
def test_other_equations_are_refused(motion: MotionProblem, change: str, words: str) -> None:
    """What would be another problem is named."""
    with pytest.raises(OptionError, match=words):
        motion.with_numbers_of(load_task(TASK, [*QUICK, change]))


def test_a_start_that_is_measured_touches_the_ground(motion: MotionProblem) -> None:
    """A foot that is a few micrometres off the ground stands on it, to round-off; one that is inside it is refused."""
    moved = motion.with_numbers_of(load_task(TASK, [*QUICK, "initial={configuration: {leg: 0.5, root_z: 0.500003}}"]))
    assert abs(float(np.asarray(moved.parts.gap(moved.endpoints.initial_configuration))[0, 0])) < 1e-12
    with pytest.raises(Exception, match="below"):
        motion.with_numbers_of(load_task(TASK, [*QUICK, "initial={configuration: {leg: 0.5, root_z: 0.49}}"]))
