"""What contacts and joints with dry friction do while time runs."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

ZERO_TANGENTIAL_VELOCITY = 1e-5
"""Tangential velocity, m/s, up to which a closed contact may stick; of a joint, m/s or rad/s."""

ADMISSIBLE = 1e-9
"""By how much a condition of a mode may be violated, as a ratio of the largest of the forces or accelerations."""


class Mode(Enum):
    """What one contact, or one joint with dry friction, does while time runs.

    A contact without friction that is closed is in `SLIP_FORWARDS`; a joint is never in `FLIGHT`.
    """

    FLIGHT = "flight"
    STICK = "stick"
    SLIP_FORWARDS = "slip+"
    SLIP_BACKWARDS = "slip-"

    @property
    def direction(self) -> int:
        """Sign of the tangential velocity that the mode allows: 1, -1, or 0 for flight and stick."""
        return {Mode.SLIP_FORWARDS: 1, Mode.SLIP_BACKWARDS: -1}.get(self, 0)


Modes = tuple[Mode, ...]
"""One mode a contact, (n_c)."""

JointModes = tuple[Mode, ...]
"""One mode a joint with dry friction, (n_f)."""


def scale_of(values: np.ndarray) -> float:
    """Return by what a violation is divided that is compared with `ADMISSIBLE`: 1 + the largest of some values."""
    return 1.0 + float(np.abs(values).max(initial=0.0))


@dataclass(frozen=True)
class ModeMotion:
    """The motion that a choice of modes means, and how well it obeys Coulomb's law.

    Attributes:
        modes: of every contact, (n_c).
        acceleration: a, (n_v).
        force: normal and tangential, N, (n_c, rows).
        margin: smallest distance to a bound of the forces, as a ratio of the largest force; negative where a contact
            pulls or leaves the friction cone.
        motion_margin: the same for accelerations: open contacts must part, slip must begin in its direction, and the
            constraints must hold.
        joints: modes of the joints with dry friction, (n_f), as the friction law chooses them in these modes.
        proper: whether the normal accelerations of the closed contacts grow with their normal forces: the matrix
            between them, W_nn - mu s W_nt with sticking tangents eliminated, is a P-matrix. In a mode that is not,
            forces act in the wrong sense (Painleve).
        headings: direction in which every contact slides that slides forwards, (n_c, n_t).
        tolerance: by how much a condition may be violated, as a ratio.
        shared_otherwise: whether other accelerations are possible where redundant contacts that slide share their load
            in another way, each pressing on.
    """

    modes: Modes
    acceleration: np.ndarray
    force: np.ndarray
    margin: float
    motion_margin: float
    proper: bool
    joints: JointModes
    headings: np.ndarray
    tolerance: float = ADMISSIBLE
    shared_otherwise: bool = False

    @property
    def admissible(self) -> bool:
        """Whether Coulomb's law and unilateral contact allow the modes."""
        return min(self.margin, self.motion_margin) >= -self.tolerance
