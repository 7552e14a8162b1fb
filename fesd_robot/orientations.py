"""Orientations and turns by the names of their entries in q, and by their angles in tasks and reports.

An orientation is a joint ``J`` of a robot with the coordinates ``J.qx .qy .qz .qw``. Its angles are ``J.roll``,
``J.pitch`` and ``J.yaw``, rad, with R = Rz(yaw) Ry(pitch) Rx(roll), as URDF's rpy. As names of a deviation they are the
components of the rotation vector log(R_ref^T R) about the body's x, y and z.

A turn is that of a joint ``J`` without limits, as a continuous or a planar one, with the coordinates ``J.cos`` and
``J.sin``. Its angle, rad, is called ``J``; as a name of a deviation it is the turn from the reference, the short way.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    import numpy as np

QUATERNION = (".qx", ".qy", ".qz", ".qw")
ANGLES = (".roll", ".pitch", ".yaw")
COSINE_AND_SINE = (".cos", ".sin")

Value = TypeVar("Value")


def orientations_of(names: Collection[str]) -> list[str]:
    """Return the joints whose quaternion has all entries among the names of coordinates, in their order."""
    firsts = [name.removesuffix(QUATERNION[0]) for name in names if name.endswith(QUATERNION[0])]
    return [joint for joint in firsts if all(entry in names for entry in quaternion_of(joint))]


def quaternion_of(joint: str) -> list[str]:
    """Return the names of the entries of a joint's quaternion: x, y, z, w."""
    return [joint + suffix for suffix in QUATERNION]


def angles_of(joint: str) -> list[str]:
    """Return the names of a joint's roll, pitch and yaw."""
    return [joint + suffix for suffix in ANGLES]


def turns_of(names: Collection[str]) -> list[str]:
    """Return the joints, and by that their angles, whose cosine and sine are among names of coordinates, in order."""
    firsts = [name.removesuffix(COSINE_AND_SINE[0]) for name in names if name.endswith(COSINE_AND_SINE[0])]
    return [joint for joint in firsts if all(entry in names for entry in turn_of(joint))]


def turn_of(joint: str) -> list[str]:
    """Return the names of the cosine and the sine of a joint."""
    return [joint + suffix for suffix in COSINE_AND_SINE]


def deviation_names(names: Collection[str]) -> list[str]:
    """Return the names of a deviation: those of the coordinates, with angles in the place of quaternions and turns."""
    angles = {quaternion_of(joint)[0]: angles_of(joint) for joint in orientations_of(names)}
    angles |= {turn_of(joint)[0]: [joint] for joint in turns_of(names)}
    parts = {entry for joint in orientations_of(names) for entry in quaternion_of(joint)}
    parts |= {entry for joint in turns_of(names) for entry in turn_of(joint)}
    found: list[str] = []
    for name in names:
        if name in angles:
            found += angles[name]
        elif name not in parts:
            found.append(name)
    return found


def value_names(names: Iterable[str]) -> list[str]:
    """Return the names by which a configuration may be written: those of the coordinates, and angles."""
    own = list(names)
    return [*own, *angle_names(own)]


def angle_names(names: Collection[str]) -> list[str]:
    """Return the angles of orientations and turns that are no coordinates themselves."""
    return [*(angle for joint in orientations_of(names) for angle in angles_of(joint)), *turns_of(names)]


def lists(values: Collection[str], name: str) -> bool:
    """Return whether a configuration with these names determines a coordinate, or an angle of a deviation."""
    joint, dot, suffix = name.rpartition(".")
    if name in values or all(entry in values for entry in turn_of(name)):
        return True
    if dot + suffix not in ANGLES:
        return False
    return any(entry in values for entry in (*angles_of(joint), *quaternion_of(joint)))


def layered(below: Mapping[str, Value], above: Mapping[str, Value]) -> dict[str, Value]:
    """Merge values, those above first; a quaternion, or a cosine and sine, takes away the angles below it."""
    hidden = set(angle_names(above))
    return {**{name: value for name, value in below.items() if name not in hidden}, **above}


