"""Simulated robots: closed forms, planned motions, and controls from everywhere they may come from."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from fesd_robot import (
    FesdRobotError,
    OptionError,
    Plan,
    Task,
    explain,
    load_task,
    read_plan,
    render_plan,
    simulate,
    write_plan,
)
from fesd_robot.errors import MotionFileError, TaskError

TASKS = Path(__file__).parents[2] / "tasks"
POINT = """<robot name="point"><link name="world"/><link name="rail"/><link name="ball">
<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="x" type="prismatic"><parent link="world"/><child link="rail"/><axis xyz="1 0 0"/>
<limit lower="-100" upper="100" effort="50" velocity="100"/></joint>
<joint name="z" type="prismatic"><parent link="rail"/><child link="ball"/><axis xyz="0 0 1"/>
<limit lower="-100" upper="100" effort="0" velocity="100"/></joint></robot>
"""
GRAVITY = 9.81


@pytest.fixture(scope="module")
def thrown(tmp_path_factory: pytest.TempPathFactory) -> Task:
    """A mass that is thrown onto a floor with friction, driven along it."""
    folder = tmp_path_factory.mktemp("thrown")
    (folder / "point.urdf").write_text(POINT)
    (folder / "thrown.yaml").write_text(
        "name: thrown\n"
        "robot: {model: point.urdf, root: fixed}\n"
        "ground: {type: plane, friction: 0.3}\n"
        "contacts: {ball: {frame: ball}}\n"
        "horizon: {duration: 2, intervals: 4}\n"
        "initial: {configuration: {x: 0, z: 0.5}, velocity: {x: 3, z: 1}}\n"
        "goal: {configuration: {x: 1, z: 0}}\n"
    )
    return load_task(folder / "thrown.yaml")


def test_a_thrown_mass_lands_slides_and_stops_where_mechanics_says(thrown: Task) -> None:
    """Touchdown, impulses of friction 0.3, deceleration by 0.3 g, and rest, each to 1e-9."""
    motion = simulate(thrown)
    landing = (1 + np.sqrt(1 + 2 * GRAVITY * 0.5)) / GRAVITY
    down = GRAVITY * landing - 1
    speed = 3 - 0.3 * down
    stop = landing + speed / (0.3 * GRAVITY)
    assert [(switch.kind, pytest.approx(switch.time, abs=1e-9)) for switch in motion.switches] == [
        ("touchdown", landing),
        ("slip_to_stick", stop),
    ]
    (impulse,) = motion.impulses
    assert impulse.normal == pytest.approx(2 * down, abs=1e-9)
    assert impulse.tangential == pytest.approx(-0.3 * 2 * down, abs=1e-9)
    end = motion.trajectory.configuration
    assert end["x"][-1] == pytest.approx(3 * landing + speed**2 / (2 * 0.3 * GRAVITY), abs=1e-9)
    assert motion.status.solved and motion.simulation is not None and not motion.simulation.notes
    assert motion.audit.max_impact_law_error <= 1e-9 and motion.audit.max_energy_error <= 1e-9


def test_controls_hold_from_their_times_on(thrown: Task, tmp_path: Path) -> None:
    """A table, values on equal intervals, and a plan with the same controls lead to the same motion."""
    (tmp_path / "push.csv").write_text("time [s],x [N]\n0,0\n0.5,20\n1.5,0\n")
    table = simulate(thrown, tmp_path / "push.csv")
    values = simulate(thrown, {"x": [0, 20, 20, 0]})
    again = simulate(thrown, table)
    for other in (values, again, simulate(table)):
        for name in ("x", "z"):
            ours, theirs = table.trajectory.configuration[name][-1], other.trajectory.configuration[name][-1]
            assert ours == pytest.approx(theirs, abs=1e-9)
    assert table.trajectory.configuration["x"][-1] > simulate(thrown).trajectory.configuration["x"][-1] + 1
    assert table.trajectory.time[-1] == 2 and simulate(thrown, duration=0.1).trajectory.time[-1] == 0.1


@pytest.mark.parametrize(
    ("name", "override"),
    [
        ("double_pendulum_wall", "name=fallen"),
        ("hopper_one_jump", "initial.velocity={root_x: 1, root_z: 2}"),
    ],
)
def test_no_impact_makes_energy_and_nothing_sinks(name: str, override: str) -> None:
    """Left alone, a robot that falls against its surroundings obeys the impact law to 1e-9, and loses energy only."""
    motion = simulate(load_task(TASKS / f"{name}.yaml", [override]), duration=1.0)
    assert motion.simulation is not None and motion.simulation.impacts > 0
    assert motion.audit.max_impact_law_error <= 1e-9
    assert motion.audit.min_gap >= -1e-9 and motion.audit.max_energy_error <= 1e-8
    assert motion.audit.max_friction_cone_violation <= 1e-8


ROD = """<robot name="rod"><link name="rod"><inertial><mass value="1"/>
<inertia ixx="0.0833333333333333" iyy="0.0833333333333333" izz="0.0833333333333333" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><box size="1 0.02 0.02"/></geometry></visual></link>
<link name="left"/><joint name="to_left" type="fixed"><parent link="rod"/><child link="left"/><origin xyz="-0.5 0 0"/>
</joint><link name="right"/><joint name="to_right" type="fixed"><parent link="rod"/><child link="right"/>
<origin xyz="0.5 0 0"/></joint></robot>
"""


def test_a_rod_that_is_let_go_needs_no_controls(tmp_path: Path) -> None:
    """Its first impact is that of the closed form without friction, it comes to rest on both ends, and all is drawn."""
    (tmp_path / "rod.urdf").write_text(ROD)
    (tmp_path / "rod.yaml").write_text(
        "name: rod\n"
        "robot: {model: rod.urdf, root: sagittal}\n"
        "ground: {type: plane, friction: 0}\n"
        "contacts: {left: {frame: left}, right: {frame: right}}\n"
        "horizon: {duration: 1.5, intervals: 1}\n"
        "initial: {configuration: {root_x: 0, root_z: 1, root_pitch: 0.5}}\n"
        "goal: {configuration: {root_x: 0}}\n"
    )
    task = load_task(tmp_path / "rod.yaml")
    motion = simulate(task)
    first = motion.impulses[0]
    lever = 0.5 * np.cos(0.5)
    fallen = np.sqrt(2 * GRAVITY * (1 - 0.5 * np.sin(0.5)))
    assert first.contact == "right" and first.normal == pytest.approx(fallen / (1 + 12 * lever**2), abs=1e-9)
    end = {name: values[-1] for name, values in motion.trajectory.configuration.items()}
    assert end == pytest.approx({"root_x": 0, "root_z": 0, "root_pitch": 0}, abs=1e-8)
    folder = write_plan(motion, tmp_path / "run")
    assert "The task has no controls." in (folder / "report.md").read_text()
    assert {path.name for path in render_plan(motion, folder)} >= {"plan.html", "energy.png"}
    with pytest.raises(TaskError, match="found no actuators"):
        explain(task)


def test_a_plan_is_driven_to_where_it_ends(short_plan: Plan, tmp_path: Path) -> None:
    """The controls of a plan lead to its end, to a thousandth of its goal's tolerance, and can be written as one."""
    motion = simulate(short_plan)
    for name, values in short_plan.trajectory.configuration.items():
        assert motion.trajectory.configuration[name][-1] == pytest.approx(values[-1], abs=1e-5)
    folder = write_plan(motion, tmp_path / "simulated")
    assert read_plan(folder).simulation == motion.simulation
    assert "Simulated" in (folder / "report.md").read_text()


