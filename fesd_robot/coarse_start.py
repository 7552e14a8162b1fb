"""A start from the motion of the same task on a coarser control grid."""

from __future__ import annotations

from collections.abc import Callable

from fesd_robot.fesd import Transcription
from fesd_robot.fesd.neighbours import KnownElements, on_grid
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.known_sequence import CLOCK, exact_start
from fesd_robot.mpcc import HomotopyOptions, MpccSolution, NlpReport
from fesd_robot.ocp import MotionProblem
from fesd_robot.solved_motion import SolvedMotion
from fesd_robot.strategies.attempts import Stop
from fesd_robot.strategies.deadline import Deadline
from fesd_robot.strategies.fallbacks import with_overrides
from fesd_robot.task import Task
from fesd_robot.task.consistency import coarser_intervals


def coarse_start(
    motion: MotionProblem,
    transcription: Transcription,
    planned: Callable[[Task], SolvedMotion],
    options: HomotopyOptions,
    deadline: Deadline,
    progress: Callable[[NlpReport], None] | None,
    stop: Stop | None,
) -> tuple[BranchTranscription, MpccSolution] | None:
    """Return the exact motion with the contact sequence of the task's motion on a coarser control grid.

    With half of the controls a motion has half of the neighbours, and each takes half of the time, so the search there
    gets further; its motion is one on the task's own grid, too, where it is the start of another search. It begins from
    the initial guess as it is, whatever the seed.

    Args:
        motion, transcription: the task.
        planned: a task -> its motion, searched and refined.
        options: of the homotopy.
        deadline: of the task.
        progress: called after every NLP.
        stop: called once an IPOPT iteration with (iteration, objective); True ends the solve.

    Returns:
        None where no coarser grid fits the task, or its motion leads to none.
    """
    task, system = motion.task, transcription.ocp.system
    intervals = coarser_intervals(task)
    if intervals is None:
        return None
    coarse = {"horizon.intervals": intervals, "solver.coarse_to_fine": False, "solver.seed": 0}
    found = planned(with_overrides(task, coarse))
    if not found.solution.exact:
        return None
    known = KnownElements(
        found.transcription.unpack(found.solution.w),
        found.branch,
        found.transcription.options.tableau,
        list(system.state_names).index(CLOCK),
    )
    fitted, w, branch = on_grid(known, transcription)
    return exact_start(fitted, w, branch, options, deadline, progress, stop)
