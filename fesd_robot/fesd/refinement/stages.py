"""The same trajectory with more stages: where a refined transcription starts from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fesd_robot.fesd.polishing import BranchMotion
from fesd_robot.fesd.schemes import lagrange
from fesd_robot.fesd.tableau import Tableau, make_tableau
from fesd_robot.fesd.trajectory import Element


def with_stages(motion: BranchMotion, stages: int) -> BranchMotion:
    """Return a trajectory with other stages, which interpolate its own.

    Every element keeps its length and control. States follow its collocation polynomial; algebraic variables and slopes
    the polynomials through their values at the stages.

    Args:
        motion: of a collocation scheme.
        stages: number of stages of every element.
    """
    transcription = motion.transcription
    old = transcription.options.tableau
    new = make_tableau(old.scheme, stages)
    refined = replace(transcription, options=replace(transcription.options, tableau=new))
    return BranchMotion.of(refined, refined.pack(interpolated(motion.elements, old, new)), motion.branch)


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
