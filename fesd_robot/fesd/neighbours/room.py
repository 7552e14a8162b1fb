"""The same trajectory with room for its switches: elements to spare, and any length for each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.fesd.trajectory import Element
from fesd_robot.fesd.transcription import Transcription

SPARE_ELEMENTS = 1
"""Elements that every interval gets: a touchdown with friction inside an interval needs four."""


def with_room(transcription: Transcription, w: np.ndarray, branch: Branch) -> tuple[Transcription, np.ndarray, Branch]:
    """Return the transcription with spare elements that may fill their interval, the same point of it, and its branch.

    Elements of one mode are equally long in a branch NLP anyway, so that step equilibration has no weight. The spare
    elements are the last of their intervals and have no length.

    Args:
        transcription: of a collocation scheme.
        w: a point of it, (n).
        branch: on which it lies.
    """
    counts = tuple(count + SPARE_ELEMENTS for count in transcription.elements)
    options = replace(transcription.options, elements=counts, step_freedom=max(counts) - 1.0, equilibration_weight=0.0)
    roomier = replace(transcription, options=options)
    elements: list[Element] = []
    source: list[int] = []
    old = transcription.unpack(w)
    for e, element in enumerate(old):
        elements.append(element)
        source.append(e)
        if e + 1 == len(old) or old[e + 1].interval != element.interval:
            elements += [_without_length(element)] * SPARE_ELEMENTS
            source += [e] * SPARE_ELEMENTS
    spare = [n > 0 and source[n] == source[n - 1] for n in range(len(source))]
    return (
        roomier,
        roomier.pack(elements),
        replace(
            branch,
            factors=tuple(branch.factors[e] for e in source),
            without_length=tuple(new or branch.without_length[e] for new, e in zip(spare, source, strict=True)),
        ),
    )


def without_spare_elements(
    transcription: Transcription, w: np.ndarray, branch: Branch
) -> tuple[Transcription, np.ndarray, Branch]:
    """Return the transcription without the elements that have no length, the same point of it, and its branch.

    Args:
        transcription: of a collocation scheme, without added rows.
        w: a point of it, (n).
        branch: on which it lies.
    """
    elements = transcription.unpack(w)
    kept = [e for e, spare in enumerate(branch.without_length) if not spare]
    counts = tuple(sum(elements[e].interval == k for e in kept) for k in range(transcription.ocp.intervals))
    fewer = replace(transcription, options=replace(transcription.options, elements=counts))
    point = fewer.pack([elements[e] for e in kept])
    return (
        fewer,
        point,
        replace(branch, factors=tuple(branch.factors[e] for e in kept), without_length=(False,) * len(kept)),
    )


def _without_length(element: Element) -> Element:
    """Return the element of no length that follows another."""
    end, z = element.x[-1], element.z[-1]
    return replace(
        element,
        start=element.end,
        step=0.0,
        x_left=end,
        z_left=z,
        x=np.repeat(end[None], len(element.x), axis=0),
        z=np.repeat(z[None], len(element.z), axis=0),
    )
