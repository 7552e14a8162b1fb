"""Contacts stop what hits them within a time step, or send it back as their restitution says."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from fesd_robot.in_mujoco.impacts import _SPRING, bouncing, rubbing, spread, stiff

BALL = """<mujoco><option timestep="{step}" gravity="0 0 {g}" cone="elliptic" impratio="100"/>
<worldbody><geom name="floor" type="plane" size="0 0 1" contype="0" conaffinity="0"/>
<body pos="0 0 {height}"><freejoint/><geom name="ball" size="0.1" mass="{mass}" contype="0" conaffinity="0"/></body>
</worldbody>
<contact><pair geom1="ball" geom2="floor" condim="3" friction="0.5 0.5 0 0 0" solimp="0.9999 0.9999 0.001 0.5 2"
solref="{solref}" solreffriction="{friction}"/></contact></mujoco>"""


def dropped(solref: list[float], height: float, *, step: float, mass: float = 1.0, speed: float = -2.0) -> np.ndarray:
    """Return heights and speeds of a ball that comes without gravity, (n, 2)."""
    text = BALL.format(
        step=step, g=0, height=0.1 + height, mass=mass,
        solref=" ".join(map(str, solref)), friction=" ".join(map(str, rubbing(step))),
    )  # fmt: skip
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qvel[2] = speed
    rows = []
    for _ in range(int(0.02 / step)):
        mujoco.mj_step(model, data)
        rows.append((data.qpos[2] - 0.1, data.qvel[2]))
    return np.array(rows)


@pytest.mark.parametrize("mass", [0.01, 1.0, 50.0])
def test_inelastic(mass: float) -> None:
    """What hits at 2 m/s stops in a step, at most a tenth of a millimetre too deep, and parts with less than 1 mm/s."""
    for height in (0.0101, 0.01013, 0.01017):
        rows = dropped(stiff(1e-4), height, step=1e-4, mass=mass)
        hit = int(np.argmax(rows[:, 0] < 0)) + 1
        assert np.abs(rows[hit + 1 :, 1]).max() < 1e-3
        assert rows[:, 0].min() > -2e-4


@pytest.mark.parametrize("restitution", [0.05, 0.3, 0.5, 0.8, 0.95, 1.0])
def test_restitution(restitution: float) -> None:
    """The speed after a bounce is e times that before, to what `spread` says, whenever in a step it hits."""
    found = [
        dropped(bouncing(restitution, 5e-6), height, step=5e-6, mass=mass)[-1, 1] / 2
        for height in np.linspace(0.01, 0.01001, 7)
        for mass in (0.1, 3.0)
    ]
    assert np.abs(np.array(found) - restitution).max() < spread(restitution) + 2e-3
    assert np.mean(found) == pytest.approx(restitution, abs=5e-3)


def test_damping_ratio_of_a_spring() -> None:
    """In small steps the damping ratio is that of the closed form exp(-2 z acos(z) / sqrt(1 - z^2))."""
    ratio = -bouncing(0.8, 1.0)[1] / (2 * _SPRING)
    assert math.exp(-2 * ratio * math.acos(ratio) / math.sqrt(1 - ratio**2)) == pytest.approx(0.8, abs=2e-3)
