"""The branch on which contacts do what is said of every element."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.contact import ContactMode
from fesd_robot.contact.kinds import (
    FORCE_AT_A_DISTANCE,
    FORCE_WHILE_PARTING,
    MOTION_DURING_IMPACT,
    RESTITUTION,
    SLIDING_INSIDE_CONE,
)
from fesd_robot.fesd.polishing import BranchTranscription

_IN_IMPACT = (FORCE_AT_A_DISTANCE, FORCE_WHILE_PARTING, RESTITUTION)
"""Kinds of conditions whose G an impact holds at zero."""


def branch_in_modes(polisher: BranchTranscription, w: np.ndarray, modes: Sequence[Mapping[str, ContactMode]]) -> Branch:
    """Return the branch on which contacts fly, hit or stick, and in space slide, as said; else what a point shows.

    Args:
        polisher: of the transcription.
        w: the point, (n).
        modes: of every element, name of a contact -> its mode.
    """
    shown = polisher.branch(w)
    cones = {one.contact for one in polisher.conditions.labels if one.kind == SLIDING_INSIDE_CONE}
    factors = []
    for own, chosen in zip(modes, shown.factors, strict=True):
        row = []
        for member, factor in zip(polisher.conditions.members, chosen, strict=True):
            condition = member.condition
            mode = None if condition.label.contact is None else own[condition.label.contact]
            slides = mode is ContactMode.SLIP and condition.label.contact in cones
            if slides and condition.label.kind == SLIDING_INSIDE_CONE:
                factor = ActiveFactor.H
            elif slides or mode is ContactMode.STICK or (mode is ContactMode.FLIGHT and condition.met_by):
                factor = ActiveFactor.G
            elif mode is ContactMode.FLIGHT:
                factor = ActiveFactor.H
            elif mode is ContactMode.IMPACT and condition.label.kind == MOTION_DURING_IMPACT:
                factor = ActiveFactor.COMPLEMENT
            elif mode is ContactMode.IMPACT and condition.label.kind in _IN_IMPACT:
                factor = ActiveFactor.G
            row.append(factor)
        factors.append(tuple(row))
    return replace(shown, factors=tuple(factors), without_length=(False,) * len(factors))
