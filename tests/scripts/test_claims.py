"""Shipped tasks do what their first lines say."""

from __future__ import annotations

from pathlib import Path

import pytest

from fesd_robot.planning.planner import attempt
from fesd_robot.plans import Plan
from fesd_robot.task import load_task
from scripts.results.claims import CLAIMS, Claim, ContactClaim

TASKS = Path(__file__).parents[2] / "tasks"
SHORT = (
    "ball_bat",
    "block_push",
    "cart_pole_friction",
    "double_pendulum_wall",
    "hopper_downhill",
    "hopper_one_jump",
    "pick_and_place",
    "pusher_slider",
    "wheel_hills",
)
"""Tasks that take some seconds; the gallery measures all."""


def test_every_task_says_something() -> None:
    """There is one claim a task."""
    assert sorted(CLAIMS) == sorted(path.stem for path in TASKS.glob("*.yaml"))


@pytest.fixture(scope="module")
def plans() -> dict[str, Plan]:
    """The first attempts at the short tasks, without the search for cheaper motions, which takes most of the time."""
    return {name: attempt(load_task(TASKS / f"{name}.yaml", ["solver.effort=quick"])) for name in SHORT}


@pytest.mark.parametrize("name", SHORT)
def test_a_task_does_what_it_says(plans: dict[str, Plan], name: str) -> None:
    """The first attempt at a task is solved, reaches the goal and flies, slips and hits as its first line says."""
    assert CLAIMS[name].broken(plans[name]) == []


def test_a_claim_can_be_broken(plans: dict[str, Plan]) -> None:
    """A motion that does otherwise is found out: two flights are no five, and a block that slides does not stick."""
    jump, push = plans["hopper_one_jump"], plans["block_push"]
    assert CLAIMS["hopper_five_jumps"].broken(jump)[0] == "foot flies 2 times"
    (found,) = Claim({"rear": ContactClaim()}).broken(push)
    assert found.startswith("rear slips 0.")
    (found,) = Claim({"foot": ContactClaim((2, 2))}, carried=True).broken(jump)
    assert found.startswith("nothing touches at 0.")
    assert Claim({"foot": ContactClaim((2, 2))}, airborne=0.3).broken(jump) == []
    (found,) = Claim({"foot": ContactClaim((2, 2))}, airborne=0.9).broken(jump)
    assert found.startswith("it is in the air for 0.") and found.endswith("not for 0.9 s")
    (found,) = Claim(in_order=("rear", "front")).broken(push)
    assert found.startswith("rear, front come down at ")
    unsolved = jump.model_copy(update={"status": jump.status.model_copy(update={"solved": False})})
    assert CLAIMS["hopper_one_jump"].broken(unsolved) == ["it is not solved"]
