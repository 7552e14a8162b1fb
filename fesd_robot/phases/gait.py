"""Where a gait goes on: which contacts take the places of others."""

from __future__ import annotations

from fesd_robot.ocp import MotionProblem, contact_images


def gait_images(motion: MotionProblem) -> tuple[int, ...]:
    """Return the numbers of the contacts whose places the contacts of a gait take where it goes on, (n_c).

    Nothing of a motion that does not repeat, of one whose mirror is none of its contacts, and of impacts that are
    impulses between elements: nothing hits where such a motion ends.

    Args:
        motion: the formulated task.
    """
    if motion.task.goal.periodic is None or motion.ocp.system.jump is not None:
        return ()
    images = contact_images(motion)
    return tuple(images.tolist()) if (images >= 0).all() else ()
