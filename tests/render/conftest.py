"""A hopper that hops twice, made up by hand: what the page and the figures are tried on."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.plans.plan import (
    ContactHistory,
    Impulse,
    Plan,
    Status,
    Switch,
    Trajectory,
    Units,
)

from .browser import INSTALL, NOT_FOUND, Browser

URDF = Path(__file__).parents[2] / "models" / "hopper" / "hopper.urdf"
NAMES = ["root_x", "root_z", "root_pitch", "leg"]
FRICTION = 0.7


class Hop(NamedTuple):
    """A motion of the hopper: n samples, an impact twice at the same time."""

    model: pin.Model
    visual_model: pin.GeometryModel
    time: np.ndarray
    configuration: np.ndarray
    velocity: np.ndarray
    foot: np.ndarray
    mode: list[str]


@pytest.fixture(scope="session")
def hop() -> Hop:
    """Two flights of 0.5 s, each ending in an impact and followed by a stance of 0.2 s, unevenly sampled."""
    model = pin.buildModelFromUrdf(str(URDF))
    visual_model = pin.buildGeomFromUrdf(model, str(URDF), pin.GeometryType.VISUAL)
    foot_frame = model.getFrameId("foot", pin.FrameType.BODY)
    spread = 0.5 - 0.5 * np.cos(np.pi * np.linspace(0.0, 1.0, 41))
    pieces: list[tuple[np.ndarray, np.ndarray, np.ndarray, str]] = []
    start, x = 0.0, 0.0
    for _ in range(2):
        for mode, duration, stride in (("flight", 0.5, 0.8), ("stick", 0.2, 0.0)):
            s = duration * spread
            phase = s / duration
            flying = mode == "flight"
            height = 0.5 * 9.81 * s * (duration - s) if flying else 0.0 * s
            leg = (0.5 - 0.2 * np.sin(np.pi * phase) ** 2) if flying else (0.5 - 0.15 * np.sin(np.pi * phase))
            pitch = 0.3 * np.sin(2 * np.pi * phase) if flying else 0.0 * s
            foot_x = x + stride * phase
            # The leg points down at pitch zero and turns with the body.
            q = np.stack([foot_x - leg * np.sin(pitch), height + leg * np.cos(pitch), pitch, leg], axis=1)
            v = np.gradient(q, s, axis=0, edge_order=2)
            pieces.append((start + s, q, v, mode))
            start, x = start + duration, x + stride
    time, configuration, velocity = (np.concatenate([piece[part] for piece in pieces]) for part in range(3))
    data, foot = model.createData(), []
    for q in configuration:
        pin.framesForwardKinematics(model, data, q)
        foot.append(data.oMf[foot_frame].translation.copy())
    modes = [piece[3] for piece in pieces for _ in piece[0]]
    return Hop(model, visual_model, time, configuration, velocity, np.array(foot), modes)


@pytest.fixture(scope="session")
def plan(hop: Hop) -> Plan:
    """The plan of `hop`: forces in stance, an impulse at each touchdown, ten control intervals."""
    stance = np.array([mode == "stick" for mode in hop.mode])
    normal = np.where(stance, 30.0, 0.0)
    contact = ContactHistory(
        gap=hop.foot[:, 2],
        normal_force=normal,
        tangential_force=0.5 * normal * np.sin(30.0 * hop.time),
        mode=hop.mode,
    )
    starts = np.linspace(0.0, hop.time[-1], 11)[:-1]
    # Only what is drawn; the other parts of a plan do not matter here.
    return Plan.model_construct(
        name="hopper_two_hops",
        status=Status.model_construct(solved=True),
        units=Units(
            configuration=dict(zip(NAMES, ("m", "m", "rad", "m"), strict=True)),
            velocity=dict(zip(NAMES, ("m/s", "m/s", "rad/s", "m/s"), strict=True)),
            controls={"reaction_torque": "N m", "leg_force": "N"},
        ),
        trajectory=Trajectory(
            time=hop.time,
            configuration=dict(zip(NAMES, hop.configuration.T, strict=True)),
            velocity=dict(zip(NAMES, hop.velocity.T, strict=True)),
        ),
        controls={"time": starts, "reaction_torque": np.cos(starts), "leg_force": 20.0 * np.sin(3.0 * starts)},
        contacts={"foot": contact},
        switches=[
            Switch(time=0.5, contact="foot", kind="touchdown"),
            Switch(time=0.7, contact="foot", kind="takeoff"),
            Switch(time=1.2, contact="foot", kind="touchdown"),
        ],
        impulses=[
            Impulse(time=0.5, contact="foot", normal=2.7, tangential=-0.4),
            Impulse(time=1.2, contact="foot", normal=2.9, tangential=-0.3),
        ],
        task={"ground": {"friction": FRICTION}, "contacts": {"foot": {}}},
    )


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say in one line how many tests were skipped for want of a browser."""
    skipped = [report for report in terminalreporter.stats.get("skipped", []) if NOT_FOUND in str(report.longrepr)]
    if skipped:
        terminalreporter.write_line(f"{NOT_FOUND}: {len(skipped)} tests of pages skipped; {INSTALL}")


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """One headless Chromium for all tests of a module."""
    with Browser() as opened:
        yield opened
