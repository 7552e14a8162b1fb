"""Planned bounces: closed forms of optima, Newton's law with friction, and motions that replay as planned."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fesd_robot.errors import TaskError
from fesd_robot.ocp import formulate
from fesd_robot.planning.planner import attempt
from fesd_robot.plans import Plan
from fesd_robot.task import load_task
from tests.bodies_in_space import MASS as MASS_IN_SPACE
from tests.bodies_in_space import written

GRAVITY = 9.81
MASS, RADIUS = 2.0, 0.1

DISC = f"""<robot name="disc"><link name="world"/><link name="rail"/><link name="lift"/><link name="disc">
<inertial><mass value="{MASS}"/>
<inertia ixx="0.01" iyy="{0.5 * MASS * RADIUS**2}" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="x" type="prismatic"><parent link="world"/><child link="rail"/><axis xyz="1 0 0"/>
<limit lower="-100" upper="100" effort="20" velocity="100"/></joint>
<joint name="z" type="prismatic"><parent link="rail"/><child link="lift"/><axis xyz="0 0 1"/>
<limit lower="-100" upper="100" effort="15" velocity="100"/></joint>
<joint name="spin" type="revolute"><parent link="lift"/><child link="disc"/><axis xyz="0 1 0"/>
<limit lower="-100" upper="100" effort="0" velocity="100"/></joint></robot>
"""


def planned(folder: Path, friction: float, restitution: float, others: str) -> Plan:
    """Return the first attempt at a task of a disc that is pushed along x, without the search for cheaper motions."""
    (folder / "disc.urdf").write_text(DISC, encoding="utf-8")
    task = (
        "name: disc\n"
        "robot: {model: disc.urdf, root: fixed, actuators: {push: {type: joint, joint: x, lower: -20, upper: 20}}}\n"
        f"ground: {{type: plane, friction: {friction}, restitution: {restitution}}}\n"
        f"contacts: {{rim: {{type: circle, frame: disc, radius: {RADIUS}}}}}\n"
        "solver: {effort: quick}\n"
        "method: {accuracy: none}\n"
        "costs: {configuration: {}, velocity: {}, terminal_configuration: {}, terminal_velocity: {}, slipping: {}, "
        "control: {push: 1}}\n" + others
    )
    (folder / "task.yaml").write_text(task, encoding="utf-8")
    return attempt(load_task(folder / "task.yaml", ["method.grid=uniform"]))


def replays(plan: Plan) -> bool:
    """Whether a plan is exact, passes its audit and obeys the impact law, and its replay goes the same way."""
    audit = plan.audit
    assert plan.status.exact and plan.status.audit_passed, plan.status.message
    assert audit.max_impact_law_error <= 1e-8 and audit.max_replay_position_error is not None
    return audit.max_replay_position_error <= 1e-8 and (audit.max_impact_energy_gain or 0.0) <= 1e-9


def test_a_disc_bounces_to_its_target_with_the_least_push(tmp_path: Path) -> None:
    """It falls and bounces as nobody drives it to, at times and with impulses in closed form, while the push along x is
    the least one in squares that brings it to the nearest end of the goal's tolerance: that of a linear problem."""
    duration, intervals, drop, e = 1.2, 8, 0.8, 0.8
    plan = planned(
        tmp_path,
        0.0,
        e,
        f"horizon: {{duration: {duration}, intervals: {intervals}}}\n"
        f"initial: {{configuration: {{x: 0, z: {drop + RADIUS}}}}}\n"
        "goal: {configuration: {x: 1}, velocity: {x: 0}}\n",
    )
    assert replays(plan)
    first = np.sqrt(2 * drop / GRAVITY)
    hits = np.array([first, first * (1 + 2 * e)])
    assert [switch.kind for switch in plan.switches] == ["touchdown", "takeoff"] * 2
    np.testing.assert_allclose([one.time for one in plan.impulses], hits, atol=1e-9)
    speed = GRAVITY * first
    np.testing.assert_allclose(
        [one.normal for one in plan.impulses], MASS * (1 + e) * speed * np.array([1, e]), atol=1e-7
    )
    step = duration / intervals
    middles = step * (np.arange(intervals) + 0.5)
    effect = step / MASS * np.array([duration - middles, np.ones(intervals)])
    wanted = np.array([0.99, 0.01])  # the nearest corner of the tolerance
    least = effect.T @ np.linalg.solve(effect @ effect.T, wanted)
    np.testing.assert_allclose(plan.controls["push"], least, atol=1e-5)


@pytest.mark.parametrize("friction", [0.05, 0.6])
def test_a_disc_bounces_with_friction_as_newton_and_coulomb_say(tmp_path: Path, friction: float) -> None:
    """Thrown with spin, it slides through the impact, or its rim sticks before the end of it: one finite element holds
    either, with -e v_n and the impulse of friction in closed form."""
    speed, spin, drop, e = 1.5, -10.0, 0.4, 0.7
    plan = planned(
        tmp_path,
        friction,
        e,
        "horizon: {duration: 0.6, intervals: 4}\n"
        f"initial: {{configuration: {{x: 0, z: {drop + RADIUS}}}, velocity: {{x: {speed}, z: 0, spin: {spin}}}}}\n"
        "goal: {configuration: {}, soft: true}\n",
    )
    assert replays(plan)
    (hit,) = plan.impulses
    falling = np.sqrt(2 * GRAVITY * drop)
    normal = MASS * (1 + e) * falling
    sliding = speed - RADIUS * spin
    assert hit.normal == pytest.approx(normal, abs=1e-7)
    assert hit.tangential == pytest.approx(-min(friction * normal, MASS * sliding / 3), abs=1e-6)
    at_end = {name: values[-1] for name, values in plan.trajectory.velocity.items()}
    assert at_end["z"] == pytest.approx(e * falling - GRAVITY * (0.6 - np.sqrt(2 * drop / GRAVITY)), abs=1e-7)
    spun = spin - hit.tangential * RADIUS / (0.5 * MASS * RADIUS**2)
    assert at_end["spin"] == pytest.approx(spun, abs=1e-6)


