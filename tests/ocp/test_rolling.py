"""What rolls: which coordinates are tied, and that no default weight holds those that have to follow."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fesd_robot import explain, load_task, plan
from fesd_robot.ocp import MotionProblem, formulate

MASS, INERTIA, RADIUS = 2.0, 0.04, 0.2
LENGTH, DURATION = 1.0, 2.0


def prismatic(name: str, axis: str, parent: str, child: str) -> str:
    return (
        f'<joint name="{name}" type="prismatic"><parent link="{parent}"/><child link="{child}"/><axis xyz="{axis}"/>'
        '<limit lower="-100" upper="100" velocity="10" effort="0"/></joint>'
    )


def link(name: str, mass: float = 0.0, inertia: float = 0.0) -> str:
    if not mass:
        return f'<link name="{name}"/>'
    return (
        f'<link name="{name}"><inertial><mass value="{mass}"/><inertia ixx="{inertia}" ixy="0" ixz="0" '
        f'iyy="{inertia}" iyz="0" izz="{inertia}"/></inertial></link>'
    )


def turning(name: str, parent: str, child: str, limits: str, *, at: str = "0 0 0", kind: str = "revolute") -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin xyz="{at}"/>'
        f'<axis xyz="0 1 0"/><limit {limits} velocity="50"/></joint>'
    )


ROOT = (
    link("world") + link("slide_x") + link("slide_z") + prismatic("root_x", "1 0 0", "world", "slide_x")
    + prismatic("root_z", "0 0 1", "slide_x", "slide_z")
)  # fmt: skip
WHEEL = f"""<robot name="wheel">{ROOT}{link("wheel", MASS, INERTIA)}
{turning("turn", "slide_z", "wheel", 'lower="-1000" upper="1000" effort="3"')}</robot>"""
CART = f"""<robot name="cart">{ROOT}{link("body", 4, 0.2)}{link("front", 0.5, 0.002)}{link("rear", 0.5, 0.002)}
{turning("root_pitch", "slide_z", "body", 'lower="-3" upper="3" effort="0"')}
{turning("front_turn", "body", "front", 'effort="2"', at="0.3 0 0", kind="continuous")}
{turning("rear_turn", "body", "rear", 'effort="0"', at="-0.3 0 0", kind="continuous")}</robot>"""

ROLL = """
name: roll
robot: {model: robot.urdf}
ground: {type: plane, friction: 0.8}
contacts: {rim: {type: circle, frame: wheel, radius: 0.2}}
horizon: {duration: 2, intervals: 20}
initial: {configuration: {root_x: 0, turn: 0}, stand_on: {contacts: [rim], adjust: [root_z]}}
goal: {configuration: {root_x: 1}}
output: {page: false, figures: false}
"""
CART_ROLLS = ROLL.replace(
    "{rim: {type: circle, frame: wheel, radius: 0.2}}",
    "{front: {type: circle, frame: front, radius: 0.1}, rear: {type: circle, frame: rear, radius: 0.1}}",
).replace("turn: 0}, stand_on: {contacts: [rim], adjust: [root_z]}", "root_z: 0.1}")


def written(folder: Path, text: str, model: str = WHEEL) -> Path:
    (folder / "robot.urdf").write_text(model, encoding="utf-8")
    (folder / "roll.yaml").write_text(text, encoding="utf-8")
    return folder / "roll.yaml"


def problem(folder: Path, text: str = ROLL, model: str = WHEEL, overrides: list[str] | None = None) -> MotionProblem:
    return formulate(load_task(written(folder, text, model), overrides or []))


def free(motion: MotionProblem) -> set[str]:
    """Coordinates without a default weight at the end."""
    weights = motion.task.costs.terminal_configuration or {}
    return {name for name in motion.robot.velocity_names if name not in weights}


@pytest.mark.slow
def test_a_wheel_rolls_with_the_least_effort(tmp_path: Path) -> None:
    """From rest to rest, u = (I/r + m r) 6 L / T^2 (1 - 2 t / T), and v is largest, 1.5 L / T, at half time."""
    found = plan(load_task(written(tmp_path, ROLL)))
    torque, speed = found.controls["turn"], found.trajectory.velocity["root_x"]
    middles = found.controls["time"] + DURATION / len(torque) / 2
    scale = (INERTIA / RADIUS + MASS * RADIUS) * 6 * LENGTH / DURATION**2
    assert found.status.solved
    np.testing.assert_allclose(torque, scale * (1 - 2 * middles / DURATION), atol=0.02)
    assert speed.max() == pytest.approx(1.5 * LENGTH / DURATION, rel=5e-3) and speed.min() > -1e-6
    assert found.trajectory.configuration["turn"][-1] == pytest.approx(LENGTH / RADIUS, rel=1e-3)


@pytest.mark.slow
def test_a_wheel_that_falls_lands_and_rolls_on(tmp_path: Path) -> None:
    """Dropped from 0.3 m it never rolls back, and its torque stays far from its limit."""
    text = ROLL.replace("turn: 0}, stand_on: {contacts: [rim], adjust: [root_z]}", "turn: 0, root_z: 0.5}")
    found = plan(load_task(written(tmp_path, text)))
    assert found.status.solved and found.trajectory.velocity["root_x"].min() > -1e-3
    assert np.abs(found.controls["turn"]).max() < 1.5


@pytest.mark.slow
def test_two_wheels_of_a_cart_roll(tmp_path: Path) -> None:
    """Continuous joints, one of them without a motor: even, and largest at half time."""
    found = plan(load_task(written(tmp_path, CART_ROLLS, CART)))
    assert found.status.solved
    assert found.trajectory.velocity["root_x"].max() == pytest.approx(1.5 * LENGTH / DURATION, rel=1e-2)


def test_what_has_to_follow_is_free(tmp_path: Path) -> None:
    """The wheel's angle where its place has a goal, its place where its angle has one, nothing where both have one."""
    assert free(problem(tmp_path)) == {"turn", "root_z"}
    assert free(problem(tmp_path, ROLL.replace("{root_x: 1}", "{turn: 5}"))) == {"root_x", "root_z"}
    assert free(problem(tmp_path, ROLL.replace("{root_x: 1}", "{root_x: 1, turn: 5}"))) == set()
    costs = problem(tmp_path).task.costs
    assert not costs.configuration and not costs.velocity and set(costs.terminal_configuration or {}) == {"root_x"}


