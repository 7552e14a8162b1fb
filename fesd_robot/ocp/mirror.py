"""Contacts that change places where a gait goes on as its own mirror image."""

from __future__ import annotations

import numpy as np

from fesd_robot.ocp.formulation import MotionProblem
from fesd_robot.ocp.judged import numeric_physics
from fesd_robot.ocp.vectors import mirrored

SAME = 1e-9
"""m; difference of gaps up to which they are each other's image."""


def contact_images(motion: MotionProblem) -> np.ndarray:
    """Return the number of the contact whose gap every contact has in a mirrored configuration, (n_c).

    Of a task without a periodic goal, or without a mirror in it, every contact is its own image; -1 is one that has
    none.

    Args:
        motion: the formulated task.
    """
    names, count = motion.robot.configuration_names, len(motion.contacts)
    numbers = mirrored(motion.task, names, np.arange(1.0, 1 + len(names)))
    sources, signs = np.abs(numbers).astype(int) - 1, np.sign(numbers)
    physics = numeric_physics(motion)
    at = [0.1 * np.sin(np.arange(len(names)) + k) for k in range(3)]
    own = np.array([physics.gaps(each) for each in at]).reshape(3, count)
    image = np.array([physics.gaps(signs * each[sources]) for each in at]).reshape(3, count)
    found: list[int] = []
    for i in range(count):
        same = [k for k in range(count) if k not in found and np.abs(image[:, i] - own[:, k]).max() <= SAME]
        found.append(i if i in same else same[0] if same else -1)
    return np.array(found, dtype=int)
