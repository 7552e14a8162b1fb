"""Where a trajectory leaves its bounds between the stages of an element, at which alone a transcription holds them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.fesd.added_rows import AddedRows, BoundBetween
from fesd_robot.fesd.polishing import ElementConditions
from fesd_robot.fesd.schemes import lagrange
from fesd_robot.fesd.trajectory import Element
from fesd_robot.fesd.transcription import Transcription

BETWEEN = 24
"""Equal parts of an element at whose ends it is looked at."""

VIOLATION = 5e-7
"""Violation of a bound between stages above which it is held there too, in the unit of the variable."""

PENETRATION = 4e-6
"""The same for gaps, m, of which half is left: a foot that lands without acceleration has a flat gap, all of which a
stricter bound would touch."""


def violated_between_stages(
    transcription: Transcription, conditions: ElementConditions, w: np.ndarray, branch: Branch
) -> list[BoundBetween]:
    """Return the bounds that are violated between the stages of elements, the least violated first.

    Looked at are the states with their limits, gaps among them, and the multipliers of the conditions, which are not
    negative: at the left boundary, where controls jump, a negative one is a contact that pulls or leaves its cone. The
    multipliers of a contact that opens inside a control interval have to be zero when it does: a force that ends
    although neither state nor control jumps is that of a motion that is not the only one (Painleve).

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
    gaps = {member.invariant_state for member in conditions.members}
    elements = transcription.unpack(w)
    found: list[tuple[float, BoundBetween]] = list(_ends_of_contact(conditions, elements, branch, n_x, tableau.stages))
    for e, element in enumerate(elements):
        if branch.without_length[e] or element.step <= 0:
            continue
        x = of_states @ np.vstack([element.x_left, element.x[: tableau.stages]])
        z = of_stages @ element.z[: tableau.stages]
        for i, (lower, upper) in enumerate(zip(ocp.state_lower, ocp.state_upper, strict=True)):
            found += _violated((e, i), x[:, i], (lower - PENETRATION / 2 if i in gaps else lower, upper))
        for i in multipliers:
            found += _violated((e, i), z[:, i - n_x], (0.0, np.inf))
    return [bound for _, bound in sorted(found, key=lambda one: one[0])]


def _ends_of_contact(
    conditions: ElementConditions, elements: Sequence[Element], branch: Branch, n_x: int, stages: int
) -> Iterator[tuple[float, BoundBetween]]:
    """Yield the multipliers of contacts that end at once inside a control interval, and their upper bound."""
    whole = [e for e, without in enumerate(branch.without_length) if not without and elements[e].step > 0]
    for e, following in pairwise(whole):
        if elements[e].interval != elements[following].interval:
            continue
        for at, member in enumerate(conditions.members):
            before, after = branch.factors[e][at], branch.factors[following][at]
            if member.invariant_state is None or before is not ActiveFactor.G or after is not ActiveFactor.H:
                continue
            for variable in conditions.variables(member.H):
                value = float(elements[e].z[stages - 1, variable - n_x])
                if value > VIOLATION:
                    yield value, BoundBetween(e, variable, 1, 0.0, end_only=True)


def with_bounds_between(transcription: Transcription, bounds: Sequence[BoundBetween]) -> Transcription:
    """Return the transcription with further bounds between stages; a point of one is a point of the other."""
    added = transcription.added
    new = [one for one in bounds if one not in added.bounds]
    return replace(transcription, added=AddedRows(added.ratios, (*added.bounds, *new)))


def _violated(
    where: tuple[int, int], values: np.ndarray, bounds: tuple[float, float]
) -> Iterator[tuple[float, BoundBetween]]:
    """Yield by how much values of a variable of an element violate their bounds, where they do, and these."""
    for sign, limit in zip((-1, 1), bounds, strict=True):
        excess = float((sign * (values - limit)).max())
        if np.isfinite(limit) and excess > VIOLATION:
            yield excess, BoundBetween(*where, sign, float(limit))
