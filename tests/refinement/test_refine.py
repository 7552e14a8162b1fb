"""Refinement of a real motion from two stages on."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fesd_robot.contact.model import STICKING_MARGIN
from fesd_robot.fesd import Transcription
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.mpcc import HomotopyOptions, Run, solve
from fesd_robot.ocp import formulate
from fesd_robot.ocp.solver_options import homotopy_options
from fesd_robot.refinement.finer import Finer
from fesd_robot.refinement.refine import MOST_PARTS, SPARE, _finer, _in_parts, _last_that_passes, _once, refined
from fesd_robot.refinement.repair import Repair
from fesd_robot.refinement.solved_motion import SolvedMotion
from fesd_robot.running import SearchEffort
from fesd_robot.task import load_task

TASKS = Path(__file__).parents[2] / "tasks"


@pytest.fixture(scope="module")
def coarse() -> tuple[SolvedMotion, HomotopyOptions]:
    """The biped's step from two stages, which is no motion, and the options it was found with."""
    task = load_task(
        TASKS / "biped_step.yaml", ["method.grid=uniform", f"ground.friction={0.5 / (1 - STICKING_MARGIN)}"]
    )
    motion, options = formulate(task), homotopy_options(task)
    transcription = Transcription(motion.ocp, motion.fesd)
    repair = Repair(transcription, Run(options))
    solution = solve(transcription.problem, Run(options), polisher=BranchTranscription(transcription), otherwise=repair)
    before = SolvedMotion.of(motion, *repair.repaired(BranchTranscription(transcription), solution))
    return before, options


def test_a_motion_that_no_finer_grid_has_leads_to_one_that_is_true(
    coarse: tuple[SolvedMotion, HomotopyOptions],
) -> None:
    """The biped's step from two stages ends with every entry of the audit below a tenth of its limit."""
    before, options = coarse
    assert before.solution.exact and before.audit.violations
    after = refined(before, 1e-7, Run(options))
    assert after.audit.worst[0] <= SPARE and after.local_errors.max() <= 1e-7
    assert after.rounds > 0 and after.stages > before.stages


def test_a_stop_ends_refinement_at_once(coarse: tuple[SolvedMotion, HomotopyOptions]) -> None:
    """No round begins after the user wants to stop."""
    before, options = coarse
    stopped = refined(before, 1e-7, Run(options, stop=lambda iteration, objective: True))
    assert stopped.rounds == 0 and stopped.solution is before.solution


def test_an_effort_without_rounds_leaves_a_motion_as_it_is(coarse: tuple[SolvedMotion, HomotopyOptions]) -> None:
    """However coarse it is; how many rounds there are is the caller's to say."""
    before, options = coarse
    after = refined(before, 1e-7, Run(options, effort=SearchEffort(refinement_rounds=0)))
    assert after.rounds == 0 and after.solution is before.solution


def test_what_led_to_no_motion_is_not_tried_again(coarse: tuple[SolvedMotion, HomotopyOptions]) -> None:
    """The same parts of the same elements are asked for once; others, or with a repair, are another matter."""
    before, _ = coarse
    asked: list[Finer] = []
    once = _once(lambda solved, finer: asked.append(finer))
    few, many = (_in_parts(before.on_branch, np.full(before.local_errors.shape, by)) for by in (2.0, 1e9))
    again = _in_parts(before.on_branch, np.full(before.local_errors.shape, 2.0))
    for finer in (few, again, many, few, few._replace(repair=True), many):
        assert once(before, finer) is None
    assert asked == [few, many, few._replace(repair=True)]


def test_only_elements_of_the_same_mode_are_divided_together(coarse: tuple[SolvedMotion, HomotopyOptions]) -> None:
    """An element with a large error and those that are as long as it get the same parts, the others of its interval
    none."""
    before, _ = coarse
    branch = before.on_branch.branch
    same = set(before.on_branch.polisher.equally_long(branch))
    alone = next(
        e for e, without in enumerate(branch.without_length) if not without and e not in same and e - 1 not in same
    )
    first = min(same - {e + 1 for e in same})
    run = [first]
    while run[-1] in same:
        run.append(run[-1] + 1)
    for divided in ([alone], run):
        excess = np.ones(len(branch.factors))
        excess[divided[0]] = 1e3
        parts = len(branch.factors) + len(divided) * (MOST_PARTS - 1)
        assert sum(_in_parts(before.on_branch, excess).motion.transcription.elements) == parts


