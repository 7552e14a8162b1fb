"""Default weights: closed forms of the hopper, and the same for robots of any size."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.task import Task

from .conftest import HOPPER

Load = Callable[[str], Task]

MASS, LEG, GRAVITY = 1.1, 0.5, 9.81
"""Of the short task's hopper, kg, m, m/s2: its foot is the farthest point from the centre of mass."""

WEIGHT = MASS * GRAVITY

LENGTHS, ANGLES = ["root_x", "root_z", "leg"], ["root_pitch"]


def by_kind(length: float, angle: float) -> dict[str, float]:
    """A weight for every length and one for every angle of the hopper."""
    return {**dict.fromkeys(LENGTHS, length), **dict.fromkeys(ANGLES, angle)}


def test_the_hoppers_scales(short: str, load: Load) -> None:
    """Mass of all links, distance of the foot with the leg drawn out, the time of a fall over it, and the weight."""
    scales = formulate(load(short)).scales
    assert (scales.mass, scales.length) == pytest.approx((MASS, LEG), rel=1e-12)
    assert (scales.time, scales.force) == pytest.approx((np.sqrt(LEG / GRAVITY), WEIGHT), rel=1e-12)


def test_the_hoppers_weights(short: str, load: Load) -> None:
    """The leg's length or 1 rad costs 10 a second and 100 at the end; speeds, forces and work are counted alike."""
    motion = formulate(load(short.replace("duration: 1", "duration: 2")))
    costs = motion.task.costs
    closed_forms = {
        "configuration": by_kind(10 / LEG**2, 10),
        "velocity": by_kind(0.1 / (LEG * GRAVITY), 0.1 * LEG / GRAVITY),
        "control": {"root_pitch": 1 / (WEIGHT * LEG) ** 2, "leg": 1 / WEIGHT**2},
        "terminal_configuration": by_kind(100 / LEG**2, 100),
        "terminal_velocity": by_kind(1 / (LEG * GRAVITY), LEG / GRAVITY),
        "slipping": {"foot": 10 / (WEIGHT * LEG)},
    }
    for key, weights in closed_forms.items():
        assert getattr(costs, key) == pytest.approx(weights, rel=5e-3), key  # three digits
    assert set(motion.default_costs) == set(closed_forms)


@pytest.mark.parametrize(
    ("old", "new"), [("leg: 0.5", "leg: 0.45"), ("root_z: 0.6", "root_z: 0.7"), ("duration: 1", "duration: 0.95")]
)
def test_neither_start_nor_duration_changes_weights(short: str, load: Load, old: str, new: str) -> None:
    """They are the model's: a horizon that recedes does not change its own cost."""
    assert old in short
    other = formulate(load(short.replace(old, new, 1))).task.costs
    assert other == formulate(load(short)).task.costs


def test_given_weights_win(short: str, load: Load) -> None:
    """A map that is given stays as it is, an empty one too, and only the keys left out have defaults."""
    motion = formulate(load(short + "costs: {control: {leg: 5}, slipping: {}}\n"))
    plain = formulate(load(short)).task.costs
    assert motion.task.costs.control == {"leg": 5} and motion.task.costs.slipping == {}
    assert motion.task.costs.configuration == plain.configuration
    assert set(motion.default_costs) == {"configuration", "velocity", "terminal_configuration", "terminal_velocity"}
    assert "slipping" not in motion.ocp.running_cost and "slipping" in formulate(load(short)).ocp.running_cost
    again = formulate(motion.task)
    assert again.task.costs == motion.task.costs and again.default_costs == ()


def larger(load: Load, short: str, tmp_path: Path, length: float, mass: float) -> MotionProblem:
    """The short task of a hopper so many times as long and heavy, in a motion that is slower in proportion."""
    model = tmp_path / "hopper.urdf"
    text = HOPPER.read_text(encoding="utf-8").replace('mass value="1.1"', f'mass value="{1.1 * mass}"')
    model.write_text(text.replace('lower="0.1" upper="0.5"', f'lower="0.1" upper="{0.5 * length}"'), encoding="utf-8")
    changes = {
        str(HOPPER): str(model),
        "duration: 1": f"duration: {np.sqrt(length)}",
        "root_z: 0.6, leg: 0.5": f"root_z: {0.6 * length}, leg: {0.5 * length}",
        "root_x: 1": f"root_x: {length}",
    }
    for old, new in changes.items():
        assert old in short
        short = short.replace(old, new)
    return formulate(load(short))


@pytest.mark.parametrize(("length", "mass"), [(2.0, 1.0), (1.0, 3.0), (2.0, 3.0)])
def test_the_same_motion_of_a_larger_robot_costs_the_same(
    short: str, load: Load, tmp_path: Path, length: float, mass: float
) -> None:
    """Every term of the cost, a second, at states and controls in units of the robot is that of the small one."""
    small, large = formulate(load(short)), larger(load, short, tmp_path, length, mass)
    rate = np.sqrt(length)  # duration, and speed: length over it
    position = np.array([length, length, 1, length])
    x_scale = np.concatenate([position, position / rate, [rate, length]])
    u_scale = np.array([mass * length, mass, 1])
    p_scale = np.append(position, rate)
    rng = np.random.default_rng(0)
    for _ in range(5):
        x, u, p = rng.normal(size=10), rng.normal(size=3), rng.normal(size=5)
        values = [
            _terms(motion, x * sx, u * su, p * sp)
            for motion, sx, su, sp in ((small, 1, 1, 1), (large, x_scale, u_scale, p_scale))
        ]
        assert values[1] == pytest.approx(values[0], rel=1e-2)  # weights have three digits
    small_price, large_price = (motion.task.costs.slipping for motion in (small, large))
    assert small_price and large_price
    assert large_price["foot"] * mass * length == pytest.approx(small_price["foot"], rel=1e-2)


def _terms(motion: MotionProblem, x: np.ndarray, u: np.ndarray, p: np.ndarray) -> dict[str, float]:
    """The integrands in flight, and the terms of the end."""
    ocp = motion.ocp
    running = ca.Function("running", ocp.system.arguments, list(ocp.running_cost.values()))
    terminal = ca.Function("terminal", [ocp.system.state, ocp.system.parameters], list(ocp.terminal_cost.values()))
    p = np.append(p, motion.parts.values)
    return {
        **{name: float(term) for name, term in zip(ocp.running_cost, running(x, u, [0, 0, 1], p), strict=True)},
        **{name: float(term) for name, term in zip(ocp.terminal_cost, terminal(x, p), strict=True)},
    }
