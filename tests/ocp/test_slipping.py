"""A contact that may not slip, or not far, and what slipping costs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import trapezoid

from fesd_robot.contact.kinds import SLIPPING
from fesd_robot.contact.slip_distance import SLIP_SPEED
from fesd_robot.errors import TaskError
from fesd_robot.ocp import formulate
from fesd_robot.planning.planner import plan
from fesd_robot.plans import Plan
from fesd_robot.task import Task, load_task

TASKS = Path(__file__).parents[2] / "tasks"
FORBIDDEN = "contacts.foot.slipping=forbidden"


def slid(result: Plan) -> float:
    """Distance, m, that the foot slides in all."""
    assert result.outcome is not None
    return result.outcome.contacts["foot"].slide_distance


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


@pytest.mark.parametrize(
    ("overrides", "slipping"),
    [
        ([], "forbidden"),
        (["reference={type: line}"], "allowed"),
        (["ground.friction=0"], "allowed"),
        (["method.formulation.type=steps"], "allowed"),
    ],
    ids=["jumps", "line", "no friction", "steps"],
)
def test_what_jumps_does_not_slip(overrides: list[str], slipping: str) -> None:
    """A point on the ground is forbidden to slip by itself where the task asks for jumps and friction can hold it."""
    motion = formulate(
        load_task(TASKS / "hopper_one_jump.yaml", ["method.grid=uniform", "contacts.foot={frame: foot}", *overrides])
    )
    assert motion.task.contacts["foot"].slipping == slipping
    assert motion.contacts[0].slip_distance == (0 if slipping == "forbidden" else np.inf)


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


def test_a_limit_adds_a_state_and_a_speed(load_short: Callable[..., Task]) -> None:
    """A number adds a slip distance to the states, a speed to the algebraic variables, one condition a direction."""
    plain, limited = (formulate(load_short(*given)) for given in ((), ("contacts.foot.slipping=0.3",)))
    before, after = plain.contact_system.system, limited.contact_system.system
    assert list(after.state_names) == [*before.state_names, "foot slip distance"]
    assert list(after.algebraic_names) == [*before.algebraic_names, "slip speed[foot]"]
    assert [one.label for one in after.complementarities[: len(before.complementarities)]] == [
        one.label for one in before.complementarities
    ]
    assert [one.label.kind for one in after.complementarities[len(before.complementarities) :]] == [SLIP_SPEED] * 2
    assert (limited.ocp.initial_upper[-1], limited.ocp.terminal_upper[-1]) == (0.0, 0.3)
    assert limited.contact_system.gap_states == plain.contact_system.gap_states == 1


@pytest.fixture(scope="module")
def push() -> Callable[..., Plan]:
    """Plan a block that is pushed towards a target 0.8 m away, as near as is worth its while."""
    soft_goal = ["goal.soft=true", "goal.tolerance={}", "costs.terminal_configuration={root_x: 1000}"]
    soft = [*soft_goal, "waypoints=[]", "solver.velocity_level_ratio=1000.0", "solver.retries=0"]
    return lambda *overrides: plan(load_task(TASKS / "block_push.yaml", ["method.grid=uniform", *soft, *overrides]))


@pytest.mark.slow
def test_a_block_slips_as_far_as_it_may(push: Callable[..., Plan]) -> None:
    """Pushed towards a target 0.8 m away, a block whose rear edge may slip 0.3 m gets 0.3 m far, and it is exact."""
    free, limited = push(), push("contacts.rear.slipping=0.3")
    assert free.status.solved and limited.status.solved and limited.status.exact, limited.status.message
    assert free.outcome is not None and limited.outcome is not None
    assert free.outcome.contacts["rear"].slide_distance > 0.75
    for contact in limited.outcome.contacts.values():
        assert contact.slide_distance == pytest.approx(0.3, abs=2e-3) and contact.slide_distance <= 0.3 + 1e-6
    assert limited.trajectory.configuration["root_x"][-1] == pytest.approx(0.3, abs=2e-3)
    assert limited.audit.max_slip_distance_violation == 0.0


@pytest.mark.slow
def test_a_hopper_may_slip_a_little() -> None:
    """A hopper that may slip 5 cm hops to rest and slips no further; what it slips is the path of its foot."""
    slippery = ["contacts.foot.slipping=0.05", "ground.friction=0.3", "solver.retries=0"]
    task = load_task(TASKS / "hopper_one_jump.yaml", ["method.grid=uniform", *slippery])
    result = plan(task)
    assert result.status.solved and result.status.exact, result.status.message
    assert 0.01 < slid(result) <= 0.05 + 1e-6
    foot, last = result.contacts["foot"], result.trajectory.time > 0.95 + 1e-9
    assert {mode for mode, at in zip(foot.mode, last, strict=True) if at} <= {"stick", "slip"}, "at rest on its foot"
    assert result.outcome is not None and all(entry.met for entry in result.outcome.goal)
    assert "regularisation of the slip speeds" in result.statistics.cost_terms
    assert result.statistics.cost_terms["regularisation of the slip speeds"] < 1e-2 * result.statistics.objective


@pytest.mark.parametrize(
    ("slipping", "sentence"),
    [
        ("0", "found 0, expected 'forbidden' for a contact that may not slip at all"),
        ("-0.1", "found -0.1, expected 'allowed', 'forbidden', 'auto' or a number greater than 0 (m)"),
        ("far", "found the text 'far', expected 'allowed', 'forbidden', 'auto' or a number greater than 0 (m)"),
        (
            "forbiden",
            "found the text 'forbiden', expected 'allowed', 'forbidden', 'auto' or a number greater than 0 (m) (did ",
        ),
        (".inf", "found inf, expected 'allowed', 'forbidden', 'auto' or a number greater than 0 (m)"),
    ],
)
def test_a_limit_is_a_positive_number(load_short: Callable[..., Task], slipping: str, sentence: str) -> None:
    """Anything else is refused with the key and what would be valid."""
    with pytest.raises(TaskError) as caught:
        load_short(f"contacts.foot.slipping={slipping}")
    assert f"contacts.foot.slipping: {sentence}" in str(caught.value)


@pytest.mark.parametrize(
    ("other", "sentence"),
    [
        ("contacts.foot.friction=0", "found 0.3 for a contact without friction, expected friction greater than 0"),
        ("method.formulation.type=steps", "found 0.3 beside method.formulation.type 'steps', expected 'multipliers'"),
    ],
)
def test_a_limit_needs_friction_and_multipliers(load_short: Callable[..., Task], other: str, sentence: str) -> None:
    """Where nothing could keep a contact from slipping further, or in the step form, a limit is refused."""
    with pytest.raises(TaskError) as caught:
        formulate(load_short("contacts.foot.slipping=0.3", other))
    assert f"contacts.foot.slipping: {sentence}" in str(caught.value)
