"""Limits of angles of orientations and turns as path constraints."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np

from fesd_robot.exactness import WRITTEN
from fesd_robot.fesd import TrajectoryConstraint
from fesd_robot.ocp.parts import ProblemParts
from fesd_robot.orientations import angles_of, quaternion_entries, turn_entries
from fesd_robot.robot import quaternion_matrix


def angle_limits(parts: ProblemParts) -> list[TrajectoryConstraint]:
    """Return the limits of orientations and turns, which hold at every stage; none where the task gives none.

        sin(lower) <= sin(pitch) <= sin(upper),   of other angles with the middle m of the limits   |phi - m| <= half

    phi - m is the angle of (cos(phi - m), sin(phi - m)), so that it jumps half a turn away from the middle only, and
    where the pitch is a right angle.

    Raises:
        TaskError: the start is outside a limit.
    """
    names, given = parts.dynamics.configuration_names, parts.task.limits.position
    rows: dict[str, tuple[ca.SX, float, float]] = {}
    for joint, at in quaternion_entries(names).items():
        roll, pitch, yaw = angles_of(joint)
        rotation = quaternion_matrix(parts.dynamics.configuration[at])
        if pitch in given:
            lower, upper = (max(-math.pi / 2, min(math.pi / 2, bound)) for bound in given[pitch])
            rows[pitch] = -rotation[2, 0], math.sin(lower), math.sin(upper)
        for angle, sine, cosine in (
            (roll, rotation[2, 1], rotation[2, 2]),
            (yaw, rotation[1, 0], rotation[0, 0]),
        ):
            if angle in given:
                rows[angle] = _from_middle(sine, cosine, given[angle])
    for joint, at in turn_entries(names).items():
        if joint in given:
            cosine, sine = ca.vertsplit(parts.dynamics.configuration[at])
            rows[joint] = _from_middle(sine, cosine, given[joint])
    if not rows:
        return []
    found, low, high = (list(each) for each in zip(*rows.values(), strict=True))
    _check_start(parts, list(rows), found, (np.array(low), np.array(high)))
    system = parts.contact_system.system
    at_stage = ca.vertcat(system.state, system.control, system.algebraic)
    intervals, labels = parts.grid.everywhere, [f"limit of {name}" for name in rows]
    return [
        TrajectoryConstraint(
            "angle limits", "path", at_stage, intervals, ca.vertcat(*found), np.array(low), np.array(high), labels
        )
    ]


def _from_middle(sine: ca.SX, cosine: ca.SX, limits: tuple[float, float]) -> tuple[ca.SX, float, float]:
    """Return the angle from the middle of its limits, and its limits from there."""
    middle, half = np.mean(limits), (limits[1] - limits[0]) / 2
    sin, cos = math.sin(middle), math.cos(middle)
    return ca.atan2(sine * cos - cosine * sin, cosine * cos + sine * sin), -half, half


def _check_start(
    parts: ProblemParts, names: list[str], rows: list[ca.SX], bounds: tuple[np.ndarray, np.ndarray]
) -> None:
    """Raise if the start is outside a limit; an orientation that is written by its angles was checked by them."""
    function = ca.Function("rows", [parts.dynamics.configuration], [ca.vertcat(*rows)])
    values = np.asarray(function(parts.endpoints.initial_configuration)).ravel()
    outside = np.maximum(bounds[0] - values, values - bounds[1])
    worst = int(np.argmax(outside))
    if outside[worst] > WRITTEN:
        raise parts.task.error(
            ("limits", "position", names[worst]),
            "found limits that the initial angle is outside of, expected limits with the start between them",
        )
