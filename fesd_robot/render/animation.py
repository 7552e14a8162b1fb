"""The motion of a robot as key frames of nested joint nodes, and the box it sweeps."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
import umsgpack

from fesd_robot.exactness import ROUNDED
from fesd_robot.render.geometry import box_corners, file_unit
from fesd_robot.robot import continuous_quaternions


class Motion(NamedTuple):
    """Joint placements at key times.

    Args:
        time: key times since the first sample, s, float32, strictly increasing, shape (k,).
        placement: pose of each joint in its parent joint, position in m and unit quaternion (x, y, z, w),
            shape (k, njoints, 7); a quaternion never changes its sign between neighbours.
        box: corners of the axis-parallel box around all geometry at all samples, m, shape (2, 3).
        size: diagonal of that box at the first sample, m.
        boxes: corners of the box at every key time, m, shape (k, 2, 3); infinite for a robot without geometry.
    """

    time: np.ndarray
    placement: np.ndarray
    box: np.ndarray
    size: float
    boxes: np.ndarray


class Track:
    """One animated property in three.js's own binary form; meets the interface of Meshcat's `AnimationTrack`."""

    def __init__(self, name: str, kind: str, times: np.ndarray, values: np.ndarray) -> None:
        self.name = name
        self.kind = kind
        self.times = times
        self.values = values

    def lower(self) -> dict[str, Any]:
        return {
            "name": f".{self.name}",
            "type": self.kind,
            "times": _float32(self.times),
            "values": _float32(self.values),
        }


def _float32(array: np.ndarray) -> umsgpack.Ext:
    """Return `array` as the msgpack extension that the viewer decodes to a Float32Array."""
    return umsgpack.Ext(0x17, np.ascontiguousarray(array, dtype="<f4").tobytes())


def key_samples(time: np.ndarray) -> np.ndarray:
    """Return the indices of the samples to keep so that the key times increase strictly in single precision.

    An impact has two samples at the same time, before and after, with the same configuration; the second is dropped.

    Args:
        time: s, non-decreasing, shape (n,).
    """
    single = (time - time[0]).astype(np.float32)
    return np.concatenate([[0], 1 + np.flatnonzero(np.diff(single) > 0)])


def sample_motion(
    model: pin.Model, visual_model: pin.GeometryModel, time: np.ndarray, configuration: np.ndarray
) -> Motion:
    """Evaluate the forward kinematics at all key times.

    Args:
        model: the robot.
        visual_model: what it looks like.
        time: s, non-decreasing, shape (n,).
        configuration: shape (n, nq).
    """
    keys = key_samples(time)
    data, visual_data = model.createData(), visual_model.createData()
    placement = np.empty((len(keys), model.njoints, 7))
    corners = local_corners(visual_model)
    boxes = np.tile(np.array([[np.inf], [-np.inf]]), (len(keys), 1, 3))
    for row, key in enumerate(keys):
        pin.forwardKinematics(model, data, pin.normalize(model, configuration[key]))
        for joint in range(model.njoints):
            placement[row, joint] = pin.SE3ToXYZQUAT(data.liMi[joint])
        pin.updateGeometryPlacements(model, data, visual_model, visual_data)
        for index, points in corners.items():
            pose = visual_data.oMg[index]
            world = points @ pose.rotation.T + pose.translation
            boxes[row, 0] = np.minimum(boxes[row, 0], world.min(axis=0))
            boxes[row, 1] = np.maximum(boxes[row, 1], world.max(axis=0))
    for joint in range(model.njoints):
        placement[:, joint, 3:] = continuous_quaternions(placement[:, joint, 3:])
    size = float(np.linalg.norm(boxes[0, 1] - boxes[0, 0]))
    box = np.array([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])
    return Motion((time[keys] - time[0]).astype(np.float32), placement, box, size, boxes)


def joint_tracks(motion: Motion, joint: int) -> dict[str, Track]:
    """Return the tracks of one joint node; a coordinate that stands still needs none."""
    tracks = {}
    for name, kind, values in (
        ("position", "vector3", motion.placement[:, joint, :3]),
        ("quaternion", "quaternion", motion.placement[:, joint, 3:]),
    ):
        if np.ptp(values, axis=0).max() > ROUNDED:
            tracks[name] = Track(name, kind, motion.time, values)
    return tracks


def local_corners(visual_model: pin.GeometryModel) -> dict[int, np.ndarray]:
    """Return the corners of each geometry's own box, m, shape (8, 3), without unbounded geometries."""
    corners = {
        index: box_corners(geometry_object.geometry) * file_unit(geometry_object)
        for index, geometry_object in enumerate(visual_model.geometryObjects)
    }
    return {index: points for index, points in corners.items() if np.abs(points).max() < 1e6}