def test_posture_is_held(tmp_path: Path) -> None:
    """A cart's pitch and height, which are not tied, keep their weights; both wheels are free."""
    costs = problem(tmp_path, CART_ROLLS, CART).task.costs
    assert set(costs.terminal_configuration or {}) == {"root_x", "root_z", "root_pitch"}
    assert set(costs.configuration or {}) == {"root_z", "root_pitch"}


@pytest.mark.parametrize(
    ("text", "model"),
    [
        (ROLL.replace("friction: 0.8", "friction: 0"), WHEEL),  # it slides
        (
            ROLL.replace("type: circle, ", "")
            .replace(", radius: 0.2", "")
            .replace("stand_on: {contacts: [rim], adjust: [root_z]}", "velocity: {}"),
            WHEEL,
        ),  # a point of the hub
        (ROLL, WHEEL.replace('lower="-1000" upper="1000"', 'lower="-1" upper="1"')),  # it cannot turn round
        (
            ROLL.replace("{root_x: 1}", "{root_z: 0.2}")
            .replace(", stand_on: {contacts: [rim], adjust: [root_z]}", "")
            .replace("turn: 0}", "turn: 0, root_z: 0.2}"),
            WHEEL,
        ),  # nothing that is tied has to move
        (ROLL + "reference: {type: jumps, count: 1, apex: {root_z: 0.4}}\n", WHEEL),  # it jumps there
    ],
)
def test_what_need_not_roll_keeps_its_weights(tmp_path: Path, text: str, model: str) -> None:
    assert free(problem(tmp_path, text, model)) == set()


def test_weights_that_are_given_are_kept(tmp_path: Path) -> None:
    """The rule is one of default weights."""
    costs = problem(tmp_path, ROLL + "costs: {terminal_configuration: {turn: 7}}\n").task.costs
    assert costs.terminal_configuration == {"turn": 7}


def test_other_numbers_keep_the_equations(tmp_path: Path) -> None:
    """Another goal of what rolls is the same problem with other numbers."""
    moved = problem(tmp_path)
    other = moved.with_numbers_of(load_task(tmp_path / "roll.yaml", ["goal.configuration.root_x=0.5"]))
    assert free(other) == {"turn", "root_z"}


def test_check_says_what_is_tied(tmp_path: Path) -> None:
    """One sentence names what rolls, what it ties, and what is free."""
    text = " ".join(explain(load_task(written(tmp_path, ROLL))).split())
    assert "'rim' rolls, which ties turn, root_x and root_z: no default weight holds them on their way" in text
    held = " ".join(explain(load_task(written(tmp_path, CART_ROLLS, CART))).split())
    assert "Default weights ask for what the goal does not list to end where it began: root_z and root_pitch." in held