def test_two_feet_that_land_at_once_come_to_rest() -> None:
    """Feet that make each other rise in ever smaller hops stand in the end, instead of hopping without one."""
    motion = simulate(load_task(TASKS / "biped_step.yaml", ["initial.configuration={root_z: 0.85}"]), duration=0.5)
    assert motion.simulation is not None and 0 < motion.simulation.impacts < 50


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        ("time,y\n0,1\n", "found no column 'x'"),
        ("x\n1\n", "found no column 'time'"),
        ("time,x\n0,1\n0,2\n", "found time 0 in row 2, expected times that begin at 0 and increase"),
        ("time,x\n0.5,1\n", "found time 0.5 in row 1, expected times that begin at 0"),
        ("time,x\n0,much\n", "values that are not finite"),
        ("time,x\n", "found no rows"),
    ],
)
def test_a_bad_table_is_one_sentence(thrown: Task, tmp_path: Path, table: str, sentence: str) -> None:
    """It names the file, what was found, and what would be valid."""
    (tmp_path / "push.csv").write_text(table)
    with pytest.raises(MotionFileError) as error:
        simulate(thrown, tmp_path / "push.csv")
    assert sentence in str(error.value) and "push.csv" in str(error.value) and "\n" not in str(error.value)


def test_bad_arguments_are_one_sentence(thrown: Task, tmp_path: Path) -> None:
    """A missing file, an unknown control, a duration that is none, and what is no task."""
    for controls, sentence in (
        (tmp_path / "none.csv", "found no such file"),
        ({"y": 1.0}, "found control 'y'"),
        ({"x": [1.0, np.nan]}, "not finite"),
    ):
        with pytest.raises(MotionFileError, match=sentence):
            simulate(thrown, controls)
    with pytest.raises(MotionFileError, match="found a duration of -1 s"):
        simulate(thrown, duration=-1)
    with pytest.raises(OptionError, match="simulate: what: found the text"):
        simulate("task.yaml")  # type: ignore[call-overload]


