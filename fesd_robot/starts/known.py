"""A start from an earlier plan that keeps its contact sequence, whatever the grid, the scheme and the costs are now."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, cast

import numpy as np

from fesd_robot.complementarity import ActiveFactor, Branch, Label
from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.fesd import AddedRows, BoundBetween, ControlGrid, Element, PathBetween, Transcription, make_tableau
from fesd_robot.fesd.neighbours import CLOCK, KnownTrajectory, on_grid
from fesd_robot.fesd.polishing import BranchMotion, BranchTranscription, conditions_of
from fesd_robot.instants import SAME_PART
from fesd_robot.mpcc import MpccSolution, PolishingReport, Run
from fesd_robot.nlp import NlpPoint
from fesd_robot.ocp import MotionProblem, is_plan
from fesd_robot.plans import BranchNlpRecord, FiniteElements, Multipliers, Plan, read_plan
from fesd_robot.refinement import Neighbourhood, exact_end
from fesd_robot.task import Task

_LETTERS = {ActiveFactor.G: "G", ActiveFactor.H: "H", ActiveFactor.COMPLEMENT: "C"}
_FACTORS = {letter: factor for factor, letter in _LETTERS.items()}

logger = logging.getLogger(__name__)


def finite_elements_of(motion: BranchMotion) -> FiniteElements:
    """Return an exact motion in numbers."""
    transcription, branch, elements = motion.transcription, motion.branch, motion.elements
    system = transcription.ocp.system
    letters = ("".join(_LETTERS[factor] for factor in factors) for factors in branch.factors)
    return FiniteElements(
        scheme=cast(Any, transcription.options.tableau.scheme),  # one of those that a task may ask for
        stages=transcription.options.tableau.stages,
        states=list(system.state_names),
        conditions=_names(branch.conditions),
        interval=np.array([element.interval for element in elements]),
        step=np.array([element.step for element in elements]),
        left=np.concatenate([elements[0].x_before, elements[0].z_left]),
        states_at=np.concatenate([element.x.ravel() for element in elements]),
        algebraic_at=np.concatenate([element.z.ravel() for element in elements]),
        slopes=np.concatenate([element.slopes.ravel() for element in elements]),
        controls=np.concatenate([element.u for element in elements]),
        active=[one.lower() if without else one for one, without in zip(letters, branch.without_length, strict=True)],
        lefts=None if system.jump is None else np.concatenate([element.x_left for element in elements]),
        nlp=_nlp_record(motion),
    )


def _nlp_record(motion: BranchMotion) -> BranchNlpRecord:
    transcription, added = motion.transcription, motion.transcription.added
    grid = transcription.grid
    return BranchNlpRecord(
        lengths=np.array(grid.lengths),
        phases=list(grid.phases),
        knots=list(grid.knots),
        moving=grid.moving,
        elements=list(transcription.elements),
        bounds=[(one.element, one.variable, one.sign, one.limit, one.end_only, one.of_mode) for one in added.bounds],
        paths=[(one.constraint, one.element, one.margin) for one in added.paths],
        of_bounds=Multipliers.of(motion.point.lam_x),
        of_rows=Multipliers.of(motion.point.lam_g),
    )


def kept_motion(plan: Plan, motion: MotionProblem) -> BranchMotion | None:
    """Return the motion of a plan, with its multipliers, on the grid and the elements on which it was solved.

    Args:
        plan: of this task, or of one that differs from it in numbers.
        motion: the task.

    Returns:
        None where the plan does not say them, or its states, contacts or grid are not those of the task.
    """
    record, system = plan.finite_elements, motion.ocp.system
    known = trajectory_of_plan(plan, system)
    if record is None or record.nlp is None or known is None:
        return None
    own = record.nlp
    grid = ControlGrid(tuple(own.lengths.tolist()), tuple(own.phases), own.moving, tuple(own.knots))
    fits = grid.moving == motion.grid.moving and (grid.moving or grid.intervals == motion.grid.intervals)
    if not fits or abs(grid.nodes[-1] - motion.grid.nominal) > SAME_PART * motion.grid.nominal:
        return None
    options = replace(motion.fesd, tableau=known.tableau, elements=tuple(own.elements))
    if grid.moving:
        options = replace(options, step_equilibration="none")
    bounds = tuple(BoundBetween(*one) for one in own.bounds)
    paths = tuple(PathBetween(*one) for one in own.paths)
    transcription = Transcription(motion.ocp, options, AddedRows(bounds, paths), grid if grid.moving else None)
    polisher, w = BranchTranscription(transcription), transcription.pack(known.elements)
    if (own.of_bounds.size, own.of_rows.size) != (len(w), polisher.problem.constraints):
        return None
    point = NlpPoint(w, own.of_bounds.vector, own.of_rows.vector)
    return BranchMotion(polisher, point, known.branch)


def warm_start(
    motion: MotionProblem,
    transcription: Transcription,
    run: Run,
) -> tuple[BranchTranscription, MpccSolution] | None:
    """Return the exact motion with the contact sequence of the plan that `solver.warm_start` names.

    The plan's elements are cut at the new ends of control intervals, and the branch NLP is solved from there; where it
    does not converge its neighbours are tried, as in `repair`. So a motion on a control grid that contains the plan's
    costs no more than the plan.

    Args:
        motion, transcription: the task.
        run: of all NLPs.

    Returns:
        None if no plan is named, or another start than it (`solver.seed`), or if its contacts do not fit, or lead to no
        motion: then its configurations are the initial guess, as those of any file.
    """
    known = earlier_trajectory(motion)
    if known is None:
        return None
    return exact_start(on_grid(known, transcription), run)


def earlier_trajectory(motion: MotionProblem) -> KnownTrajectory | None:
    """Return the elements of the plan that `solver.warm_start` names.

    Args:
        motion: the task.

    Returns:
        None if no plan is named, or another start than it (`solver.seed`), or if its contacts do not fit: then its
        configurations are the initial guess, as those of any file.
    """
    plan, name = named_plan(motion.task), motion.task.solver.warm_start
    known = trajectory_of_plan(plan, motion.ocp.system) if plan else None
    if plan and known is None:
        logger.warning(
            "%s: only the configurations are taken, its contacts and states are not those of this task", name
        )
    return known


def named_plan(task: Task) -> Plan | None:
    """Return the plan that `solver.warm_start` names, None if it names none, or another start than it."""
    name = task.solver.warm_start
    return (
        None if name is None or task.solver.seed or not is_plan(task.folder / name) else read_plan(task.folder / name)
    )


def trajectory_of_plan(plan: Plan, system: ComplementaritySystem) -> KnownTrajectory | None:
    """Return the elements of a plan, None if its contacts or states are not those of a system.

    Args:
        plan: whatever task it is of.
        system: of the task, whose state does not jump; there are none if it does.
    """
    record = plan.finite_elements
    return _known(record, system) if record and system.jump is None else None


def exact_start(motion: BranchMotion, run: Run) -> tuple[BranchTranscription, MpccSolution] | None:
    """Return the exact motion on a branch, or on one near by, from a point that need not satisfy anything.

    Args:
        motion: the point, and the branch.
        run: of all NLPs.

    Returns:
        None if none is found.
    """
    begin = time.perf_counter()
    around = Neighbourhood.of(motion, run)
    end = around.solver.exact(around.start, freer=True) or exact_end(around)
    return _with_own_elements(around, end, begin, run) if end else None


def _with_own_elements(
    around: Neighbourhood,
    end: PolishingReport,
    begin: float,
    run: Run,
) -> tuple[BranchTranscription, MpccSolution]:
    """Return an exact end as a solution with no more elements than it needs.

    Args:
        around, end: the motion.
        begin: when it was begun to look for it, s.
        run: as of `exact_start`.
    """
    return around.without_room(end, end.as_solution([], time.perf_counter() - begin), run)


def _names(conditions: Sequence[Label]) -> list[str]:
    """Return the names of conditions."""
    return [str(label) for label in conditions]


def _known(record: FiniteElements, system: ComplementaritySystem) -> KnownTrajectory | None:
    """Return the elements of a plan; None if they are not those of a system."""
    labels = conditions_of(system).labels
    n_x, n_z, n_u = system.state.numel(), system.algebraic.numel(), system.control.numel()
    count, tableau = len(record.step), make_tableau(record.scheme, record.stages)
    fits = record.states == list(system.state_names) and record.conditions == _names(labels)
    if not fits or len(record.left) != n_x + n_z or len(record.controls) != count * n_u:
        return None
    elements: list[Element] = []
    x_left, z_left = record.left[:n_x], record.left[n_x:]
    x, u = record.states_at.reshape(count, -1, n_x), record.controls.reshape(count, n_u)
    z, slopes = record.algebraic_at.reshape(count, x.shape[1], n_z), record.slopes.reshape(count, -1, n_x)
    ends = np.append(0.0, np.cumsum(record.step))
    for e, (start, end) in enumerate(pairwise(ends)):
        interval = int(record.interval[e])
        elements.append(Element(interval, start, end - start, x_left, z_left, x[e], z[e], u[e], slopes[e]))
        x_left, z_left = x[e, -1], z[e, -1]
    factors = tuple(tuple(_FACTORS[letter.upper()] for letter in one) for one in record.active)
    branch = Branch(tuple(labels), factors, tuple(one.islower() for one in record.active))
    return KnownTrajectory(elements, branch, tableau, record.states.index(CLOCK))
