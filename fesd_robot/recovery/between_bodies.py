"""Where two bodies of a robot touch, in numbers."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin

from fesd_robot.contact import CircleOnCircle, TwoBodies, axes_about


def closest(
    geometry: TwoBodies, center: np.ndarray, origin: np.ndarray, rotation: np.ndarray
) -> tuple[float, np.ndarray]:
    """Return the gap between a circle and another body, m, and the direction from that to the circle's centre, (3).

    Args:
        geometry: what touches what.
        center: of the circle, m, (3).
        origin, rotation: of the other body's frame, (3) and (3, 3).
    """
    apart = center - origin
    if geometry.facing is not None:
        return _closest_in_space(geometry, apart, rotation)
    if isinstance(geometry, CircleOnCircle):
        distance = math.hypot(apart[0], apart[2])
        return distance - geometry.radius - geometry.other_radius, np.array([apart[0], 0.0, apart[2]]) / distance
    own, half = (rotation.T @ apart)[[0, 2]], np.array(geometry.other_size) / 2
    away = own - np.clip(own, -half, half)
    distance = math.hypot(*away)
    if distance > 0:
        direction = away / distance
    else:  # inside of the box the nearest side counts
        side = int(np.argmax(np.abs(own) - half))
        distance = float(np.abs(own[side]) - half[side])
        direction = np.sign(own) * (np.arange(2) == side)
    return distance - geometry.radius, rotation @ np.array([direction[0], 0.0, direction[1]])


def _closest_in_space(geometry: TwoBodies, apart: np.ndarray, rotation: np.ndarray) -> tuple[float, np.ndarray]:
    if isinstance(geometry, CircleOnCircle):
        distance = float(np.linalg.norm(apart))
        return distance - geometry.radius - geometry.other_radius, apart / distance
    own, half = rotation.T @ apart, np.array(geometry.other_size) / 2
    away = own - np.clip(own, -half, half)
    distance = float(np.linalg.norm(away))
    if distance > 0:
        direction = away / distance
    else:  # inside of the box the nearest side counts
        side = int(np.argmax(np.abs(own) - half))
        distance = float(np.abs(own[side]) - half[side])
        direction = np.sign(own) * (np.arange(3) == side)
    return distance - geometry.radius, rotation @ direction


def tangents_between(geometry: TwoBodies, normal: np.ndarray) -> list[np.ndarray]:
    """Return the tangents of a contact between two bodies at its normal, one in the plane, two in space, (3) each.

    In space they are those of the axis that the contact faces, turned with it to the normal along the shortest way.
    """
    if geometry.facing is None:
        return [np.array([normal[2], 0.0, -normal[0]])]
    first, *across = axes_about(geometry.facing).T
    turn = pin.Quaternion.FromTwoVectors(first, normal).toRotationMatrix()
    return [turn @ axis for axis in across]
