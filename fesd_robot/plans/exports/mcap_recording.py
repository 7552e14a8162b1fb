"""The motion as a recording of ROS 2 messages, MCAP, for Foxglove, PlotJuggler and ros2 bag."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pinocchio as pin

from fesd_robot.plans.columns import CONTROL_CONVENTION
from fesd_robot.plans.exports.facts import facts
from fesd_robot.plans.exports.format import ExportFormat
from fesd_robot.plans.exports.joint_trajectory import NANOSECONDS, joint_trajectory
from fesd_robot.plans.exports.ros_definitions import DEFINITIONS
from fesd_robot.plans.plan import Plan
from fesd_robot.recovery import ModelMotion

WORLD = "world"

STATES, TRAJECTORY, TRANSFORMS = "/joint_states", "/joint_trajectory", "/tf"

_TYPES = {
    STATES: "sensor_msgs/msg/JointState",
    TRAJECTORY: "trajectory_msgs/msg/JointTrajectory",
    TRANSFORMS: "tf2_msgs/msg/TFMessage",
}


def foot_frame(foot: str) -> str:
    """Return the name of the frame at the point at which a foot touches, with the axes of the world."""
    return f"contact/{foot}"


def mcap_recording(plan: Plan, motion: ModelMotion) -> bytes:
    """Return a recording whose clock is the physical time of the plan.

    ``/joint_states`` has every joint of the model file, ``/tf`` every link and ``contact/NAME``, the point at which a
    foot touches, in ``world``, ``/contacts/NAME/wrench`` the force on every foot in that frame, and
    ``/joint_trajectory`` the whole motion once. An impact has two messages with the same time, before and after.
    Verdict, units, impulses and switches are metadata, under the name ``fesd_robot``.
    """
    from mcap_ros2.writer import Writer  # an extra

    stream = io.BytesIO()
    writer = Writer(stream)
    schemas = {name: writer.register_msgdef(name, text) for name, text in DEFINITIONS.items()}
    sequence: dict[str, int] = {}
    for tick, topic, message in _messages(plan, motion):
        schema = schemas[_TYPES.get(topic, "geometry_msgs/msg/WrenchStamped")]
        sequence[topic] = sequence.get(topic, -1) + 1
        writer.write_message(topic, schema, message, log_time=tick, publish_time=tick, sequence=sequence[topic])
    known = {key: value if isinstance(value, str) else json.dumps(value) for key, value in facts(plan).items()}
    writer.add_metadata("fesd_robot", {**known, "controls": CONTROL_CONVENTION})
    writer.finish()
    return stream.getvalue()


def _messages(plan: Plan, motion: ModelMotion) -> Iterator[tuple[int, str, dict[str, Any]]]:
    """Yield time in ns, topic and message in time order."""
    joints = plan.full_model.joints if plan.full_model else {}
    ticks = np.rint(plan.trajectory.time * NANOSECONDS).astype(int).tolist()
    if joints:
        yield ticks[0], TRAJECTORY, joint_trajectory(plan, effort=True)
    data, model = motion.robot.model.createData(), motion.robot.model
    links = {frame.name: index for index, frame in enumerate(model.frames) if frame.type == pin.FrameType.BODY}
    for k, tick in enumerate(ticks):
        stamp = dict(zip(("sec", "nanosec"), divmod(tick, NANOSECONDS), strict=True))
        if joints:
            yield (
                tick,
                STATES,
                {
                    "header": {"stamp": stamp, "frame_id": ""},
                    "name": list(joints),
                    "position": [float(joint.position[k]) for joint in joints.values()],
                    "velocity": [float(joint.velocity[k]) for joint in joints.values()],
                    "effort": [float(joint.effort[k]) for joint in joints.values()],
                },
            )
        pin.framesForwardKinematics(model, data, motion.configuration[k])
        poses = {name: pin.SE3ToXYZQUAT(data.oMf[index]).tolist() for name, index in links.items() if name != WORLD}
        points = motion.foot_position[k].tolist()
        poses |= {foot_frame(foot): [*place, 0, 0, 0, 1] for foot, place in zip(motion.feet, points, strict=True)}
        yield tick, TRANSFORMS, {"transforms": [_transform(stamp, name, pose) for name, pose in poses.items()]}
        for foot, force in zip(motion.feet, motion.foot_force[k].tolist(), strict=True):
            wrench = {"force": dict(zip("xyz", force, strict=True)), "torque": dict.fromkeys("xyz", 0.0)}
            message = {"header": {"stamp": stamp, "frame_id": foot_frame(foot)}, "wrench": wrench}
            yield tick, f"/contacts/{foot.replace(' ', '_')}/wrench", message


def _transform(stamp: dict[str, int], name: str, pose: list[float]) -> dict[str, Any]:
    return {
        "header": {"stamp": stamp, "frame_id": WORLD},
        "child_frame_id": name,
        "transform": {
            "translation": dict(zip("xyz", pose[:3], strict=True)),
            "rotation": dict(zip("xyzw", pose[3:], strict=True)),
        },
    }


MCAP = ExportFormat(
    name="mcap",
    stem="motion",
    content="a recording of ROS 2 messages for Foxglove, PlotJuggler and ros2 bag: JointState, JointTrajectory, "
    "TFMessage and a WrenchStamped for every foot",
    writers={".mcap": mcap_recording},
    model=True,
    extra="mcap",
    packages=("mcap", "mcap_ros2"),
)
