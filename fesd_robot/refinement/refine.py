"""Refinement of an exact plan on its branch, until every element is the motion of its own mode."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from fesd_robot.fesd import with_stages
from fesd_robot.fesd.polishing import BranchMotion
from fesd_robot.fesd.refinement import Violated, multiplier_errors, violated_between_stages, with_parts
from fesd_robot.mpcc import COST_LOSS, Run
from fesd_robot.ranges import MAX_STAGES
from fesd_robot.refinement.determinacy import with_determinate_postures
from fesd_robot.refinement.finer import Finer, continued, with_bounds
from fesd_robot.refinement.solved_motion import SolvedMotion
from fesd_robot.running import OutOfTime, SearchEffort

SPARE = 0.1
"""Of its limit: an audit whose entries are all below that passes with something to spare."""

TIGHTENED = 1.0, 0.1, 0.01
"""Factors on the accuracy, as long as the audit has less to spare, and more with every factor."""

IMPROVED = 0.5
"""Factor by which a round reduces the worst entry of an audit that passes, if more rounds are to do so."""

MOST_PARTS = 4
"""Most parts into which an element is divided at once."""

RAISES_ORDER = 0.2
"""Share of the elements with an error too large above which all get one more stage instead of these parts."""

GROSS = 1e-4
"""Local error of an element that is made smaller before others: its motion may be none."""

COARSE = 1e-2
"""The same where too many elements have gross errors: such an element is too long for a scheme of any order."""

NO_MOTION = 0.1
"""Local error of an element of a uniform grid, relative to the largest value of a state, above which it is none: a
search with one more stage finds a motion sooner than refinement, which would go on for minutes and end on another
branch. On a grid that moves the sequence of phases stays, and its elements are divided."""

GAIN_OF_A_STAGE = 100.0
"""Factor by which one more stage of all elements reduces their errors, roughly."""

MOST_STAGES = 2
"""Most stages that are added at once."""

WORSE_THAN_ERRORS = 10.0
"""How much larger than the errors a violated bound is that is held before these become smaller."""

MULTIPLIER_ACCURACY = 100.0
"""Error of multipliers near their bounds, relative to the accuracy; one of 1e-5 is a force of 1e-4 robot weights."""

_ContinueFrom = Callable[[SolvedMotion, Finer], SolvedMotion | None]
"""A motion and a finer transcription of it -> the motion that continues it there, None if there is none."""


def refined(solved: SolvedMotion, accuracy: float, run: Run) -> SolvedMotion:
    """Return an exact solution refined on its branch until its local errors and its bounds between stages are right.

    If an entry of the audit is then above a tenth of its limit (`SPARE`), a tenth of the accuracy is asked for, and a
    hundredth; what comes nearest is kept. A motion that passes and is accurate is not refined further where the last
    round has not halved the worst entry.

    A round gives every element one more stage if many errors are larger than the accuracy, else divides those
    elements, else holds the bounds that are violated between stages, all of them or those that are violated least;
    where these are violated by much more than errors explain, that comes first. Else it holds contacts in postures
    where Coulomb's law decides the motion, where its replay shows that it does not; before all else where it leaves
    the motion by more than errors explain. What two rounds would do is tried at once where it is clear beforehand
    (`_two_at_once`). Something comes first only as long as no round has failed. The branch NLP is solved again from
    the interpolated point. Once local errors are small, and after some rounds, the audit alone decides whether to
    go on: not if all of its entries have something to spare. A coarse motion may do what no finer one does: where there
    is no solution, or one that costs much more, branches near by are looked for (`repair`). A round that finds none
    ends it, and so do some failures; the last motion that passes the audit is kept, if one does.

    Args:
        solved: of a collocation scheme; returned as it is if it is not exact, or too coarse to be a motion at all.
        accuracy: largest local error of an element, relative to one plus the largest value of each state.
        run: of all NLPs; its effort says how many rounds, failures and repairs.
    """
    continue_from = _once(partial(continued, run=run))

    def over(needed: float = 0.0) -> bool:
        return run.over or run.deadline.left <= needed

    if not solved.solution.exact or _is_no_motion(solved):
        return solved
    best = unrefined = solved = solved.without_shrunk
    for factor in TIGHTENED:
        solved = _to_accuracy(solved, factor * accuracy, continue_from, over, run.effort)
        if run.deadline.left <= 0:  # an audit takes time, too
            return solved if best is unrefined else best
        idle = best is not unrefined and not _improves(solved, best)
        if best is unrefined or solved.audit.worst[0] < best.audit.worst[0]:
            best = solved
        if idle or over() or best.spares(SPARE) or solved.local_errors.max() > factor * accuracy:
            break
    return best if best is solved else best.counted(solved.rounds, solved.seconds)


def _once(continue_from: _ContinueFrom) -> _ContinueFrom:
    """Return a function that does the same, but does not try again what has led to no motion: the next accuracy asks
    for some of the finer transcriptions that the last one was refused."""
    refused: set[object] = set()

    def once(solved: SolvedMotion, finer: Finer) -> SolvedMotion | None:
        motion = finer.motion
        asked = motion.branch, motion.transcription.added, motion.w.tobytes(), finer.freer, finer.repair
        if asked in refused:
            return None
        following = continue_from(solved, finer)
        if following is None:
            refused.add(asked)
        return following

    return once


def _to_accuracy(
    solved: SolvedMotion,
    accuracy: float,
    continue_from: _ContinueFrom,
    over: Callable[..., bool],
    effort: SearchEffort,
) -> SolvedMotion:
    """Return an exact solution refined to an accuracy, or as far as its audit passes.

    Args:
        solved: of a collocation scheme.
        accuracy: largest local error of an element.
        continue_from: solves a finer transcription.
        over: whether nothing more is to begin; called with the seconds that it may take, none if left out. A round
            takes those of the last one: its NLP looks at the clock, but building, errors and audit do not.
        effort: how many rounds, failures and repairs.
    """
    begin, failures, repairs, last = time.perf_counter(), 0, 0, solved.rounds + effort.refinement_rounds
    earlier: list[SolvedMotion] = []
    round_began = begin
    with contextlib.suppress(OutOfTime):
        while solved.rounds < last:
            enough = solved.rounds >= effort.enough_rounds or solved.local_errors.max() <= accuracy
            if enough and solved.spares(SPARE):
                break
            if earlier and earlier[-1].local_errors.max() <= accuracy and not _improves(solved, earlier[-1]):
                break
            if over(time.perf_counter() - round_began if earlier else 0.0):
                break
            following, round_began = None, time.perf_counter()
            for finer in _finer(solved, accuracy, early=not failures):
                if finer.repair and repairs >= effort.refinement_repairs:
                    continue
                following = continue_from(solved, finer)
                failures += following is None and not finer.repair
                repairs += finer.repair
                costly = following is not None and _cost(following) > (1 + COST_LOSS) * _cost(solved)
                if costly and not finer.repair and repairs < effort.refinement_repairs:
                    other, repairs = continue_from(solved, finer._replace(repair=True)), repairs + 1
                    following = min((one for one in (following, other) if one), key=_cost)
                if following is not None or failures >= effort.refinement_failures or over():
                    break
            if following is None:
                break
            earlier.append(solved)
            solved = following.without_shrunk
    best = _last_that_passes([*earlier, solved])
    return best.counted(solved.rounds, solved.seconds + time.perf_counter() - begin)


def _last_that_passes(motions: Sequence[SolvedMotion]) -> SolvedMotion:
    """Return the last motion whose audit has no violations, the very last if none has, or no time is left to say."""
    with contextlib.suppress(OutOfTime):
        return next((one for one in reversed(motions) if one.passes), motions[-1])
    return motions[-1]


def _improves(solved: SolvedMotion, earlier: SolvedMotion) -> bool:
    """Whether a motion has an audit that fails, or its worst entry is much smaller than an earlier motion's."""
    return not solved.passes or solved.audit.worst[0] <= IMPROVED * earlier.audit.worst[0]


