"""Actuators of a MuJoCo model as the forces that motors can give."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import mujoco
import numpy as np

from fesd_robot.robot.mjcf.compiled import name_of
from fesd_robot.robot.model_file import MultiJointMotor, note

_SINGLE = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
_ON_JOINT = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
_CONSTANT_GAIN = (int(mujoco.mjtGain.mjGAIN_FIXED), int(mujoco.mjtGain.mjGAIN_AFFINE))
"""Kinds as numbers: members of MuJoCo's enumerations are not found among NumPy's integers."""


class ForceRange(NamedTuple):
    """Bounds of a force, N or N m."""

    lower: float
    upper: float

    def times(self, factor: float) -> ForceRange:
        """Return the bounds of the force times a factor."""
        ends = [factor * end if factor else 0.0 for end in self]
        return ForceRange(min(ends), max(ends))

    def within(self, other: ForceRange) -> ForceRange:
        """Return the bounds that both keep to."""
        return ForceRange(*(float(np.clip(end, *other)) for end in self))


@dataclass
class Actuators:
    """Actuators of a model.

    Attributes:
        efforts: number of a joint -> bounds of the force on it, of all its motors together.
        drives: name of an actuator on several joints -> its drive.
        notes: what is read differently from the file or not at all, one sentence each.
    """

    efforts: dict[int, ForceRange] = field(default_factory=dict)
    drives: dict[str, MultiJointMotor] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def read_actuators(model: mujoco.MjModel) -> Actuators:
    """Return the forces of all actuators of a model.

    A motor's force is ``gear * gain * ctrl`` with ``ctrl`` in ``ctrlrange`` and ``gain * ctrl`` in ``forcerange``. A
    servo (position, velocity, general with a bias) can give any force in its ``forcerange``, and without one the forces
    between those at the ends of its ``ctrlrange`` and of its joint's range; the plan says which, and the servo's own
    law is left out. The force on a joint stays in its ``actuatorfrcrange``; in a file without actuators every joint
    that has one is driven.
    """
    result = Actuators()
    for index in range(model.nu):
        name, pushed = name_of(model, "actuator", index), _pushed(model, index)
        if pushed is None:
            result.notes.append(f"Actuator '{name}' pushes neither a joint nor a fixed tendon, and is not read.")
            continue
        force = _force(model, index, pushed)
        if force is None:
            result.notes.append(f"Actuator '{name}' has a gain that changes with its length, and is not read.")
            continue
        if model.actuator_dyntype[index] != mujoco.mjtDyn.mjDYN_NONE:
            result.notes.append(f"The activation dynamics of actuator '{name}' are left out: its force acts at once.")
        if not math.isfinite(force.upper - force.lower):
            result.notes.append(
                f"Actuator '{name}' has no limit of its force, and is not read; limits.effort gives it one."
            )
        elif len(pushed) > 1:
            joints = {name_of(model, "joint", joint): gear for joint, gear in pushed.items()}
            result.drives[name] = MultiJointMotor(joints, *force)
        else:
            joint, gear = next(iter(pushed.items()))
            here = result.efforts.get(joint, ForceRange(0.0, 0.0))
            more = force.times(gear)
            result.efforts[joint] = ForceRange(here.lower + more.lower, here.upper + more.upper)
    for number in np.flatnonzero(model.jnt_actfrclimited):
        joint = int(number)
        limits = ForceRange(*model.jnt_actfrcrange[joint])
        if not model.nu:
            result.efforts[joint] = limits
        elif joint in result.efforts:
            result.efforts[joint] = result.efforts[joint].within(limits)
    servos = [name_of(model, "actuator", index) for index in range(model.nu) if _is_servo(model, index)]
    result.notes += note(
        "Controls of servos ({}) are the forces they give, within their limits, not their set points.", servos
    )
    return result


def _pushed(model: mujoco.MjModel, index: int) -> dict[int, float] | None:
    """Return joint index -> its force per unit of an actuator's force; None where that changes with q."""
    gear, target = float(model.actuator_gear[index][0]), int(model.actuator_trnid[index][0])
    kind = model.actuator_trntype[index]
    if kind in _ON_JOINT:
        return {target: gear} if model.jnt_type[target] in _SINGLE else None
    if kind != mujoco.mjtTrn.mjTRN_TENDON:
        return None
    first = model.tendon_adr[target]
    wraps = range(first, first + model.tendon_num[target])
    if any(model.wrap_type[wrap] != mujoco.mjtWrap.mjWRAP_JOINT for wrap in wraps):
        return None
    return {int(model.wrap_objid[wrap]): gear * float(model.wrap_prm[wrap]) for wrap in wraps}


def _force(model: mujoco.MjModel, index: int, pushed: dict[int, float]) -> ForceRange | None:
    """Return the forces that an actuator can give, infinite without a limit; None if its gain is not constant."""
    if model.actuator_gaintype[index] not in _CONSTANT_GAIN:
        return None
    gain, slopes = float(model.actuator_gainprm[index][0]), model.actuator_gainprm[index][1:3]
    if model.actuator_gaintype[index] == mujoco.mjtGain.mjGAIN_AFFINE and np.any(slopes):
        return None
    force = ForceRange(-math.inf, math.inf)
    if model.actuator_ctrllimited[index]:
        force = ForceRange(*model.actuator_ctrlrange[index]).times(gain)
    if _is_servo(model, index):
        limits = np.array([_range(model, joint) for joint in pushed]) * np.array(list(pushed.values()))[:, None]
        constant, slope = model.actuator_biasprm[index][:2]
        bias = ForceRange(*np.sort(limits, axis=1).sum(axis=0)).times(float(slope))
        force = ForceRange(force.lower + bias.lower + constant, force.upper + bias.upper + constant)
    if model.actuator_forcelimited[index]:
        force = force.within(ForceRange(*model.actuator_forcerange[index]))
    return force


def _is_servo(model: mujoco.MjModel, index: int) -> bool:
    """Return whether an actuator's force depends on position or velocity."""
    return bool(model.actuator_biastype[index] != mujoco.mjtBias.mjBIAS_NONE)


def _range(model: mujoco.MjModel, joint: int) -> tuple[float, float]:
    limited = model.jnt_limited[joint]
    return tuple(model.jnt_range[joint]) if limited else (-math.inf, math.inf)
