"""Friction and effort that a plan leaves unused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from fesd_robot.errors import TaskError
from fesd_robot.ocp import formulate
from fesd_robot.planning.planner import plan
from fesd_robot.task import Task, load_task

TASKS = Path(__file__).parents[2] / "tasks"
WEIGHT, SLOPE, FRICTION = 2.0 * 9.81, 0.4363, 0.4


def least_push(friction: float) -> float:
    """Horizontal force, N, that holds a block on a slope with so much friction."""
    sine, cosine = np.sin(SLOPE), np.cos(SLOPE)
    return float(WEIGHT * (sine - friction * cosine) / (cosine + friction * sine))


@pytest.mark.slow
@pytest.mark.parametrize("slipping", ["allowed", "forbidden"])
def test_a_block_is_held_with_the_friction_that_may_be_used(slipping: str) -> None:
    """The cheapest push leaves a quarter of the friction unused; a slide that does not move would use all of it."""
    corners = [f"contacts.{corner}.slipping={slipping}" for corner in ("rear", "front")]
    result = plan(load_task(TASKS / "block_slope.yaml", ["reserve.friction=0.25", *corners]))
    assert result.status.solved, result.status.message
    np.testing.assert_allclose(result.controls["push"], least_push(0.75 * FRICTION), rtol=1e-5)
    assert result.outcome is not None and not result.warnings
    for contact in result.outcome.contacts.values():
        assert contact.slide_distance == 0 and contact.sticking is not None
        assert contact.sticking.share == pytest.approx(0.75, abs=1e-4)


def test_nothing_changes_without_a_reserve(load_short: Callable[..., Task]) -> None:
    """The system has no further variable; where the foot may not slip it never has, and uses less friction instead."""
    names = {
        name: formulate(load_short(*overrides)).contact_system.system.algebraic_names
        for name, overrides in {
            "none": (),
            "zero": ("reserve={friction: 0, effort: 0}",),
            "slips": ("reserve.friction=0.2",),
            "forbidden": ("reserve.friction=0.2", "contacts.foot.slipping=forbidden"),
        }.items()
    }
    assert names["none"] == names["zero"] == names["forbidden"]
    assert [name for name in names["slips"] if name not in names["none"]] == [
        "beyond the reserve+[foot]",
        "beyond the reserve-[foot]",
    ]


@pytest.mark.parametrize(
    ("slipping", "restitution", "used"), [("forbidden", 0, 0.8), ("forbidden", 0.5, 1), ("allowed", 0, 1)]
)
def test_only_what_comes_to_rest_has_less_friction(
    load_short: Callable[..., Task], slipping: str, restitution: float, used: float
) -> None:
    """A contact that may slip or bounce slides with all of its friction; audit and costs know all of it."""
    (foot,) = formulate(
        load_short(
            "reserve.friction=0.2", f"contacts.foot.slipping={slipping}", f"contacts.foot.restitution={restitution}"
        )
    ).contacts
    assert foot.usable_friction == pytest.approx(used * foot.friction)
    assert foot.usable_friction * (1 - foot.sticking_reserve) == pytest.approx(0.8 * foot.friction)


def test_the_cone_in_space_is_narrower_where_a_contact_sticks() -> None:
    """What there is to spare is (1 - r)^2 beta^2 - |f|^2, for whatever multipliers."""
    motion = formulate(load_task(TASKS / "pick_and_place.yaml", ["contacts.left.reserve=0.3"]))
    system, names = motion.contact_system.system, motion.contact_system.system.algebraic_names
    left, right = motion.contact_system.theta_auxiliary[:2]
    assert len(left.spares) == 1 and not right.spares and "beyond the reserve[left]" in names
    z = np.random.default_rng(0).uniform(size=len(names))
    row = next(i for i in range(system.residual.numel()) if ca.depends_on(system.residual[i], left.spares[0]))
    quantities = ca.vertcat(system.residual[row] - left.spares[0], left.normal, *left.tangential)
    defined, beta, *friction = np.asarray(
        ca.Function("spare", [system.state, system.algebraic], [quantities], {"allow_free": True})(
            np.zeros(system.state.numel()), z
        )
    ).ravel()
    assert -defined == pytest.approx((0.7 * beta) ** 2 - np.square(friction).sum())


def test_controls_keep_theirs() -> None:
    """Bounds of the problem are a part of the limits, those of actuators that say so their own part; limits stay."""
    motion = formulate(
        load_task(TASKS / "hopper_one_jump.yaml", ["reserve.effort=0.1", "robot.actuators.leg_force.reserve=0.4"])
    )
    assert motion.ocp.control_upper[:2].tolist() == [45.0, 60.0] and motion.ocp.control_lower[:2].tolist() == [-45, -60]
    assert motion.actuation.upper.tolist() == [50.0, 100.0]


@pytest.mark.parametrize(
    ("overrides", "says"),
    [
        (["reserve.friction=1"], "found 1, expected a number from 0 to less than 1"),
        (["reserve.effort=-0.1"], "found -0.1, expected a number from 0 to less than 1"),
        (["contacts.foot={frame: foot, friction: 0, reserve: 0.1}"], "for a contact without friction"),
        (["method.contact=impulses", "contacts.foot.slipping=allowed", "reserve.friction=0.1"], "may slip or bounce"),
        (
            ["robot.actuators.leg_force={type: joint, joint: leg, lower: 50, upper: 60}", "reserve.effort=0.5"],
            "leaves nothing of the limits [50, 60] of 'leg_force'",
        ),
    ],
)
def test_what_cannot_be_kept_is_refused(overrides: list[str], says: str) -> None:
    """One sentence each, at the key."""
    with pytest.raises(TaskError) as error:
        formulate(load_task(TASKS / "hopper_one_jump.yaml", overrides))
    assert says in str(error.value)
