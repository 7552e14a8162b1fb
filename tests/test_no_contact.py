"""A task without contacts, a pendulum: planned, checked, simulated, audited, drawn, explained, exported."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fesd_robot import Plan, explain, export_plan, load_task, plan, read_plan, render_plan, report, simulate, write_plan
from fesd_robot.errors import TaskError
from fesd_robot.render import write_page
from fesd_robot.task import Task

LENGTH, INERTIA, GRAVITY = 0.5, 1e-3 + 1 * 0.5**2, 9.81

PENDULUM = f"""<robot name="pendulum"><link name="base"/>
<link name="rod"><inertial><origin xyz="0 0 -{LENGTH}"/><mass value="1"/>
<inertia ixx="1e-3" ixy="0" ixz="0" iyy="1e-3" iyz="0" izz="1e-3"/></inertial></link><link name="tip"/>
<joint name="pivot" type="revolute"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>
<limit lower="-10" upper="10" velocity="20" effort="2"/></joint>
<joint name="tip" type="fixed"><parent link="rod"/><child link="tip"/><origin xyz="0 0 -{LENGTH}"/></joint></robot>"""

SWING_UP = """
name: swing_up
robot: {model: pendulum.urdf}
contacts: {}
horizon: {duration: 3, intervals: 30}
initial: {configuration: {pivot: 0}}
goal: {configuration: {pivot: 3.141592653589793}}
output: {page: false, figures: false}
"""

ARM_IN_SPACE = PENDULUM.replace('<axis xyz="0 1 0"/>', '<axis xyz="0 0.6 0.8"/>')


def task(folder: Path, overrides: list[str] | None = None, *, text: str = SWING_UP, model: str = PENDULUM) -> Task:
    (folder / "pendulum.urdf").write_text(model, encoding="utf-8")
    (folder / "swing_up.yaml").write_text(text, encoding="utf-8")
    return load_task(folder / "swing_up.yaml", overrides or [])


@pytest.fixture(scope="module")
def swing_up(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    return plan(task(tmp_path_factory.mktemp("swing_up")))


def driven(plan: Plan, time: np.ndarray) -> np.ndarray:
    """Integrate I q'' = u - m g l sin(q) with the controls of a plan, interval by interval; return (q, v) at times."""
    starts, u = plan.controls["time"], plan.controls["pivot"]
    ends = np.append(starts[1:], plan.trajectory.time[-1])
    x = np.array([plan.trajectory.configuration["pivot"][0], plan.trajectory.velocity["pivot"][0]])
    found = np.empty((len(time), 2))
    for begin, end, torque in zip(starts, ends, u, strict=True):
        own = (time >= begin - 1e-12) & (time <= end + 1e-12)
        result = solve_ivp(
            lambda _, y, torque=torque: [y[1], (torque - GRAVITY * LENGTH * np.sin(y[0])) / INERTIA],
            (begin, end), x, method="DOP853", rtol=1e-12, atol=1e-13, dense_output=True,
        )  # fmt: skip
        found[own] = result.sol(np.clip(time[own], begin, end)).T
        x = result.y[:, -1]
    return found


def test_a_pendulum_swings_up(swing_up: Plan) -> None:
    """2 N m of the 4.9 that would hold it level swing it up: solved, audited, in one sequence, with no pair."""
    assert swing_up.status.solved and not swing_up.audit.violations and swing_up.audit.min_gap is None
    assert swing_up.statistics.pairs == 0 and not swing_up.contacts and not swing_up.switches
    assert swing_up.statistics.search is not None
    assert {one.sequence for one in swing_up.statistics.search.sequences or []} == {""}
    pivot, torque = swing_up.trajectory.configuration["pivot"], swing_up.controls["pivot"]
    assert abs(pivot[-1] - np.pi) <= 0.01 + 1e-9 and pivot.min() < -0.5  # it swings back first
    assert np.abs(torque).max() <= 2 + 1e-8


def test_the_plan_is_the_motion_of_its_controls(swing_up: Plan) -> None:
    """An integration by other means, with the plan's controls, ends where the plan does: up to its accuracy, 1e-3."""
    time = swing_up.trajectory.time
    q, v = driven(swing_up, time).T
    np.testing.assert_allclose(swing_up.trajectory.configuration["pivot"], q, atol=2e-3)
    np.testing.assert_allclose(swing_up.trajectory.velocity["pivot"], v, atol=1e-2)


