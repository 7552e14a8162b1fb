"""Elements of a motion in which its contacts have to be held in postures where Coulomb's law decides."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import NamedTuple

import casadi as ca
import numpy as np

from fesd_robot.contact import ContactMode, contact_modes
from fesd_robot.fesd import STRICTER, PathBetween
from fesd_robot.ocp import DeterminacyConstraint
from fesd_robot.refinement.finer import Finer, with_bounds
from fesd_robot.refinement.solved_motion import SolvedMotion

FOLLOWED = 1e-3
"""m/s or rad/s; a control interval whose replay ends this close to the plan is the plan's motion."""

UNEXPLAINED = 200.0
"""How many times the local error of a control interval's elements its replay must leave the plan by, if that is not to
be for the error: before refinement it is up to a hundred times, where no other motion obeys Coulomb's law."""

NEGLIGIBLE = 1e-6
"""By how much a posture may miss them; rows that are held leave less."""

HALF = 0.5
"""Of what is missing: the step towards such postures if they are too far."""

_OPEN = (ContactMode.FLIGHT, ContactMode.IMPACT)


def with_determinate_postures(solved: SolvedMotion) -> Iterator[Finer]:
    """Yield a motion held in postures where rigid bodies decide it, if it is not: all of the way at once, then half.

    Looked at are the control intervals that a replay leaves by more than local errors explain, and in them the elements
    in which a contact is closed in a posture where several motions obey Coulomb's law, or none that is near: there a
    force at the edge of its cone is no beginning of a slip. What is held already, at places in an element, and missed
    between them, becomes stricter.

    Args:
        solved: an exact motion.
    """
    missing = list(_missing(solved))
    left = _left_by_the_replay(solved, {one.interval for one in missing}) if missing else set()
    missing = [one for one in missing if one.interval in left]
    if not missing:
        return
    held = {(one.constraint, one.element): one.margin for one in solved.transcription.added.paths}
    for step in (0.0, HALF):
        paths = [
            PathBetween(one.constraint, one.element, _margin(held.get((one.constraint, one.element)), one.by, step))
            for one in missing
        ]
        yield with_bounds(solved, paths)


def _margin(held: float | None, by: float, step: float) -> float:
    """Return how strictly a posture is to be held that misses its bounds by something, if at all already.

    Args:
        held: how strictly it is, negative on the way there; None if it is not.
        by: what is missing.
        step: the part of the way that is left for later.
    """
    if held is None or held < 0:
        return step * (-by if held is None else held)
    return held + STRICTER * (1 - step) * by


class _Missing(NamedTuple):
    """A posture of an element, and by how much it violates a constraint."""

    constraint: int
    element: int
    interval: int
    by: float


def _missing(solved: SolvedMotion) -> Iterator[_Missing]:
    """Yield where contacts are closed in postures in which Coulomb's law does not decide."""
    elements = solved.on_branch.elements
    modes = [contact_modes(solved.on_branch.branch, e) for e in range(len(elements))]
    for number, constraint in enumerate(solved.transcription.constraints):
        if not isinstance(constraint, DeterminacyConstraint):
            continue
        rows = ca.Function("rows", [constraint.variables], [constraint.rows])
        for e, element in enumerate(elements):
            if modes[e][constraint.contact] in _OPEN:
                continue
            stages = range(len(element.slopes))
            points = np.array([np.concatenate([element.x[j], element.u, element.z[j]]) for j in stages])
            by = float(np.max(constraint.lower[:, None] - rows(points.T).full()))
            if by > NEGLIGIBLE:
                yield _Missing(number, e, element.interval, by)


def _left_by_the_replay(solved: SolvedMotion, among: Collection[int]) -> set[int]:
    """Return which control intervals a replay leaves by more than the local errors of their elements explain."""
    elements = solved.on_branch.elements
    largest = 1 + max(float(np.abs(element.x).max()) for element in elements)
    followed: dict[int, float] = {}
    for element, error in zip(elements, solved.local_errors, strict=True):
        most = max(FOLLOWED, UNEXPLAINED * error * largest)
        followed[element.interval] = max(followed.get(element.interval, 0.0), most)
    return {
        one.interval
        for one in solved.replay_among(among).intervals
        if not np.abs(one.velocity_error).max() <= followed[one.interval]
    }
