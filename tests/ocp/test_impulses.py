"""Tasks whose impacts are impulses between finite elements: closed forms, audit, replay, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fesd_robot import plan
from fesd_robot.errors import TaskError
from fesd_robot.ocp import formulate

from .cart import puck

THROWN = """\
horizon: {duration: 0.7, intervals: 3}
initial: {configuration: {x: 0, z: 0.2}, velocity: {x: 1}}
costs: {control: {x: 10, z: 10}, slipping: {}, configuration: {}, velocity: {}, terminal_configuration: {},
  terminal_velocity: {}}
method: {contact: impulses}
limits: {effort: {x: 1.0e-6, z: 1.0e-6}}
solver: {retries: 0, effort: quick}
"""
"""A puck that is thrown flat, and let go: nothing can push it."""


def test_thrown_puck(tmp_path: Path) -> None:
    """It lands with an impulse on the cone of friction, slides and stops where it should; audit and replay agree."""
    result = plan(puck(tmp_path, THROWN, friction=0.3))
    assert result.status.solved, result.status.message
    falls = np.sqrt(0.4 / 9.81)
    (impulse,) = result.impulses
    assert impulse.time == pytest.approx(falls, abs=1e-7)
    assert impulse.normal == pytest.approx(9.81 * falls, abs=1e-6)
    assert impulse.tangential == pytest.approx(-0.3 * 9.81 * falls, abs=1e-6)
    speed = 1 - 0.3 * 9.81 * falls
    assert result.at(0.7).configuration["x"] == pytest.approx(falls + speed**2 / (2 * 0.3 * 9.81), abs=1e-6)
    before, after = result.at(impulse.time), result.at(impulse.time, side="after")
    assert before.velocity["z"] == pytest.approx(-9.81 * falls, abs=1e-6)
    assert after.velocity["x"] == pytest.approx(speed, abs=1e-6)


REFUSED = [
    ("contact: impulses", "contact: impulses, auxiliary_force: 20", "method.auxiliary_force", "no effect"),
    ("contact: impulses", "contact: impulses, formulation: {type: steps}", "method.formulation.type", "no effect"),
    ("limits: {", "limits: {speed_of_time: {upper: 2}, ", "limits.speed_of_time", "which is 1"),
    ("contact: impulses", "contact: impulse", "method.contact", "'freezing' or 'impulses'"),
]


@pytest.mark.parametrize(("old", "new", "key", "fragment"), REFUSED, ids=[one[1] for one in REFUSED])
def test_keys_without_effect_are_refused(tmp_path: Path, old: str, new: str, key: str, fragment: str) -> None:
    """What only a clock that stops knows is an error beside impulses, and names the key."""
    with pytest.raises(TaskError, match=fragment) as error:
        puck(tmp_path, THROWN.replace(old, new))
    assert key in str(error.value)


def test_the_clock_never_stops(tmp_path: Path) -> None:
    """With a fixed duration the speed of time is 1, and no row of the problem holds the clock."""
    motion = formulate(puck(tmp_path, THROWN))
    assert motion.ocp.control_lower[-1] == motion.ocp.control_upper[-1] == 1.0
    assert not motion.contact_system.clock_stops
    assert motion.ocp.interval_end_names == ()


def test_the_ratio_has_a_default_of_its_own(tmp_path: Path) -> None:
    """Impulses relax the velocity level less, unless the task says how much; the task of a plan says so, too."""
    assert puck(tmp_path, THROWN).solver.velocity_level_ratio == 5.0
    given = THROWN.replace("retries: 0", "retries: 0, velocity_level_ratio: 30.0")
    assert puck(tmp_path, given).solver.velocity_level_ratio == 30.0
    assert puck(tmp_path, THROWN.replace("impulses", "freezing")).solver.velocity_level_ratio == 30.0
