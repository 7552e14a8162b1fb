"""A contact that may not slip, and what slipping costs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import trapezoid

from fesd_robot.contact.velocities import SLIPPING
from fesd_robot.ocp import formulate
from fesd_robot.planner import plan
from fesd_robot.plans import Plan
from fesd_robot.task import Task, load_task

TASKS = Path(__file__).parents[2] / "tasks"
FORBIDDEN = "contacts.foot.slipping=forbidden"


def slid(result: Plan) -> float:
    """Distance, m, that the foot slides in all."""
    assert result.outcome is not None
    return sum(slide.distance for slide in result.outcome.contacts["foot"].slides)


def test_nothing_changes_where_slipping_is_allowed(load_short: Callable[..., Task]) -> None:
    """The conditions of a contact that may slip are those without the key; forbidding adds one in each direction."""
    plain, allowed, forbidden = (
        formulate(load_short(*overrides)).contact_system.system.complementarities
        for overrides in ((), ("contacts.foot.slipping=allowed",), (FORBIDDEN,))
    )
    assert [one.label for one in plain] == [one.label for one in allowed]
    added = [one for one in forbidden if one.label not in {other.label for other in plain}]
    assert [one.label.kind for one in added] == [SLIPPING, SLIPPING]
    assert all(one.vanishing and one.level == "velocity" and one.complement is not None for one in added)


def test_a_foot_that_may_not_slip_sticks(load_short: Callable[..., Task], short_plan: Plan) -> None:
    """Leaning forward, the foot slips where it may; where it may not, it does not, and the audit has measured it."""
    result = plan(load_short(FORBIDDEN))
    assert result.status.solved, result.status.message
    assert result.audit.max_slip_violation is not None and result.audit.max_slip_violation < 1e-6
    assert slid(result) == 0.0 and "slip" not in result.contacts["foot"].mode
    assert short_plan.audit.max_slip_violation == 0.0
    assert result.statistics.objective >= short_plan.statistics.objective * (1 - 1e-6)


def test_slipping_has_a_price(load_short: Callable[..., Task]) -> None:
    """The term of the cost is weight times the work of friction, the integral of |tangential force times velocity|."""
    result = plan(load_short("costs.slipping={foot: 0.01}", "initial.velocity={root_x: 0.5}"))
    assert result.status.solved, result.status.message
    assert slid(result) > 0.01
    trajectory, foot = result.trajectory, result.contacts["foot"]
    pitch, leg = trajectory.configuration["root_pitch"], trajectory.configuration["leg"]
    turning, stretching = trajectory.velocity["root_pitch"], trajectory.velocity["leg"]
    velocity = trajectory.velocity["root_x"] + stretching * np.sin(pitch) + leg * np.cos(pitch) * turning
    power = np.abs(foot.tangential_force * velocity)
    assert not result.impulses
    work = float(trapezoid(power, trajectory.time))
    assert result.statistics.cost_terms["slipping"] == pytest.approx(0.01 * work, rel=0.05)


def test_the_hopper_hops_to_rest() -> None:
    """What the first line of the task says: it hops, the foot never slips, and the robot is there and at rest."""
    result = plan(load_task(TASKS / "hopper_hops_to_rest.yaml"))
    assert result.status.solved and result.status.exact, result.status.message
    assert result.outcome is not None
    foot = result.outcome.contacts["foot"]
    assert max(flight.height for flight in foot.flights) > 0.1 and foot.slides == []
    assert sum(flight.length for flight in foot.flights) == pytest.approx(0.7, abs=0.02)
    assert all(entry.met for entry in result.outcome.goal) and len(result.outcome.goal) == 8
