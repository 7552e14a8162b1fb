"""The motion as breaks and samples of Drake's piecewise polynomials."""

from __future__ import annotations

import io
import json
from typing import Any

import numpy as np

from fesd_robot.errors import FesdRobotError
from fesd_robot.instants import SAME_TIME
from fesd_robot.plans.exports.base_state import floating_bodies
from fesd_robot.plans.exports.facts import facts
from fesd_robot.plans.exports.format import ExportFormat
from fesd_robot.plans.plan import Plan
from fesd_robot.recovery import ModelMotion


def segments_of(time: np.ndarray) -> list[np.ndarray]:
    """Return the samples of every segment: an impact ends one and begins the next.

    Drake's breaks increase, so that of samples which are closer than its tolerance only the last before an impact
    counts.
    """
    jumps = np.flatnonzero(np.diff(time) <= SAME_TIME) + 1
    parts = np.split(np.arange(len(time)), jumps)
    return [part for part in parts if len(part) > 1]


def drake_segments(plan: Plan, motion: ModelMotion) -> dict[str, Any]:
    """Return verdict, joint_names and segments with breaks, samples and their derivatives, one column a break.

    Every segment is a ``PiecewisePolynomial.CubicHermite(breaks, samples, samples_dot)`` of the joints with one degree
    of freedom. With a floating base it also has ``base_position`` with ``base_velocity``, m and m/s in the world, and
    ``base_quaternion``, w, x, y, z, with ``base_angular_velocity``, rad/s in the world; with free bodies beside the
    robot, the same of each under its name in place of ``base``.
    """
    if plan.full_model is None or not plan.full_model.joints:
        raise FesdRobotError(f"{plan.name}: found no joint of one degree of freedom, expected one that moves")
    joints, bodies = plan.full_model.joints, floating_bodies(motion)
    position = np.array([joint.position for joint in joints.values()])
    velocity = np.array([joint.velocity for joint in joints.values()])
    effort = np.array([joint.effort for joint in joints.values()])
    segments = []
    for part in segments_of(plan.trajectory.time):
        segment = {
            "breaks": plan.trajectory.time[part],
            "samples": position[:, part],
            "samples_dot": velocity[:, part],
            "effort": effort[:, part],
        }
        named = {state.body or "base": state for state in reversed(bodies)}  # the robot's first one is its base
        for name, state in reversed(named.items()):
            segment |= {
                f"{name}_position": state.position[part].T,
                f"{name}_velocity": state.velocity[part].T,
                f"{name}_quaternion": state.quaternion[part].T,
                f"{name}_angular_velocity": state.turning_in_world[part].T,
            }
        segments.append(segment)
    return {**facts(plan), "joint_names": list(joints), "segments": segments}


def _as_json(plan: Plan, motion: ModelMotion) -> bytes:
    content = drake_segments(plan, motion)
    content["segments"] = [{key: each.tolist() for key, each in part.items()} for part in content["segments"]]
    return (json.dumps(content, indent=1) + "\n").encode()


def _as_npz(plan: Plan, motion: ModelMotion) -> bytes:
    content = drake_segments(plan, motion)
    parts = {f"{key}_{i}": each for i, part in enumerate(content["segments"]) for key, each in part.items()}
    stream = io.BytesIO()
    np.savez_compressed(
        stream,
        segments=np.array(len(content["segments"])),
        joint_names=np.array(content["joint_names"]),
        solved=np.array(plan.status.solved),
        **parts,
    )
    return stream.getvalue()


DRAKE = ExportFormat(
    name="drake",
    stem="drake",
    content="breaks, samples and derivatives for PiecewisePolynomial.CubicHermite, a segment from impact to impact; "
    "numpy arrays, or JSON if the file ends in .json",
    writers={".npz": _as_npz, ".json": _as_json},
    model=True,
)
