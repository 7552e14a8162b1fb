"""What `fesd-robot check` says about goals of points, waypoints, references, costs and constraints."""

from __future__ import annotations

from pathlib import Path

import pytest

from fesd_robot.explanation.problem import explanation
from fesd_robot.fesd import Transcription
from fesd_robot.ocp import formulate
from fesd_robot.task import load_task

ROOT = Path(__file__).parents[2]


def explained(*overrides: str) -> str:
    motion = formulate(load_task(ROOT / "tasks" / "published_hopper_one_jump.yaml", overrides))
    text = explanation(motion, Transcription(motion.ocp, motion.fesd).problem)
    assert max(map(len, text.splitlines())) <= 120
    return " ".join(text.split())


@pytest.mark.parametrize(
    ("goal", "words"),
    [
        (
            "{configuration: {root_x: 1, root_pitch: 0, leg: 0.5}}",
            "root_x and leg within 0.01 m, root_pitch within 0.01 rad, at rest within 0.01 m/s and rad/s; all else",
        ),
        (
            "{configuration: {root_x: 1, root_z: 0.5, root_pitch: 0, leg: 0.5}}",
            "root_x, root_z and leg within 0.01 m, root_pitch within 0.01 rad, at rest within 0.01 m/s and rad/s. ",
        ),
        (
            "{configuration: {leg: 0.5}, tolerance: {velocity: {leg: 0.2}}}",
            "leg within 0.01 m, velocity of root_x and root_z within 0.01 m/s, velocity of root_pitch within 0.01 "
            "rad/s, velocity of leg within 0.2 m/s; all else is soft",
        ),
        ("{configuration: {leg: 0.5}, velocity: {leg: 1}}", "leg within 0.01 m, velocity of leg within 0.01 m/s; all"),
        ("{frames: {foot: {position: {x: 1}}}}", "at rest within 0.01 m/s and rad/s; all other coordinates are soft"),
    ],
)
def test_what_a_goal_promises(goal: str, words: str) -> None:
    """Coordinates that are reached equally closely are one phrase, and so is rest; all else is soft."""
    assert f"Goal Hard: {words}" in explained(f"goal={goal}")


def test_targets_and_constraints_are_described() -> None:
    """Each goal of a point, waypoint, further cost and constraint is one sentence or row with its numbers."""
    text = explained(
        "goal.frames={foot: {position: {x: 1, z: 0}, tolerance: 0.01}}",
        "goal.center_of_mass={velocity: {x: 0}, velocity_weight: 3}",
        "waypoints=[{time: 0.5, configuration: {leg: 0.2}, tolerance: {configuration: {leg: 0.1}}}]",
        "reference={type: waypoints}",
        "costs.control_change={leg_force: 2}",
        "costs.frames={foot: {z: 3}}",
        "costs.force={foot: 0.1}",
        "constraints.knee={type: clearance, frame: body, offset: [0, 0, -0.1], distance: 0.2}",
        "constraints.rock={type: avoid_box, frame: foot, center: {x: 0.5, z: 0}, size: {x: 0.1, z: 0.2}}",
        "constraints.ball={type: avoid_sphere, frame: foot, center: {x: 0.5, z: 0}, radius: 0.2}",
        "constraints.egg={type: avoid_ellipse, frame: foot, center: {x: 0.5, z: 0}, semi_axes: {x: 0.2, z: 0.1}}",
        "constraints.room={type: frame_limits, frame: body, z: [null, 1.2]}",
        "constraints.ditch={type: forbidden_zone, contact: foot, x: [0.4, 0.6]}",
        "constraints.up={type: contact_window, contact: foot, times: [0.4, 0.5], touch: forbidden}",
        "constraints.down={type: contact_window, contact: foot, times: [0.9, 1], touch: required}",
        "contacts.foot.slipping=0.25",
    )
    for words in (
        "friction 0.45, inelastic, may slip 0.25 m in all; touching at the start",
        "foot: at x 1, z 0 m within 0.01 m, weight 100.",
        "center of mass: moving with x 0 m/s, weight 3.",
        "After interval 10 of 20, 0.5 s: leg 0.2, leg within 0.1.",
        "Cubic splines through the waypoints.",
        "change of control between intervals: leg_force 2",
        "distance of frame foot from the reference's: z 3",
        "integral of the normal force (not squared): foot 0.1",
        "knee: the point x 0, y 0, z -0.1 m of frame 'body' stays 0.2 m above the ground, at every stage.",
        "out of the box around x 0.5, z 0 m, size x 0.1, z 0.2 m, rounded outwards (up to 9.1 % wider)",
        "out of the sphere of radius 0.2 m around x 0.5, z 0 m",
        "out of the ellipsoid around x 0.5, z 0 m, half axes x 0.2, z 0.1 m",
        "room: the origin of frame 'body' stays in z [-inf, 1.2] m, at every stage.",
        "ditch: foot does not push on the ground for x in [0.4, 0.6] m.",
        "up: the gap of foot is open by 0.01 m at every stage from 0.4 to 0.5 s.",
        "down: the gap of foot is closed within 0.001 m at every interval's end from 0.9 to 1 s.",
    ):
        assert words in text, words


def test_a_free_duration_and_a_period_are_described() -> None:
    """The bounds of the duration, the stride, and that the goal's own weights have no place."""
    text = explained(
        "horizon.duration={lower: 0.5, upper: 2}",
        "goal={periodic: {stride: {root_x: 0.5}}}",
        "costs={time: 4}",
    )
    for words in (
        "0.5 to 2 s, first taken as 1.25 s, in 20 intervals of 0.0625 s",
        "Periodic: the motion ends in the state it begins in, shifted by one stride: root_x by 0.5 m; the start",
        "duration (not squared): 4",
    ):
        assert words in text, words
    assert "distance from the goal" not in text and "Waypoints" not in text and "Constraints" not in text


def test_a_mirror_and_a_swing_are_described() -> None:
    """Which coordinates change places with which sign, and how high which contact swings at which speed."""
    text = explained(
        "goal={periodic: {mirror: {root_pitch: -root_pitch}, stride: {root_x: 0.5}}}",
        "constraints={up: {type: swing_clearance, contacts: [foot], height: 0.05, speed: 0.2}}",
        "costs={}",
    )
    for words in (
        "Periodic: the motion ends in the mirror image of the state it begins in, shifted by one stride",
        "Mirrored, each ends as the other began: root_pitch as -root_pitch; all else ends as it began.",
        "up: where foot moves along the surface faster than 0.2 m/s, it is above it, by 0.04 m at 0.6 m/s and towards "
        "0.05 m.",
    ):
        assert words in text, words


def test_restitution_is_said_where_there_is_some() -> None:
    """Of the ground, of a wall and of a contact; without any an impact is inelastic."""
    text = explained("ground.restitution=0.3", "ground.walls={end: {x: 3, side: left, restitution: 0.9}}")
    assert "friction 0.45, restitution 0.3 unless a contact has its own." in text
    assert "the robot on its left; friction 0.8, restitution 0.9." in text
    assert "frame 'foot', friction 0.45, restitution 0.3; " in text
    assert "frame 'foot', friction 0.45, inelastic; " in explained()
