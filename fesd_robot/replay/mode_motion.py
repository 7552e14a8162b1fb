"""The motion in a choice of modes of contacts and joints with dry friction, and how well it obeys their laws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fesd_robot.contact import Modes

ZERO_TANGENTIAL_VELOCITY = 1e-5
"""Tangential velocity, m/s, up to which a closed contact may stick; of a joint, m/s or rad/s."""

ADMISSIBLE = 1e-9
"""By how much a condition of a mode may be violated, as a ratio of the largest of the forces or accelerations."""


def scale_of(values: np.ndarray) -> float:
    """Return the scale of violations that are compared with `ADMISSIBLE`: 1 + the largest of some values."""
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
        joint_headings: direction in which what rubs on a limit surface slides, (n_f); 1 of joints by themselves.
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
    joints: Modes
    headings: np.ndarray
    joint_headings: np.ndarray
    tolerance: float = ADMISSIBLE
    shared_otherwise: bool = False

    @property
    def admissible(self) -> bool:
        """Whether Coulomb's law and unilateral contact allow the modes."""
        return min(self.margin, self.motion_margin) >= -self.tolerance
