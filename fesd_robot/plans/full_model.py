"""The motion of a plan on all joints of the model file, with the effort of every motor and the force on every foot."""

from __future__ import annotations

from typing import Literal

from fesd_robot.plans.record import Array, Record
from fesd_robot.recovery import FullMotion

BASE_UNITS = {"x": "m", "y": "m", "z": "m", "qx": "1", "qy": "1", "qz": "1", "qw": "1"}
"""Entry of the pose of the base in the world -> its unit; position and quaternion."""


class JointMotion(Record):
    """One joint of the model file along `Trajectory.time`.

    Attributes:
        unit: ``rad`` or ``m``.
        position, velocity: rad or m and rad/s or m/s, shape (n,).
        effort: what its motor gives, N m or N, shape (n,); what holds a locked joint; zero where nothing drives it.
    """

    unit: Literal["rad", "m"]
    position: Array
    velocity: Array
    effort: Array

    @property
    def effort_unit(self) -> str:
        """``N m`` or ``N``."""
        return "N" if self.unit == "m" else "N m"


class FootForce(Record):
    """The force on one of the feet that a contact stands for, N, shape (n,); directions are those of the contact."""

    contact: str
    normal_force: Array
    tangential_force: Array


class FullModelMotion(Record):
    """A planned motion by the joints of the model file, locked and coupled ones too.

    The efforts are those that the model with nothing locked or coupled needs for the motion, by inverse dynamics. Those
    of joints that move in unison add up to the control which the plan has for all of them.

    Attributes:
        joints: name -> motion of every joint with one degree of freedom, without those of the root.
        base: pose of the first link in the world along the samples, by the keys of `BASE_UNITS`; None if it is fixed or
            the joint under it has one degree of freedom.
        feet: name of a frame -> force, for contacts that stand for several feet, which share its force equally.
    """

    joints: dict[str, JointMotion]
    base: dict[str, Array] | None
    feet: dict[str, FootForce]


def full_model_of(motion: FullMotion) -> FullModelMotion:
    """Return a motion on the full model by name."""
    joints = {
        name: JointMotion.model_validate({"unit": unit, "position": position, "velocity": velocity, "effort": effort})
        for name, unit, position, velocity, effort in zip(
            motion.joints, motion.units, motion.position.T, motion.velocity.T, motion.effort.T, strict=True
        )
    }
    base = None if motion.base is None else dict(zip(BASE_UNITS, motion.base.T, strict=True))
    feet, forces = {}, iter(motion.foot_force.transpose(1, 2, 0))
    for contact, frames in motion.feet.items():
        for frame, (normal, tangential, *_) in zip(frames, forces, strict=False):
            if len(frames) > 1:
                feet[frame] = FootForce(contact=contact, normal_force=normal, tangential_force=tangential)
    return FullModelMotion(joints=joints, base=base, feet=feet)
