"""The share of its control limits that the hopper needs to stand, against m g."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from fesd_robot.ocp import formulate
from fesd_robot.ocp.judged import numeric_physics
from fesd_robot.recovery.statics import holding_effort
from fesd_robot.task import load_task

TASK = Path(__file__).parents[2] / "tasks" / "published_hopper_one_jump.yaml"
LEG_ALONE = ("robot.actuators={leg: {type: joint, joint: leg}}", "costs={}")
"""Only the joint of the leg is driven."""

WEIGHT = 1.1 * 9.81
"""N, of the hopper."""


def held(
    overrides: Sequence[str] = (), q: Sequence[float] = (0, 0.5, 0, 0.5), closed: bool = True
) -> tuple[float, np.ndarray] | None:
    motion = formulate(load_task(TASK, overrides))
    limits = motion.actuation.lower, motion.actuation.upper
    return holding_effort(numeric_physics(motion), np.array(q), limits, np.array([closed]))


@pytest.mark.parametrize("limit", [50.0, 5.0])
def test_an_upright_leg_carries_the_weight(limit: float) -> None:
    """A leg driven at its joint pushes with m g, whatever its limit."""
    found = held([*LEG_ALONE, f"limits.effort={{leg: {limit}}}"])
    assert found is not None
    assert found[0] == pytest.approx(WEIGHT / limit) and found[1] == pytest.approx([WEIGHT])


def test_a_force_on_body_and_leg_carries_half() -> None:
    """A force that pushes body and leg as well needs half the weight, the ground gives the other half."""
    found = held()
    assert found is not None
    assert found[0] == pytest.approx(0.5 * WEIGHT / 50) and found[1] == pytest.approx([0, 0.5 * WEIGHT], abs=1e-9)


def test_a_leaning_body_is_held_by_its_torque() -> None:
    """At a pitch p the torque is what the vertical ground force exerts about the body, m g l sin p."""
    pitch, leg = 0.2, 0.5
    found = held(["robot.actuators.leg_force.force={leg: 1}"], (0, leg * np.cos(pitch), pitch, leg))
    assert found is not None
    torque, force = found[1]
    assert force == pytest.approx(WEIGHT * np.cos(pitch))
    assert abs(torque) == pytest.approx(WEIGHT * leg * np.sin(pitch))
    assert found[0] == pytest.approx(force / 50)


@pytest.mark.parametrize(
    ("overrides", "q", "closed"),
    [
        ([], (0, 0.8, 0, 0.5), False),
        ([*LEG_ALONE], (0, 0.5 * np.cos(0.2), 0.2, 0.5), True),
        (["ground={slope: 0.5, friction: 0.3}", "initial.configuration.root_z=0.9", "goal.configuration.root_z=1.4",
          *LEG_ALONE], (0, 0.5, 0, 0.5), True),
        (["robot.actuators.leg_force.lower=1"], (0, 0.5, 0, 0.5), True),
    ],
    ids=["in flight", "no torque", "too slippery", "no zero"],
)  # fmt: skip
def test_what_no_force_holds(overrides: list[str], q: tuple[float, ...], closed: bool) -> None:
    """In flight, leaning without a torque or on ice no strength helps; nor can limits without zero be scaled."""
    assert held(overrides, q, closed) is None
