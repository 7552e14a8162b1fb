"""What contacts and joints with dry friction do while time runs."""

from __future__ import annotations

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
