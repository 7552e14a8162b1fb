"""The same trajectory with more stages: where a refined transcription starts from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fesd_robot.fesd.schemes import lagrange
from fesd_robot.fesd.tableau import Tableau, make_tableau
from fesd_robot.fesd.trajectory import Element
from fesd_robot.fesd.transcription import Transcription


def with_stages(transcription: Transcription, w: np.ndarray, stages: int) -> tuple[Transcription, np.ndarray]:
    """Return the transcription of the same problem with other stages, and its point that interpolates one of the first.

    Every element keeps its length and control. States follow its collocation polynomial; algebraic variables and slopes
    the polynomials through their values at the stages.

    Args:
        transcription: of a collocation scheme.
        w: a point of it, (n).
        stages: number of stages of every element.
    """
    old = transcription.options.tableau
    new = make_tableau(old.scheme, stages)
    refined = replace(transcription, options=replace(transcription.options, tableau=new))
    return refined, refined.pack(interpolated(transcription.unpack(w), old, new))


def interpolated(elements: Sequence[Element], old: Tableau, new: Tableau) -> list[Element]:
    """Return the elements with the stages of another tableau."""
    at_stages = lagrange(old.c, new.c)
    end = [] if new.ends_at_stage else [1.0]
    return [
        replace(
            element,
            x=old.interpolate(np.vstack([element.x_left, element.x[: old.stages]]), np.append(new.c, end)),
            z=np.vstack([at_stages @ element.z[: old.stages], element.z[old.stages :]]),
            slopes=at_stages @ element.slopes,
        )
        for element in elements
    ]
