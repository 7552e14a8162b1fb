"""Motions that keep to contact modes somebody has chosen, whether Coulomb's law allows these or not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from fesd_robot.contact import ContactMode
from fesd_robot.recovery import PhysicalMotion, SwitchRecord
from fesd_robot.recovery.between import FRACTIONS, DenseElement, stacked_elements
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.replay.dynamics import contact_dynamics
from fesd_robot.replay.modes import motion_in_modes

from .motions import NODES, WEIGHTS


@dataclass(frozen=True)
class Span:
    """One element: every contact stays in a mode under constant controls."""

    interval: int
    duration: float
    mode: ContactMode | tuple[ContactMode, ...]
    control: Sequence[float]

    @property
    def modes(self) -> tuple[ContactMode, ...]:
        """One a contact."""
        return self.mode if isinstance(self.mode, tuple) else (self.mode,)


def driven(physics: NumericPhysics, q: Sequence[float], v: Sequence[float], spans: Sequence[Span]) -> PhysicalMotion:
    """Return the motion of a robot from a state, integrated to 1e-10, sampled at Radau's two nodes."""
    rows: list[tuple] = []
    dense: list[DenseElement] = []
    switches: list[SwitchRecord] = []
    clock: dict[int, float] = {}
    time, n_v, y = 0.0, len(v), np.array([*q, *v], dtype=float)

    def solved(span: Span, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        modes, u = span.modes, np.asarray(span.control, dtype=float)
        return motion_in_modes(contact_dynamics(physics, state[:n_v], state[n_v:], u), modes)

    def add(span: Span, at: float, state: np.ndarray, weight: float) -> None:
        a, force = solved(span, state)
        shown = [mode.without_direction for mode in span.modes]
        u, gap = np.asarray(span.control, dtype=float), physics.gaps(state[:n_v])
        rows.append((at, state[:n_v], state[n_v:], a, weight, span.interval, u, force, gap, shown))

    for before, span in zip([None, *spans], spans, strict=False):
        path = solve_ivp(
            lambda _, state, span=span: np.concatenate([state[n_v:], solved(span, state)[0]]),
            (0.0, span.duration),
            y,
            rtol=1e-10,
            atol=1e-12,
            dense_output=True,
        ).sol
        if before is None:
            add(span, time, y, 0.0)
        elif before.mode is not span.mode:
            kind = "takeoff" if span.mode is ContactMode.FLIGHT else "stick_to_slip"
            switches.append(SwitchRecord(time, 0, kind))
        for node, weight in zip(NODES, WEIGHTS, strict=True):
            add(span, time + node * span.duration, path(node * span.duration), weight * span.duration)
        states = np.array([path(part * span.duration) for part in FRACTIONS])
        dense.append(
            DenseElement(
                time=time + FRACTIONS * span.duration,
                configuration=states[:, :n_v],
                velocity=states[:, n_v:],
                interval=span.interval,
                control=np.asarray(span.control, dtype=float),
                mode=list(span.modes),
            )
        )
        time, y = time + span.duration, path(span.duration)
        clock[span.interval] = time
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    columns[-1] = np.array([row[-1] for row in rows], dtype=object)
    elements = stacked_elements(dense, (n_v, n_v, len(spans[0].control), len(spans[0].modes)))
    return PhysicalMotion(*columns, [], switches, np.array(list(clock.values())), 0.0, elements)
