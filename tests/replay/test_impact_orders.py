"""Contacts that hit at the same instant: together, or in turn."""

from __future__ import annotations

import numpy as np
import pytest

from fesd_robot.contact import ContactMode
from fesd_robot.plans.landing_order import landing_orders
from fesd_robot.plans.measured import Names
from fesd_robot.recovery import ImpactRecord, PhysicalMotion, SwitchRecord
from fesd_robot.recovery.between import stacked_elements
from fesd_robot.replay.contacts import ReplayNote
from fesd_robot.replay.impact_orders import each_first, impacts_in_turn
from fesd_robot.replay.impacts import impact
from fesd_robot.replay.integrator import replay_motion
from fesd_robot.replay.intervals import MotionReplay, replay_intervals

from .bodies import GRAVITY, body

ARM, OWN, CROSS = 0.1, 1.01, 0.99  # m; response of a foot to an impulse of its own and of the other one, 1 / kg
FEET = body(1.0, 1.0, {"left": (-ARM, 0.0), "right": (ARM, 0.0)}, friction=0.0)
BOTH = np.array([True, True])


def landing(left: float, right: float) -> np.ndarray:
    """Velocity of the body whose feet have the given normal velocities; it pitches with its right foot down."""
    return np.array([0.0, 0.5 * (left + right), 0.5 * (left - right) / ARM])


def in_turn(first: float, second: float) -> tuple[float, float]:
    """Normal velocities of two feet after the first has stopped, and then the second, which throws the first up."""
    second -= CROSS * first / OWN
    return -CROSS * second / OWN, 0.0


def feet(v: np.ndarray) -> np.ndarray:
    """Normal velocities of both feet."""
    return np.asarray((FEET.contact_jacobian(np.zeros(3)) @ v)[::2])


def test_the_orders_of_two_feet() -> None:
    """The faster right first, or left first, in closed form; both pushing at the same rate lead elsewhere."""
    after = [feet(v) for v in impacts_in_turn(FEET, np.zeros(3), landing(-0.5, -2.0), BOTH)]
    left_first, right_first = in_turn(-0.5, -2.0), (-0.5 + CROSS * 2.0 / OWN, 0.0)
    np.testing.assert_allclose(after, [right_first, left_first], atol=1e-12)
    together = feet(impact(FEET, np.zeros(3), landing(-0.5, -2.0), BOTH).velocity)
    assert min(np.abs(together - one).max() for one in after) > 5e-3


def test_nothing_hits_in_turn_alone() -> None:
    """A foot that hits while the other one rests has no order, and neither have two of which one parts."""
    for v in (landing(0.0, -1.0), landing(0.3, -1.0)):
        assert list(impacts_in_turn(FEET, np.zeros(3), v, BOTH)) == []


def test_four_feet_have_seventy_four_orders() -> None:
    """Ordered partitions of four, less all at once; all take energy."""
    names = {f"f{i}": (0.1 * i - 0.15, 0.0) for i in range(4)}
    four, v = body(1.0, 0.004, names, friction=0.3), np.array([0.4, -1.0, 0.2])
    after = list(impacts_in_turn(four, np.zeros(3), v, np.full(4, True)))
    assert len(after) == 74
    mass = four.mass_matrix(np.zeros(3))
    assert max(one @ mass @ one for one in after) < v @ mass @ v


def fallen(after: tuple[float, float]) -> PhysicalMotion:
    """A fall of 0.1 s that ends with both feet on the ground, and a flight of 0.1 s from given velocities of them."""
    before, step = landing(-0.5, -2.0), 0.1
    start = before + np.array([0, GRAVITY * step, 0])
    q = -step * 0.5 * (start + before)
    high = landing(*after)
    end_velocity = high - np.array([0, GRAVITY * step, 0])
    end = 0.5 * step * (high + end_velocity)
    return PhysicalMotion(
        time=np.array([0.0, step, step, 2 * step]),
        configuration=np.array([q, np.zeros(3), np.zeros(3), end]),
        velocity=np.array([start, before, high, end_velocity]),
        acceleration=np.full((4, 3), np.nan),
        weight=np.zeros(4),
        interval=np.array([0, 0, 1, 1]),
        control=np.zeros((4, 3)),
        force=np.zeros((4, 2, 2)),
        gap_state=np.zeros((4, 0)),
        mode=np.full((4, 2), ContactMode.FLIGHT, dtype=object),
        impacts=[ImpactRecord(1, 2, np.ones((2, 2)))],
        switches=[SwitchRecord(step, i, "touchdown") for i in range(2)],
        clock=step * np.arange(1, 3),
        theta_sum_error=0.0,
        between=stacked_elements([], (3, 3, 3, 2)),
    )