def test_without_restitution_nothing_is_added(tmp_path: Path) -> None:
    """A restitution of zero leaves the system as it is; another one adds the conditions of the end of an impact."""
    task = Path(__file__).parents[2] / "tasks" / "block_push.yaml"
    kinds = [
        [
            (one.label.kind, one.initial_value_factor, one.complement is None)
            for one in formulate(load_task(task, ["method.grid=uniform", *own])).ocp.system.complementarities
        ]
        for own in ([], ["ground.restitution=0"], ["ground.restitution=0.5"])
    ]
    assert kinds[0] == kinds[1] and not any(initial_value_factor for _, initial_value_factor, _ in kinds[0])
    added = [kind for kind, _, _ in kinds[2] if kind not in [known for known, _, _ in kinds[0]]]
    assert added == ["restitution", "friction after impact", "friction after impact"] * 2


def test_a_contact_has_its_own_restitution_before_that_of_its_surface(tmp_path: Path) -> None:
    """As friction: the contact's, else that of the wall or the ground that it touches."""
    task = Path(__file__).parents[2] / "tasks" / "double_pendulum_wall.yaml"
    own = ["ground.restitution=0.9", "ground.walls.right.restitution=0.4", "contacts.tip.restitution=0.2"]
    assert [one.restitution for one in formulate(load_task(task, ["method.grid=uniform", *own])).contacts] == [0.4, 0.2]


def test_the_published_form_has_no_restitution() -> None:
    """One sentence names the key and what would be valid."""
    task = Path(__file__).parents[2] / "tasks" / "block_push.yaml"
    with pytest.raises(TaskError) as caught:
        formulate(load_task(task, ["method.grid=uniform", "ground.restitution=0.5", "method.formulation.type=steps"]))
    assert "method.formulation.type" in str(caught.value)
    assert "found 'steps' beside a restitution of 0.5 of contact 'rear', expected 'multipliers'" in str(caught.value)


def test_the_foot_of_a_dropped_hopper_bounces(tmp_path: Path) -> None:
    """The hopper falls from 0.2 m: its foot parts with e times its velocity, by 1 + e times the impulse that stops it,
    and its replay goes the same way; the least control is none."""
    e, model = 0.3, Path(__file__).parents[2] / "models" / "hopper" / "hopper.urdf"
    (tmp_path / "task.yaml").write_text(
        "name: drop\n"
        f"robot: {{model: {model}, armature: {{leg: 0.1}}, "
        "actuators: {leg_force: {type: joint, joint: leg, lower: -100, upper: 100}}}\n"
        f"ground: {{type: plane, friction: 0.45, restitution: {e}}}\n"
        "contacts: {foot: {frame: foot}}\n"
        "horizon: {duration: 0.22, intervals: 4}\n"
        "solver: {effort: quick}\n"
        "initial: {configuration: {root_z: 0.7, leg: 0.5}}\n"
        "goal: {configuration: {}, soft: true}\n"
        "limits: {position: {leg: [0.1, 0.6]}}\n"
        "costs: {configuration: {}, velocity: {}, terminal_configuration: {}, terminal_velocity: {}, slipping: {}, "
        "control: {leg_force: 1}}\n",
        encoding="utf-8",
    )
    plan = attempt(load_task(tmp_path / "task.yaml", ["method.grid=uniform"]))
    assert replays(plan)
    (hit,) = plan.impulses
    assert hit.time == pytest.approx(0.20192751093846089, abs=1e-9)
    assert hit.normal == pytest.approx((1 + e) * 0.18158331421141096, abs=1e-9)
    np.testing.assert_allclose(plan.controls["leg_force"], 0.0, atol=1e-7)


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_a_mass_in_space_bounces_askew_to_its_target(tmp_path: Path, friction: float) -> None:
    """Driven along x and y, it bounces as often and as hard as by itself; with friction it has no sliding velocity
    at a bounce, or slides through it. The plan is exact and replays."""
    e, drop = 0.7, 0.5
    task = written(
        tmp_path,
        MASS_IN_SPACE,
        "robot: {model: model.urdf, root: fixed}\n"
        f"ground: {{type: plane, friction: {friction}, restitution: {e}}}\n"
        "contacts: {foot: {frame: mass}}\n"
        "horizon: {duration: 0.8, intervals: 5}\n"
        "solver: {effort: quick}\n"
        f"initial: {{configuration: {{x: 0, y: 0, z: {drop}}}}}\n"
        "goal: {configuration: {x: 0.5, y: 0.3}, velocity: {x: 0, y: 0}}\n",
    )
    plan = attempt(load_task(task, ["method.grid=uniform"]))
    assert replays(plan)
    first = np.sqrt(2 * drop / GRAVITY)
    np.testing.assert_allclose([one.time for one in plan.impulses], [first, first * (1 + 2 * e)], atol=1e-8)
    wanted = (1 + e) * GRAVITY * first * np.array([1, e])
    np.testing.assert_allclose([one.normal for one in plan.impulses], wanted, atol=1e-6)
    assert plan.outcome is not None and all(entry.missed_by <= 0.0101 for entry in plan.outcome.goal)
