"""Motions of the hopper in closed form: constant accelerations at pitch zero, or free flight."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from fesd_robot.contact import ContactMode
from fesd_robot.recovery import ImpactRecord, PhysicalMotion, SwitchRecord
from fesd_robot.recovery.between import FRACTIONS, DenseElement, stacked_elements

GRAVITY, FRICTION = 9.81, 0.45
MASS = np.array([1.1, 1.1, 0.275, 0.1])
NODES, WEIGHTS = (1 / 3, 1.0), (0.75, 0.25)
"""Two-stage Radau IIA: exact for the work of a force along a constant acceleration."""


def no_control(_: np.ndarray) -> np.ndarray:
    return np.zeros(2)


def jacobian(q: np.ndarray) -> np.ndarray:
    """Rows J_n, J_t of the foot at (x + r sin, z - r cos)."""
    sin, cos = np.sin(q[2]), np.cos(q[2])
    return np.array([[0, 1, q[3] * sin, -cos], [1, 0, q[3] * cos, sin]])


@dataclass(frozen=True)
class Segment:
    """Motion of constant acceleration within one control interval."""

    interval: int
    duration: float
    acceleration: np.ndarray
    mode: str = "flight"
    force: tuple[float, float] = (0.0, 0.0)
    control: Callable[[np.ndarray], np.ndarray] = field(default=no_control)


@dataclass(frozen=True)
class Hit:
    """An impact: normal and tangential impulse, N s; `kick` changes the velocity without any impulse."""

    normal: float
    tangential: float = 0.0
    kick: float = 0.0


def between(segment: Segment, time: float, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> DenseElement:
    """The states of a segment between its ends; a slip has the direction of its velocity."""
    s = (FRACTIONS * segment.duration)[:, None]
    mode = ContactMode(segment.mode)
    if mode is ContactMode.SLIP:
        mode = ContactMode.SLIP_FORWARDS if v[0] > 0 else ContactMode.SLIP_BACKWARDS
    return DenseElement(
        time=time + s[:, 0],
        configuration=q + s * v + 0.5 * s * s * a,
        velocity=v + s * a,
        interval=segment.interval,
        control=segment.control(q),
        mode=[mode],
    )


def motion_of(q: np.ndarray, v: np.ndarray, parts: Sequence[Segment | Hit]) -> PhysicalMotion:
    """Sample a row of segments and hits at the left end and the Radau nodes of every segment."""
    rows: list[tuple] = []
    impacts: list[ImpactRecord] = []
    dense: list[DenseElement] = []
    clock: dict[int, float] = {}
    time, interval, fresh = 0.0, 0, True
    q, v = np.array(q, dtype=float), np.array(v, dtype=float)

    def add(segment: Segment | None, a: np.ndarray, weight: float) -> None:
        force = (0.0, 0.0) if segment is None else segment.force
        u = np.zeros(2) if segment is None else segment.control(q)
        mode = ContactMode.FLIGHT if segment is None else ContactMode(segment.mode)
        gap = q[1] - q[3] * np.cos(q[2])
        rows.append((time, q, v, a, weight, interval, u, [force], [gap], [mode]))

    for index, part in enumerate(parts):
        if isinstance(part, Hit):
            if not rows:
                add(None, np.full(4, np.nan), 0.0)
            rows[-1] = (*rows[-1][:-1], [ContactMode.IMPACT])
            impulse = np.array([part.normal, part.tangential])
            v = v + (jacobian(q).T @ impulse) / MASS + part.kick * np.array([0, 0, 1, 0])
            impacts.append(ImpactRecord(len(rows) - 1, len(rows), impulse[None]))
            fresh = True
            if index + 1 == len(parts):
                add(None, np.full(4, np.nan), 0.0)
            continue
        interval = part.interval
        if fresh:
            add(part, np.full(4, np.nan), 0.0)
            fresh = False
        start, q0, v0, a = time, q, v, np.asarray(part.acceleration, dtype=float)
        dense.append(between(part, time, q, v, a))
        for node, weight in zip(NODES, WEIGHTS, strict=True):
            s = node * part.duration
            time, q, v = start + s, q0 + s * v0 + 0.5 * s * s * a, v0 + s * a
            add(part, a, weight * part.duration)
        clock[interval] = time
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    modes = np.array([row[-1] for row in rows], dtype=object)
    switches = [SwitchRecord(float(columns[0][impact.after]), 0, "touchdown") for impact in impacts]
    elements = stacked_elements(dense, (4, 4, 2, 1))
    return PhysicalMotion(*columns[:-1], modes, impacts, switches, np.array(list(clock.values())), 0.0, elements)


def tumble() -> PhysicalMotion:
    """A turning flight with a torque of 0.5 N m in the body, leg moving."""
    fall = np.array([0, -GRAVITY, 0.5 / 0.275, 0])
    parts = [Segment(k, 0.1, fall, control=lambda _: np.array([0.5, 0.0])) for k in range(2)]
    return motion_of(np.array([0.1, 1.0, 0.2, 0.3]), np.array([1.0, 1.0, 0.5, -0.2]), parts)


def drop(share: float = 1.0) -> PhysicalMotion:
    """A fall from 0.2 m onto a compliant leg: flight, impact, and stance with no control.

    Args:
        share: 1 for the inelastic impact, less leaves a part of the normal velocity.
    """
    fall_time, denominator = np.sqrt(0.4 / GRAVITY), 1 / 1.1 + 1 / 0.1
    fall, normal = np.array([0, -GRAVITY, 0, 0]), GRAVITY / denominator
    sink = np.array([0, -GRAVITY + normal / 1.1, 0, -normal / 0.1])
    parts = [
        Segment(0, 0.15, fall),
        Segment(1, fall_time - 0.15, fall),
        Hit(share * GRAVITY * fall_time / denominator),
        Segment(1, 0.3 - fall_time, sink, "stick", (normal, 0.0)),
    ]
    return motion_of(np.array([0, 0.7, 0, 0.5]), np.zeros(4), parts)


def stance(friction: float = 0.0, speed: float = 0.0, push: float = 0.0) -> PhysicalMotion:
    """The foot on the ground, the leg pushed by `push`, sliding with `speed`; a torque keeps the body upright.

    Args:
        friction: coefficient of the force against the sliding.
    """
    normal = (GRAVITY - push / 1.1 + push / 0.1) / (1 / 1.1 + 1 / 0.1)
    tangential = -friction * normal
    a = np.array([tangential / 1.1, -GRAVITY + (push + normal) / 1.1, 0.0, (push - normal) / 0.1])
    mode = "slip" if speed else "stick"
    parts = [
        Segment(k, 0.05, a, mode, (normal, tangential), lambda q: np.array([-q[3] * tangential, push]))
        for k in range(2)
    ]
    return motion_of(np.array([0, 0.4, 0, 0.4]), np.array([speed, 0, 0, 0]), parts)


def collision(normal: float, tangential: float = 0.0, kick: float = 0.0, speed: float = 1.0) -> PhysicalMotion:
    """An impact alone, of the foot that comes down at 1 m/s or `speed`; 1 / (1 / 1.1 + 1 / 0.1) N s stop 1 m/s."""
    return motion_of(np.array([0, 0.5, 0, 0.5]), np.array([0, -speed, 0, 0]), [Hit(normal, tangential, kick)])


STOP = 1 / (1 / 1.1 + 1 / 0.1)
"""Impulse, N s, that stops the foot of a `collision`."""