def quaternion_entries(names: Sequence[str]) -> dict[str, slice]:
    """Return joint -> the entries of its unit quaternion (x, y, z, w) in q.

    Args:
        names: of the coordinates of q, (n_q).
    """
    own = list(names)
    starts = {joint: own.index(quaternion_of(joint)[0]) for joint in orientations_of(own)}
    return {joint: slice(start, start + 4) for joint, start in starts.items()}


def turn_entries(names: Sequence[str]) -> dict[str, slice]:
    """Return joint -> the entries of its cosine and sine in q.

    Args:
        names: of the coordinates of q, (n_q).
    """
    own = list(names)
    starts = {joint: own.index(turn_of(joint)[0]) for joint in turns_of(own)}
    return {joint: slice(start, start + 2) for joint, start in starts.items()}


def unit_entries(names: Sequence[str]) -> list[slice]:
    """Return the entries of q that have the length one together: quaternions, and cosines with their sines."""
    return [*quaternion_entries(names).values(), *turn_entries(names).values()]


def with_unit_quaternions(names: Sequence[str], q: np.ndarray) -> np.ndarray:
    """Return configurations, (n, n_q) or (n_q), with quaternions of length one; q itself if there are none."""
    own = quaternion_entries(names)
    if not own:
        return q
    import numpy as np

    found = np.array(q, dtype=float)
    for at in own.values():
        x, y, z, w = np.moveaxis(found[..., at], -1, 0)  # summed in one order, whatever the shape
        found[..., at] /= np.sqrt(x * x + y * y + z * z + w * w)[..., None]
    return found


def roll_pitch_yaw(quaternion: np.ndarray) -> np.ndarray:
    """Return roll, pitch and yaw, rad, (..., 3), of quaternions (..., 4): R = Rz(yaw) Ry(pitch) Rx(roll).

    Pitch and roll are those of Rz(yaw)^T R, so that the three give R also at a pitch of a right angle.
    """
    import numpy as np

    x, y, z, w = np.moveaxis(np.asarray(quaternion, dtype=float), -1, 0)
    length = x * x + y * y + z * z + w * w
    r00, r10, r20 = length - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)
    r01, r11 = 2 * (x * y - w * z), length - 2 * (x * x + z * z)
    r02, r12 = 2 * (x * z + w * y), 2 * (y * z - w * x)
    yaw = np.arctan2(r10, r00)
    cos, sin = np.cos(yaw), np.sin(yaw)
    pitch = np.arctan2(-r20, cos * r00 + sin * r10)
    roll = np.arctan2(sin * r02 - cos * r12, cos * r11 - sin * r01)
    return np.stack([roll, pitch, yaw], axis=-1) + 0.0


def with_angles(values: Mapping[str, float]) -> dict[str, float]:
    """Return values by name with angles, rad, in the place of every quaternion, and of every cosine and sine."""
    import numpy as np

    found = dict(values)
    for joint in orientations_of(values):
        quaternion = np.array([values[entry] for entry in quaternion_of(joint)])
        found |= dict(zip(angles_of(joint), roll_pitch_yaw(quaternion).tolist(), strict=True))
    for joint in turns_of(values):
        cosine, sine = (values[entry] for entry in turn_of(joint))
        found[joint] = math.atan2(sine, cosine)
    return {name: found[name] for name in deviation_names(values)}


def columns_with_angles(columns: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return a motion by name, (n) each, with angles in the place of quaternions and turns; no jumps by 2 pi."""
    import numpy as np

    found = dict(columns)
    for joint in orientations_of(columns):
        rows = np.column_stack([columns[entry] for entry in quaternion_of(joint)])
        found |= dict(zip(angles_of(joint), np.unwrap(roll_pitch_yaw(rows), axis=0).T, strict=True))
    for joint in turns_of(columns):
        cosine, sine = (columns[entry] for entry in turn_of(joint))
        found[joint] = np.unwrap(np.arctan2(sine, cosine))
    return {name: found[name] for name in deviation_names(columns)}