def test_a_simulation_is_an_independent_integration(swing_up: Plan, tmp_path: Path) -> None:
    """Under the plan's controls, and let go from 1 rad, up to 1e-8."""
    for result in (
        simulate(swing_up),
        simulate(task(tmp_path, ["initial.configuration.pivot=1", "initial.velocity.pivot=0.5"])),
    ):
        time = result.trajectory.time
        q, v = driven(result, time).T
        np.testing.assert_allclose(result.trajectory.configuration["pivot"], q, atol=1e-8)
        np.testing.assert_allclose(result.trajectory.velocity["pivot"], v, atol=1e-7)


@pytest.mark.parametrize("form", ["method.contact=impulses", "method.formulation.type=steps"])
def test_every_form_of_contact_is_the_same_without(tmp_path: Path, swing_up: Plan, form: str) -> None:
    """What contacts would be made of changes nothing where there are none."""
    other = plan(task(tmp_path, [form]))
    assert other.status.solved and other.statistics.objective == pytest.approx(swing_up.statistics.objective, rel=1e-6)


def test_dry_friction_remains(tmp_path: Path) -> None:
    """A joint that sticks and slides needs pairs of its own, without a contact."""
    found = plan(task(tmp_path, ["robot.dry_friction.pivot=0.05", "goal.configuration.pivot=0.3"]))
    assert found.status.solved and found.statistics.pairs > 0 and found.joint_friction


def test_files_page_and_exports_are_written(swing_up: Plan, tmp_path: Path) -> None:
    """A plan without contacts is read again as it is, and every format holds it, at its samples and at a rate."""
    folder = tmp_path / "run"
    write_plan(swing_up, folder)
    render_plan(swing_up, folder, overrides=["output.figures=true"])
    again = read_plan(folder)
    assert again.statistics.objective == swing_up.statistics.objective and (folder / "plan.html").is_file()
    assert len(list((folder / "figures").iterdir())) > 3
    assert "has no contacts" in report(again) and "## Contact\n" not in report(again)
    for kind in ("csv", "npz", "json", "joint-trajectory", "drake", "pinocchio"):
        for rate in (None, 100.0):
            assert export_plan(again, tmp_path / kind, kind, rate=rate).stat().st_size > 0
    with np.load(folder / "trajectory.npz") as arrays:
        assert arrays["gap"].shape == arrays["mode"].shape == (len(again.trajectory.time), 0)


def test_check_says_that_nothing_touches(tmp_path: Path) -> None:
    """`check` has neither ground nor impacts in it."""
    text = explain(task(tmp_path))
    assert "Contacts    None: nothing touches the robot." in text and "0 complementarity pairs (0 contacts)" in text
    assert "\nGround" not in text and "3 s in 30 intervals, equally long." in text


def test_a_page_shows_an_arm_in_space_from_anywhere(tmp_path: Path) -> None:
    """Without contacts the motion itself says whether it is seen from the side."""
    for model, planar in ((PENDULUM, "true"), (ARM_IN_SPACE, "false")):
        own = task(tmp_path, ["initial.configuration.pivot=1", "horizon.duration=0.3"], model=model)
        page = write_page(simulate(own), own, tmp_path / "page.html").read_text(encoding="utf-8")
        assert f'"planar":{planar}' in page


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (SWING_UP.replace("contacts: {}\n", ""), "contacts: this key is missing"),
        (SWING_UP.replace("contacts: {}\n", ""), "{} for a motion without contact"),
        (SWING_UP + "reference: {type: jumps, count: 1, apex: {pivot: 1}}\n", "found jumps in a task without contacts"),
        (SWING_UP.replace("{pivot: 0}}", "{pivot: 0}, stand_on: [foot]}"), "found 'foot', expected a contact"),
    ],
)
def test_what_needs_contacts_is_refused(tmp_path: Path, text: str, words: str) -> None:
    """A key that was forgotten is no motion without contact, and nothing jumps or stands without any."""
    with pytest.raises(TaskError) as caught:
        explain(task(tmp_path, text=text))
    assert words in str(caught.value)