def test_a_free_duration_has_to_be_chosen() -> None:
    """A task that leaves its duration open cannot be simulated without one."""
    task = load_task(TASKS / "hopper_one_jump.yaml", ["horizon.duration={lower: 0.8, upper: 1.2}"])
    with pytest.raises(TaskError, match="expected one number for a simulation"):
        simulate(task)
    assert simulate(task, duration=0.1).trajectory.time[-1] == 0.1


def test_the_example_of_the_page(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """The documentation's example runs: the pendulum meets the wall with its tip first."""
    monkeypatch.chdir(TASKS.parent)
    page = (TASKS.parent / "docs" / "simulating-robots.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    names: dict[str, object] = {}
    exec(compile(code, "simulating-robots.md", "exec"), names)
    motion = names["motion"]
    assert isinstance(motion, Plan) and (motion.switches[0].contact, motion.switches[0].kind) == ("tip", "touchdown")
    assert capsys.readouterr().out.startswith("Simulated with given controls")


def test_errors_have_one_base() -> None:
    """All of them can be caught together."""
    assert issubclass(MotionFileError, FesdRobotError)


TWO_BALLS = """<mujoco><compiler autolimits="true"/><worldbody>
<body name="lower"><joint name="lower_z" type="slide" axis="0 0 1" range="0 9"/>
<inertial mass="1" pos="0 0 0" diaginertia="1 1 1"/>
<body name="upper"><joint name="apart" type="slide" axis="0 0 1" range="0 9" stiffness="1e4" springref="1"/>
<inertial mass="1" pos="0 0 0" diaginertia="1 1 1"/></body></body></worldbody></mujoco>
"""


def test_two_balls_with_a_spring_bounce_twice(tmp_path: Path) -> None:
    """arXiv 2305.17003, section 5.1: e = 0.8, k = 1e4; times, impulses and the state after a second are the exact ones
    (a closed form by modes, to 40 digits), to 1e-9 of each: the accelerations are integrated to 1e-10."""
    (tmp_path / "balls.xml").write_text(TWO_BALLS)
    (tmp_path / "balls.yaml").write_text(
        "name: balls\n"
        "robot: {model: balls.xml, root: fixed}\n"
        "ground: {type: plane, friction: 0, restitution: 0.8}\n"
        "contacts: {lower: {type: circle, frame: lower, radius: 0.2}}\n"
        "horizon: {duration: 1, intervals: 2}\n"
        "initial: {configuration: {lower_z: 1, apart: 1}}\n"
        "goal: {configuration: {}, soft: true}\n"
    )
    motion = simulate(load_task(tmp_path / "balls.yaml"))
    assert [hit.time for hit in motion.impulses] == pytest.approx(
        [0.403855021876921781, 0.423316968814706678], abs=1e-9
    )
    assert [hit.normal for hit in motion.impulses] == pytest.approx([7.131271976302685, 6.994796108607126], abs=1e-8)
    ends = [part[name][-1] for part in (motion.trajectory.configuration, motion.trajectory.velocity) for name in part]
    lower, apart, speed, parting = ends
    exact = [0.24684188672883527, 1.2282103120085011, -2.3798395214664336, -3.1140923936237557]
    assert [lower, lower + apart] == pytest.approx(exact[:2], abs=1e-9)
    assert [speed, speed + parting] == pytest.approx(exact[2:], rel=1e-9)
    assert motion.audit.max_impact_law_error <= 1e-9