def _is_no_motion(solved: SolvedMotion) -> bool:
    """Whether errors of elements are gross on a uniform grid; those that cannot be estimated do not count."""
    errors = solved.local_errors
    return not solved.motion.grid.moving and bool((errors[np.isfinite(errors)] > NO_MOTION).any())


def _cost(solved: SolvedMotion) -> float:
    return solved.solution.residuals.objective


def _finer(solved: SolvedMotion, accuracy: float, *, early: bool) -> Iterator[Finer]:
    """Yield finer transcriptions, the one to try first first; none if there is nothing to refine.

    Args:
        solved: the motion.
        accuracy: largest local error of an element.
        early: whether two rounds are tried at once, and what errors do not explain is held before these are small:
            bounds, and postures in which Coulomb's law decides.
    """
    errors, gross = solved.local_errors, max(GROSS, accuracy)
    asking = errors > accuracy
    if (errors > gross).sum() > _many(solved) and (errors > COARSE).any():
        yield _in_parts(solved.on_branch, np.maximum(errors / COARSE, 1.0))
    violated = violated_between_stages(solved.on_branch)
    worst = max((one.violation for one in violated), default=0.0)
    if early:
        yield from with_determinate_postures(solved)
        yield from _two_at_once(solved, accuracy, violated)
        if asking.any() and gross >= errors.max() and worst > WORSE_THAN_ERRORS * errors.max():
            yield with_bounds(solved, [one.bound for one in violated])
    for most in dict.fromkeys((gross, accuracy)):
        if 0 < (errors > most).sum() <= _many(solved):
            yield _in_parts(solved.on_branch, np.maximum(errors / most, 1.0))
    if asking.any():
        yield from _with_more_stages(solved, accuracy)
    if not asking.any() and solved.stages < MAX_STAGES:
        errors = multiplier_errors(solved.on_branch)
        excess = np.maximum(errors / (MULTIPLIER_ACCURACY * accuracy), 1.0)
        if excess.max(initial=1.0) > 1.0:
            if early and worst > errors.max():
                yield with_bounds(solved, [one.bound for one in violated])
            yield _in_parts(solved.on_branch, excess)
    yield from _with_more_bounds(solved, violated)
    if not (early or asking.any()):
        yield from with_determinate_postures(solved)


