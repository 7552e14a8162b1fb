"""Where a trajectory leaves its bounds between the stages of an element, at which alone a transcription holds them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.fesd.added_rows import AddedRows, BoundBetween
from fesd_robot.fesd.polishing import ElementConditions
from fesd_robot.fesd.schemes import lagrange
from fesd_robot.fesd.transcription import Transcription

BETWEEN = 24
"""Equal parts of an element at whose ends it is looked at."""

VIOLATION = 5e-7
"""Violation of a bound between stages above which it is held there too, in the unit of the variable."""


def violated_between_stages(
    transcription: Transcription, conditions: ElementConditions, w: np.ndarray, branch: Branch
) -> list[BoundBetween]:
    """Return the bounds that are violated between the stages of elements.

    Looked at are the states with their limits, gaps among them, and the multipliers of the conditions, which are not
    negative: at the left boundary, where controls jump, a negative one is a contact that pulls or leaves its cone.

    Args:
        transcription: of a collocation scheme.
        conditions: what can vanish in an element, `BranchTranscription.conditions`.
        w: a point of it on a branch, (n).
        branch: the branch.
    """
    ocp, tableau = transcription.ocp, transcription.options.tableau
    fractions = np.linspace(0, 1, BETWEEN + 1)
    of_states, of_stages = lagrange(tableau.nodes, fractions[1:]), lagrange(tableau.c, fractions)
    n_x = ocp.system.state.numel()
    multipliers = sorted({v for one in conditions.members for v in conditions.variables(one.H) if v >= n_x})
    found: list[BoundBetween] = []
    for e, element in enumerate(transcription.unpack(w)):
        if branch.without_length[e] or element.step <= 0:
            continue
        x = of_states @ np.vstack([element.x_left, element.x[: tableau.stages]])
        z = of_stages @ element.z[: tableau.stages]
        for i, bounds in enumerate(zip(ocp.state_lower, ocp.state_upper, strict=True)):
            found += _violated((e, i), x[:, i], bounds)
        for i in multipliers:
            found += _violated((e, i), z[:, i - n_x], (0.0, np.inf))
    return found


def with_bounds_between(transcription: Transcription, bounds: Sequence[BoundBetween]) -> Transcription:
    """Return the transcription with further bounds between stages; a point of one is a point of the other."""
    added = transcription.added
    new = [one for one in bounds if one not in added.bounds]
    return replace(transcription, added=AddedRows(added.ratios, (*added.bounds, *new)))


def _violated(where: tuple[int, int], values: np.ndarray, bounds: tuple[float, float]) -> Iterator[BoundBetween]:
    """Yield the bounds that values of a variable of an element violate."""
    for sign, limit in zip((-1, 1), bounds, strict=True):
        if np.isfinite(limit) and (sign * (values - limit)).max() > VIOLATION:
            yield BoundBetween(*where, sign, float(limit))
