"""The start of a motion: contacts that touch there."""

from __future__ import annotations

from pathlib import Path

from fesd_robot.ocp import formulate
from fesd_robot.ocp.parts import CLOSED
from fesd_robot.task import load_task

HOPPER = Path(__file__).parents[2] / "tasks" / "hopper_one_jump.yaml"


def test_another_posture_at_the_start_is_the_same_equations() -> None:
    """The gap of a foot that stands there is the same expression wherever the robot begins, and zero there."""
    motions = [
        formulate(load_task(HOPPER, [f"initial.configuration.root_pitch={pitch}", f"initial.configuration.leg={leg}"]))
        for pitch, leg in ((0.0, 0.5), (0.03, 0.44), (-0.1, 0.37))
    ]
    assert len({str(motion.contacts[0].gap) for motion in motions}) == 1
    for motion in motions:
        assert abs(float(motion.parts.gap(motion.endpoints.initial_configuration))) <= CLOSED