def _two_at_once(solved: SolvedMotion, accuracy: float, violated: Sequence[Violated]) -> Iterator[Finer]:
    """Yield what two rounds, one after the other, would do, if that is clear before the first of them.

    Either the few elements are divided whose errors are much larger than others', and all get more stages, as these
    ask for; or bounds are held and the few elements divided whose errors are too large.

    Args:
        solved, accuracy: as in `_finer`.
        violated: bounds between stages.
    """
    errors, gross, many = solved.local_errors, max(GROSS, accuracy), _many(solved)
    few = 0 < (errors > accuracy).sum() <= many
    if few and violated and errors.max() <= gross:
        bounds = with_bounds(solved, [one.bound for one in violated])
        parts = _in_parts(bounds.motion, np.maximum(errors / accuracy, 1.0))
        yield parts._replace(freer=True)
        return
    while (errors > gross).sum() > many:
        gross *= 10
    if not few and (errors > gross).any():
        parts = _in_parts(solved.on_branch, np.maximum(errors / gross, 1.0))
        for stages in _more_stages(solved, np.minimum(errors, gross), accuracy):
            yield Finer(with_stages(parts.motion, stages))


def _many(solved: SolvedMotion) -> float:
    """Return the number of elements above which all get one more stage; their parts would make a large problem."""
    return RAISES_ORDER * np.count_nonzero(~np.array(solved.on_branch.branch.without_length))


def _with_more_stages(solved: SolvedMotion, accuracy: float) -> Iterator[Finer]:
    """Yield it with as many stages more as the larger errors ask for, with fewer, and with one on another branch."""
    for stages in _more_stages(solved, np.minimum(solved.local_errors, 1.0), accuracy):
        finer = Finer(with_stages(solved.on_branch, stages))
        yield finer
        if stages == solved.stages + 1:
            yield finer._replace(repair=True)


def _more_stages(solved: SolvedMotion, errors: np.ndarray, accuracy: float) -> Sequence[int]:
    """Return the stages to try, as many as the larger errors ask for first, then fewer."""
    excess = errors / accuracy
    wanted = round(math.log(np.median(excess[excess > 1])) / math.log(GAIN_OF_A_STAGE))
    return range(solved.stages + min(max(wanted, 1), MOST_STAGES, MAX_STAGES - 1 - solved.stages), solved.stages, -1)


def _in_parts(motion: BranchMotion, excess: np.ndarray) -> Finer:
    """Return it with the elements divided whose errors are too large, and those beside them that are equally long.

    Args:
        motion: the motion, maybe with further bounds.
        excess: by how much the errors are too large, one where they are not, (number of elements).
    """
    excess = excess ** (1 / (2 * motion.transcription.options.tableau.stages))
    parts = np.where(excess > 1, np.clip(np.ceil(excess), 2, MOST_PARTS), 1).astype(int)
    equally_long = np.array(motion.polisher.equally_long(motion.branch), dtype=int)
    runs = np.split(parts, np.setdiff1d(np.arange(1, len(parts)), equally_long + 1))
    divided = [int(run.max()) for run in runs for _ in run]
    return Finer(with_parts(motion, divided))


def _with_more_bounds(solved: SolvedMotion, violated: Sequence[Violated]) -> Iterator[Finer]:
    """Yield it with all bounds that are violated between stages, and with those of them that are violated least."""
    few = violated
    while few:
        finer = with_bounds(solved, [one.bound for one in few])
        yield finer
        if few is violated:
            yield finer._replace(freer=False, repair=True)
        few = few[: len(few) // 2]
