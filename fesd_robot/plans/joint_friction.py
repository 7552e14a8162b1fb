"""The dry friction of joints in a plan."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from fesd_robot.contact import ContactMode
from fesd_robot.plans.record import Array, Record
from fesd_robot.recovery import PhysicalMotion


class JointFrictionHistory(Record):
    """Dry friction of one joint along `Trajectory.time`.

    Attributes:
        unit: ``N`` or ``N m``.
        limit: F: the friction is -F sgn(v) where the joint moves, and in [-F, F] where it sticks.
        force: of the friction on the joint, N or N m, shape (n,); zero at a state that an impact at the end leaves.
        mode: what it does at each sample: stick or slip.
        work: of the friction over the whole motion, J; negative where it has taken energy.
    """

    unit: Literal["N", "N m"]
    limit: float
    force: Array
    mode: list[Literal[ContactMode.STICK, ContactMode.SLIP]]
    work: float


class JointSwitch(Record):
    """A joint with dry friction that stops, breaks away or reverses at one moment; `time` in s of physical time."""

    time: float
    joint: str
    kind: Literal["stick_to_slip", "slip_to_stick", "slip_reversal"]

    @property
    def in_words(self) -> str:
        """What the joint does."""
        return {
            "stick_to_slip": "breaks away",
            "slip_to_stick": "stops and sticks",
            "slip_reversal": "turns round",
        }[self.kind]


def joint_friction_of(motion: PhysicalMotion, velocity_units: Mapping[str, str]) -> dict[str, JointFrictionHistory]:
    """Return name of every velocity coordinate with dry friction -> its history.

    Args:
        motion: the trajectory in physical time.
        velocity_units: name of each velocity coordinate -> its unit.
    """
    joints = motion.joints
    if joints is None:
        return {}
    names = list(velocity_units)
    work = motion.weight @ (joints.force * motion.velocity[:, joints.rows])
    return {
        names[row]: JointFrictionHistory(
            unit="N" if velocity_units[names[row]] == "m/s" else "N m",
            limit=float(joints.limit[i]),
            force=joints.force[:, i],
            mode=list(joints.mode[:, i]),
            work=float(work[i]),
        )
        for i, row in enumerate(joints.rows)
    }


def joint_switches_of(motion: PhysicalMotion, velocity_names: list[str]) -> list[JointSwitch]:
    """Return the changes between sticking and sliding of all joints in time order."""
    joints = motion.joints
    if joints is None:
        return []
    return [
        JointSwitch.model_validate({"time": s.time, "joint": velocity_names[joints.rows[s.contact]], "kind": s.kind})
        for s in joints.switches
    ]
