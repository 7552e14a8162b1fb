"""The same trajectory with elements in several equal parts of the same mode."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fesd_robot.complementarity import ActiveFactor
from fesd_robot.fesd.polishing import BranchMotion
from fesd_robot.fesd.schemes import lagrange
from fesd_robot.fesd.tableau import Tableau
from fesd_robot.fesd.trajectory import Element
from fesd_robot.fesd.transcription import Transcription


def with_parts(motion: BranchMotion, parts: Sequence[int]) -> BranchMotion:
    """Return a trajectory with elements in equal parts, whose points lie on the same polynomials.

    All parts of an element are in its mode, and the branch NLP gives them the same length, so that there is one length
    to choose as before. No element becomes longer than it could be before.

    Args:
        motion: of a collocation scheme.
        parts: number of parts of every element, (number of elements).
    """
    transcription, branch = motion.transcription, motion.branch
    tableau, counts = transcription.options.tableau, transcription.elements
    last = np.cumsum(counts)
    intervals = [sum(parts[end - count : end]) for count, end in zip(counts, last, strict=True)]
    growth = max(new / old for new, old in zip(intervals, counts, strict=True))
    options = replace(
        transcription.options,
        elements=tuple(intervals),
        step_freedom=(1 + transcription.options.gamma) * growth - 1,
    )
    refined = replace(transcription, options=options, added=transcription.added.in_parts(parts))
    elements = [
        part
        for element, count in zip(motion.elements, parts, strict=True)
        for part in element_in_parts(element, count, tableau)
    ]
    repeated = np.repeat(np.arange(len(parts)), parts)
    divided = replace(
        branch,
        factors=_without_repeated_jumps([branch.factors[e] for e in repeated], repeated, refined),
        without_length=tuple(branch.without_length[e] for e in repeated),
    )
    return BranchMotion.of(refined, refined.pack(elements), divided)


def _without_repeated_jumps(
    factors: list[tuple[ActiveFactor, ...]], sources: np.ndarray, refined: Transcription
) -> tuple[tuple[ActiveFactor, ...], ...]:
    """Return the factors of all parts; impulses act at the left boundary of the first part of an element only.

    Args:
        factors: of the elements that the parts belong to.
        sources: numbers of these, one a part.
        refined: the transcription with the parts.
    """
    jump, system = refined.ocp.system.jump, refined.ocp.system
    if jump is None:
        return tuple(factors)
    own = len(system.pairs) + len(system.vanishing)
    first = np.append(True, sources[1:] != sources[:-1])
    none = (ActiveFactor.H,) * len(jump.complementarities(system.pairs))
    return tuple(one if begins else (*one[:own], *none) for one, begins in zip(factors, first, strict=True))


def element_in_parts(element: Element, count: int, tableau: Tableau) -> list[Element]:
    """Return an element as several of equal length, whose points lie on its polynomials.

    Args:
        element: of a collocation scheme.
        count: number of parts.
        tableau: the scheme.
    """
    if count == 1:
        return [element]
    values, z_left, parts = np.vstack([element.x_left, element.x[: tableau.stages]]), element.z_left, []
    for i in range(count):
        stages = (i + tableau.c) / count
        ends = np.array([i, i + 1]) / count
        at_stages = lagrange(tableau.c, stages)
        points = stages if tableau.ends_at_stage else np.append(stages, ends[1])
        z = at_stages @ element.z[: tableau.stages]
        if len(element.z) > tableau.stages:
            z = np.vstack([z, lagrange(tableau.c, ends[1:]) @ element.z[: tableau.stages]])
        x_left = tableau.interpolate(values, ends[:1])[0]
        inside = i > 0 and element.before_jump is not None
        parts.append(
            replace(
                element,
                start=element.start + ends[0] * element.step,
                step=element.step / count,
                x_left=x_left,
                z_left=z_left,
                x=tableau.interpolate(values, points),
                z=z,
                slopes=at_stages @ element.slopes,
                jump=np.zeros_like(element.jump) if inside else element.jump,
                before_jump=x_left if inside else element.before_jump,
            )
        )
        z_left = z[-1]
    return parts
