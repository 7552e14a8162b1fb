"""Repair on real tasks: where no branch of the homotopy's end leads to an exact motion, a neighbour of it does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fesd_robot.contact.model import STICKING_MARGIN
from fesd_robot.fesd import Transcription
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.mpcc import MpccSolution, NlpReport, Run, solve
from fesd_robot.ocp import formulate
from fesd_robot.ocp.solver_options import homotopy_options
from fesd_robot.refinement.repair import Repair
from fesd_robot.running import Deadline, SearchEffort
from fesd_robot.task import Task, load_task

TASKS = Path(__file__).parents[2] / "tasks"


@pytest.fixture(scope="module")
def task() -> Task:
    """A jump whose homotopy ends on a branch that three elements an interval do not fit."""
    return load_task(
        TASKS / "hopper_wedge.yaml", ["method.grid=uniform", f"ground.friction={0.6 / (1 - STICKING_MARGIN)}"]
    )


@pytest.fixture(scope="module")
def repaired(task: Task) -> tuple[BranchTranscription, MpccSolution, list[NlpReport]]:
    """Its homotopy with repair: transcription, solution, all NLPs."""
    transcription = Transcription((motion := formulate(task)).ocp, motion.fesd)
    options, reports = homotopy_options(task), list[NlpReport]()
    polisher = BranchTranscription(transcription)
    repair = Repair(transcription, Run(options, report=reports.append))
    solution = solve(transcription.problem, Run(options, report=reports.append), polisher=polisher, otherwise=repair)
    assert not solution.exact
    return *repair.repaired(polisher, solution), reports


def test_a_neighbour_of_the_homotopys_end_is_exact(
    repaired: tuple[BranchTranscription, MpccSolution, list[NlpReport]],
) -> None:
    """The repaired motion satisfies the problem with pairs to round-off, on a branch that it lies on."""
    polisher, solution, reports = repaired
    residuals = polisher.transcription.problem.residuals(solution.w)
    assert solution.exact and solution.solved and residuals == solution.residuals
    assert residuals.complementarity <= 1e-12 and residuals.constraint_violation <= 1e-9
    bounds = polisher.bounds(solution.branch) if solution.branch else None
    assert (
        bounds is not None and np.all(solution.w >= bounds.lower - 1e-9) and np.all(solution.w <= bounds.upper + 1e-9)
    )
    assert sum(report.sigma == 0.0 for report in reports) <= 2 * SearchEffort.repair_trials


def test_repair_replaces_the_converging_homotopy(
    repaired: tuple[BranchTranscription, MpccSolution, list[NlpReport]],
) -> None:
    """After the loose homotopy only branch NLPs are solved: sigma never falls to the tolerance."""
    sigmas = [report.sigma for report in repaired[2]]
    first = sigmas.index(0.0)
    assert min(sigmas[:first]) > 1e-7 and set(sigmas[first:]) == {0.0}


def test_without_time_nothing_is_found(task: Task) -> None:
    """A repair without time left says so, and the homotopy's end stays as it is."""
    transcription = Transcription((motion := formulate(task)).ocp, motion.fesd)
    repair = Repair(transcription, Run(homotopy_options(task), Deadline(0.0)))
    assert repair(transcription.problem.start) is None