@pytest.mark.parametrize(("largest", "usual", "stages"), [(1e-3, 1e-6, 1), (1e-6, 1e-12, 0)])
def test_what_is_clear_before_a_round_is_done_in_it(
    coarse: tuple[SolvedMotion, HomotopyOptions], largest: float, usual: float, stages: int
) -> None:
    """The element with a gross error is divided in the round in which all get a stage more, and one whose error is
    merely too large in the round in which bounds between stages are held, as the biped's step asks for."""
    before, _ = coarse
    errors = np.where(before.on_branch.branch.without_length, 0.0, usual)
    errors[np.argmax(errors > 0)] = largest
    motion = replace(before)
    motion.__dict__.update({**before.__dict__, "local_errors": errors})
    finer = next(_finer(motion, 1e-7, early=True)).motion
    assert sum(finer.transcription.elements) > sum(before.transcription.elements)
    assert finer.transcription.options.tableau.stages == before.stages + stages
    assert bool(finer.transcription.added.bounds) != bool(stages)
    assert finer.transcription.problem.size == len(finer.w)


def test_the_last_motion_that_passes_is_kept() -> None:
    """A later motion that fails the audit does not take its place; if none passes the last one is returned."""
    motions = [cast(Any, SimpleNamespace(passes=one)) for one in (True, False, True, False)]
    assert _last_that_passes(motions) is motions[2]
    assert _last_that_passes(motions[1:2] + motions[3:]) is motions[3]


@pytest.mark.parametrize("violations", [[], ["min_gap"]])
def test_a_motion_that_fails_without_its_replay_is_not_driven_again(
    violations: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A replay may take minutes; only a motion whose audit finds nothing without one is driven again."""
    replayed: list[Any] = []

    def audited(*given: Any) -> Any:
        return SimpleNamespace(violations=violations)

    monkeypatch.setattr("fesd_robot.refinement.solved_motion.motion_audit", audited)
    monkeypatch.setattr("fesd_robot.refinement.solved_motion.replay_intervals", lambda *given: replayed.append(given))
    nothing = cast(Any, None)
    still = cast(Any, SimpleNamespace(transcription=SimpleNamespace(grid=SimpleNamespace(moving=False))))
    one = SolvedMotion(nothing, still, nothing)
    one.__dict__.update(physical=None, physics=None)
    assert one.passes is not bool(violations)
    assert len(replayed) == (not violations)


def test_what_is_known_of_a_motion_is_not_worked_out_again() -> None:
    """Other numbers of its refinement change nothing of its audit, which may have taken minutes."""
    nothing = cast(Any, None)
    one = SolvedMotion(nothing, nothing, nothing)
    one.__dict__.update(audit="an audit", local_errors="errors")
    other = one.counted(3, 2.0)
    assert (other.rounds, other.seconds, one.rounds) == (3, 2.0, 0)
    assert (other.audit, other.local_errors) == ("an audit", "errors")


@pytest.mark.parametrize(("own", "along", "spares"), [(0.2, 0.05, False), (0.05, 0.2, False), (0.05, 0.05, True)])
def test_what_has_something_to_spare(own: float, along: float, spares: bool) -> None:
    """Entries without the replay count, and those of the replay but for its impacts, which no accuracy changes."""
    nothing = cast(Any, None)
    one = SolvedMotion(nothing, nothing, nothing)
    one.__dict__.update(
        audit_without_replay=SimpleNamespace(worst=(own, "")),
        _audit_without_impacts=SimpleNamespace(worst=(along, "")),
        audit=SimpleNamespace(worst=(0.9, "")),
    )
    assert one.spares(SPARE) is spares


@pytest.mark.parametrize(
    ("errors", "moving", "none"),
    [([0.2, 1e-9], False, True), ([0.2, 1e-9], True, False), ([0.09, np.inf], False, False)],
)
def test_what_is_no_motion_is_not_refined(errors: list[float], moving: bool, none: bool) -> None:
    """An element of a uniform grid that errs by a tenth of its states is none; others are divided."""
    motion = SimpleNamespace(
        solution=SimpleNamespace(exact=True),
        local_errors=np.array(errors),
        motion=SimpleNamespace(grid=SimpleNamespace(moving=moving)),
    )
    if none:
        assert refined(cast(Any, motion), 1e-7, Run()) is motion
    else:
        with pytest.raises(AttributeError, match="without_shrunk"):  # it goes on
            refined(cast(Any, motion), 1e-7, Run())