@pytest.mark.parametrize("order", ["left first", "right first", "neither"])
def test_a_plan_may_take_an_order_and_the_replay_says_so(order: str) -> None:
    """An impact in turn is one that rigid bodies may have, and a note says that they may have others; one that is none
    of the orders has an error. The end of the interval before it is compared with the state before it."""
    after = {"left first": in_turn(-0.5, -2.0), "right first": (-0.5 + CROSS * 2.0 / OWN, 0.0), "neither": (1.0, 0.0)}
    first, second = replay_intervals(fallen(after[order]), FEET).intervals
    assert np.abs(first.velocity_error).max() < 1e-4 and np.abs(first.position_error).max() < 1e-9
    assert (np.abs(second.impact_error).max() > 0.1) == (order == "neither")
    assert (ReplayNote.IN_TURN in second.notes) == (order != "neither") and not first.notes


@pytest.mark.parametrize("early", [0.0, 1e-8, 1e-4])
def test_what_hits_at_the_end_may_as_well_hit_after_it(early: float) -> None:
    """The velocity before what hits within a microsecond of the end is kept beside that after it."""
    motion = fallen((0.0, 0.0))
    q, v = motion.configuration[0], motion.velocity[0]
    result = replay_motion(FEET, q, v, np.zeros(3), 0.1 + early)
    arrives = feet(motion.velocity[1]) if early < 1e-6 else feet(result.velocity)
    np.testing.assert_allclose(feet(result.arriving), arrives, atol=1e-3)


@pytest.mark.parametrize(("off", "in_turn_too"), [(1.9e-3, 0), (2.1e-3, 1)])
def test_orders_are_looked_at_where_a_plan_is_off_by_part_of_the_change(
    off: float, in_turn_too: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An impact that changes a velocity by 2 m/s and is off by less than 2e-3 m/s is one of all contacts together, and
    its error is told as it is."""
    looked: list[int] = []
    monkeypatch.setattr("fesd_robot.replay.intervals.impacts_in_turn", lambda *_: looked.append(1) or [])
    motion = fallen((0.0, 0.0))
    touching = np.full(2, True)
    together = impact(FEET, motion.configuration[1], motion.velocity[1], touching).velocity
    change = np.abs(together - motion.velocity[1]).max()
    motion.velocity[2] = together + np.array([0.0, 0.0, off / 2.0 * change])
    second = replay_intervals(motion, FEET).intervals[1]
    assert len(looked) == in_turn_too
    assert np.abs(second.impact_error).max() == pytest.approx(off / 2.0 * change, rel=1e-6)
    along = MotionReplay((second,)).without_impacts.velocity_errors
    assert along.max() == np.abs(second.velocity_error).max()


def test_each_of_two_feet_first() -> None:
    """Either foot before the other, in closed form; a foot that rests is none that hits."""
    found = {first: feet(v) for _, first, v in each_first(FEET, np.zeros(3), landing(-0.5, -2.0), BOTH)}
    np.testing.assert_allclose(found[0], in_turn(-0.5, -2.0), atol=1e-12)
    np.testing.assert_allclose(found[1], (-0.5 + CROSS * 2.0 / OWN, 0.0), atol=1e-12)
    assert list(each_first(FEET, np.zeros(3), landing(-1e-6, -2.0), BOTH)) == []


def test_what_another_order_changes_is_told() -> None:
    """Where a plan stops both feet at once, an order throws one of them up, which pitches the body."""
    names = Names(["left", "right"], {}, {"x": "m/s", "z": "m/s", "pitch": "rad/s"}, {})
    (found,) = landing_orders(fallen((0.0, 0.0)), FEET, names, lambda: True)
    high = {"left": in_turn(-0.5, -2.0), "right": (-0.5 + CROSS * 2.0 / OWN, 0.0)}
    pitch = {first: float(landing(*after)[2]) for first, after in high.items()}
    first = max(pitch, key=lambda name: abs(pitch[name]))
    assert (found.contacts, found.tried, found.first) == (["left", "right"], ["left", "right"], first)
    assert (found.coordinate, found.unit, found.change) == ("pitch", "rad/s", pytest.approx(pitch[first]))
    assert found.part == pytest.approx(abs(pitch[first]) / 7.5) and "left, right land at once" in found.sentence
    assert landing_orders(fallen((0.0, 0.0)), FEET, names, lambda: False) == []
