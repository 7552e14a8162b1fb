"""What to lock and to couple so that robots with legs move in the x-z plane."""

from __future__ import annotations

from pathlib import Path

import pytest

from fesd_robot import load_task
from fesd_robot.robot import load_robot
from fesd_robot.robot.sagittal import SagittalProposal, propose_sagittal

TASKS = Path(__file__).parents[2] / "tasks"
QUADRUPEDS = ("solo12", "solo8", "a1", "b1", "go1", "go2", "anymal_b", "anymal_c", "hyq", "laikago")


def _proposal(name: str) -> SagittalProposal:
    return propose_sagittal(load_robot(f"example-robot-data:{name}", root="sagittal").model)


def test_it_is_what_the_shipped_task_writes_down():
    """The proposal for Solo12 is that of its task."""
    section = load_task(TASKS / "solo12_jump.yaml").robot
    assert _proposal("solo12") == (section.locked, section.coupled)


@pytest.mark.parametrize("name", QUADRUPEDS)
def test_quadrupeds_keep_two_legs(name):
    """Left and right legs move in unison: a hip and a knee in front and behind are left beside the root."""
    proposal = _proposal(name)
    robot = load_robot(f"example-robot-data:{name}", root="sagittal", locked=proposal.locked, coupled=proposal.coupled)
    assert robot.model.nv == 3 + 4
    assert len(proposal.coupled) == 4 and all(value == 0 for value in proposal.locked.values())


@pytest.mark.parametrize(("name", "left"), [("bolt", 2), ("g1", 4), ("talos", 7)])
def test_bipeds_keep_what_swings(name, left):
    """Joints that leave the plane are locked, also where several frames have one name; all else can be loaded."""
    proposal = _proposal(name)
    robot = load_robot(f"example-robot-data:{name}", root="sagittal", locked=proposal.locked, coupled=proposal.coupled)
    assert robot.model.nv == 3 + left


def test_an_arm_without_pairs_couples_nothing():
    """Joints across the plane stay, one by one."""
    proposal = _proposal("ur5")
    assert proposal.coupled == {} and set(proposal.locked) == {"shoulder_pan_joint", "wrist_2_joint"}
