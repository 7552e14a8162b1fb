"""The shipped tasks of bodies without controls do what their first lines say."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from fesd_robot import load_task, simulate
from fesd_robot.plans import Plan

SIMULATED = Path(__file__).parents[2] / "tasks" / "simulated"


def _simulated(name: str) -> Plan:
    """Return what a task does; it ends as asked, with an audit that passes and without a choice."""
    motion = simulate(load_task(SIMULATED / f"{name}.yaml"))
    assert motion.status.solved and motion.status.audit_passed and motion.simulation and not motion.simulation.notes
    return motion


def _at(motion: Plan, which: str, names: str, at: int) -> np.ndarray:
    table = getattr(motion.trajectory, which)
    return np.array([table[f"root_joint.{name}"][at] for name in names.split()])


def test_a_ball_turns_to_its_left_bounce_by_bounce_and_rolls_on() -> None:
    """Every one of the first bounces pushes it to its left, by mu times the normal impulse at most; then it rolls."""
    motion = _simulated("spinning_ball")
    first = motion.impulses[:4]
    assert all(0 < one.lateral < 0.1 * one.normal + 1e-12 for one in first)
    assert all(np.hypot(one.tangential, one.lateral) <= 0.1 * one.normal + 1e-12 for one in motion.impulses)
    ratios = [later.normal / one.normal for one, later in pairwise(first)]
    assert ratios == pytest.approx([0.6] * 3, abs=1e-9)
    orientation = _at(motion, "configuration", "qx qy qz qw", -1)
    (x, y, z), w = orientation[:3], orientation[3]
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    velocity = rotation @ _at(motion, "velocity", "vx vy vz", -1)
    spin = rotation @ _at(motion, "velocity", "wx wy wz", -1)
    assert velocity + np.cross(spin, [0, 0, -0.1]) == pytest.approx([0, 0, 0], abs=1e-8)
    # Friction at the rim leaves v - 2/7 of the rim's velocity, whatever it is at each bounce.
    assert velocity == pytest.approx([1.5 - 2 / 7 * (1.5 - 10 * 0.1), 2 / 7 * 40 * 0.1, 0], abs=1e-8)
    assert _at(motion, "configuration", "z", -1)[0] == pytest.approx(0.1, abs=1e-8)


def test_a_box_slides_tips_falls_on_its_side_and_rests() -> None:
    """Its low front edge slides first, its high front edge lands, and it ends at rest on what was its front."""
    motion = _simulated("tumbling_box")
    slides = motion.outcome.contacts["low_front_left"].slides
    assert slides[0].distance > 0.1
    landed = [switch.contact for switch in motion.switches if switch.kind == "touchdown"]
    assert {"high_front_left", "high_front_right"} <= set(landed)
    assert _at(motion, "configuration", "z", -1)[0] == pytest.approx(0.075, abs=1e-9)
    assert abs(_at(motion, "velocity", "vx vy vz wx wy wz", -1)).max() < 1e-9
    assert all(gaps.min() > -1e-9 for gaps in (contact.gap for contact in motion.contacts.values()))


def test_edges_come_to_rest_and_slide_off_again_whatever_the_control_grid() -> None:
    """Both corners of an edge stick, and slide again, at once, at the same time on one interval as on six."""
    motions = [
        simulate(load_task(SIMULATED / "tumbling_box.yaml", ["horizon.duration=0.3", f"horizon.intervals={intervals}"]))
        for intervals in (1, 6)
    ]
    for motion in motions:
        low = [switch for switch in motion.switches if switch.contact.startswith("low_front")]
        assert sorted((one.kind, one.contact) for one in low) == [
            ("slip_to_stick", "low_front_left"),
            ("slip_to_stick", "low_front_right"),
            ("stick_to_slip", "low_front_left"),
            ("stick_to_slip", "low_front_right"),
        ]
        first, second, third, fourth = (switch.time for switch in low)
        assert (first, third) == pytest.approx((second, fourth), abs=1e-7)
    times = [[switch.time for switch in motion.switches] for motion in motions]
    assert times[0] == pytest.approx(times[1], abs=1e-7)
    ends = [_at(motion, "configuration", "x y z qx qy qz qw", -1) for motion in motions]
    np.testing.assert_allclose(*ends, atol=1e-8)
