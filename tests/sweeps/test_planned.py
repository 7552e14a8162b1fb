"""Sweeps of real plans: what processes and a cluster give is what `plan` gives."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fesd_robot import plan, read_plan, render_plan
from fesd_robot.planning.planner import continued
from fesd_robot.plans.checkout import checked_out_commit
from fesd_robot.sweeps import Order, SweepSettings, SweepTable, Verdict, load_sweep, swept, write_dataset
from fesd_robot.sweeps.order import Start
from fesd_robot.sweeps.planned import planned, work_of
from fesd_robot.sweeps.rows import as_overrides
from fesd_robot.sweeps.scales import with_scales
from fesd_robot.task import load_task
from tests.conftest import ONE_JUMP, SHORT

FIXED = {
    "horizon.duration": 0.2, "horizon.intervals": 2, "reference": {"type": "line"}, "costs.slipping": {},
    "solver.tolerance": 1e-6, "output.page": False,
}  # fmt: skip
VARY = {"goal.configuration.root_x": [0.11, 0.12, 0.13]}
SWEEP = {"task": str(ONE_JUMP), "set": FIXED, "vary": VARY}


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> SweepTable:
    """The short task with three goals, by processes."""
    out = tmp_path_factory.mktemp("planned") / "out"
    return swept(load_sweep(SWEEP), out, SweepSettings(jobs=1, keep="all"), planned)


def test_rows_are_plans(table: SweepTable) -> None:
    """A row has the cost, the end and the iterations of the plan of its task, alone in this process."""
    assert table.columns["verdict"] == ["solved"] * 3
    task = load_task(ONE_JUMP, [*SHORT, "goal.configuration.root_x=0.13"])
    alone = plan(task)
    row = list(table.rows())[2]
    assert row["cost"] == pytest.approx(alone.statistics.objective, rel=1e-9)
    assert row["end.root_x"] == pytest.approx(alone.trajectory.configuration["root_x"][-1], abs=1e-9)
    assert row["flights"] == sum(
        len(each.flights) for each in (alone.outcome.contacts.values() if alone.outcome else ())
    )
    assert row["memory"] > 50.0 and row["seconds"] > 0.0


def test_kept_plans_are_whole(table: SweepTable, tmp_path: Path) -> None:
    """A plan that is kept is read and drawn like any other, with the task's own files."""
    kept = read_plan(table.folder / table.columns["plan"][0])
    assert kept.task["goal"]["configuration"]["root_x"] == 0.11
    assert kept.provenance.folder == str(ONE_JUMP.parent)
    assert kept.provenance.git == checked_out_commit(ONE_JUMP.parent) != "none"
    assert render_plan(kept, tmp_path)[0].is_file()


def test_a_cluster_gives_the_same_costs(table: SweepTable, tmp_path: Path) -> None:
    """A Dask cluster of two workers gives the same rows, costs to 1e-9."""
    pytest.importorskip("distributed")
    settings = SweepSettings(jobs=2, scheduler="local", keep="none")
    other = swept(load_sweep(SWEEP), tmp_path / "out", settings, planned)
    assert other.columns["verdict"] == table.columns["verdict"]
    np.testing.assert_allclose(other.columns["cost"], table.columns["cost"], rtol=1e-9)
    assert other.columns["iterations"] == table.columns["iterations"]


def test_neighbours_need_fewer_iterations(table: SweepTable, tmp_path: Path) -> None:
    """Rows that begin from the nearest solved one are solved, cost no more here, and take less."""
    warm = swept(load_sweep({**SWEEP, "warm": "nearest"}), tmp_path / "out", SweepSettings(jobs=1), planned)
    assert warm.columns["verdict"] == ["solved"] * 3
    begun = [number for number in range(3) if warm.columns["start"][number] is not None]
    assert begun == [0, 2]
    for number in begun:
        assert warm.columns["cost"][number] <= table.columns["cost"][number] * (1 + 1e-6)
        assert warm.columns["iterations"][number] < table.columns["iterations"][number]
    assert "begin from the solved plan of the nearest row" in (tmp_path / "out" / "sweep.html").read_text()


def test_a_plan_that_leads_nowhere_is_abandoned(table: SweepTable) -> None:
    """From the plan of another robot there is no motion: the task alone has one, and the answer names the other row."""
    other = (Path(__file__).parents[1] / "render" / "plans" / "block_push.json").read_bytes()
    overrides = as_overrides({**FIXED, "goal.configuration.root_x": 0.12})
    answer = planned(Order(1, overrides, start=Start(7, other, "elsewhere")), ONE_JUMP)
    assert answer.verdict is Verdict.SOLVED
    assert (answer.values["abandoned"], answer.values["abandoned_iterations"]) == (7, 0)
    assert answer.values["cost"] == pytest.approx(table.columns["cost"][1], rel=1e-9)
    assert answer.values["iterations"] == table.columns["iterations"][1]


def test_both_plans_count(table: SweepTable, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the motion from another row is not solved, iterations are those of both."""

    def in_vain(*arguments: Any, **named: Any) -> None:
        assert continued(*arguments, **named) is not None

    monkeypatch.setattr("fesd_robot.sweeps.planned.continued", in_vain)
    near = (table.folder / table.columns["plan"][0] / "plan.json").read_bytes()
    overrides = as_overrides({**FIXED, "goal.configuration.root_x": 0.12})
    values = planned(Order(1, overrides, start=Start(0, near, "elsewhere")), ONE_JUMP).values
    assert values["abandoned"] == 0 and values["abandoned_iterations"] > 0
    assert values["iterations"] == values["abandoned_iterations"] + table.columns["iterations"][1]


def test_the_task_s_own_time_limit_holds() -> None:
    """`solver.time_limit` of a sweep's task ends a plan where the sweep itself has no limit."""
    overrides = as_overrides({**FIXED, "solver.time_limit": 0.02})
    assert planned(Order(0, overrides), ONE_JUMP).verdict is Verdict.NOT_SOLVED


def test_a_time_limit_is_a_row(tmp_path: Path) -> None:
    """A plan that has no time returns what it has, not solved, or is ended."""
    out = tmp_path / "out"
    limited = swept(load_sweep(SWEEP), out, SweepSettings(jobs=1, timeout=0.05, keep="none"), planned)
    assert not set(limited.columns["verdict"]) & {"solved", "crashed", "error"}


def test_scales_are_keys_of_the_task() -> None:
    """Factors multiply what the task or the model says: efforts, friction, masses, one after the other."""
    hopper = ONE_JUMP.parent / "hopper_one_jump.yaml"
    keys = dict(
        one.split("=", 1) for one in with_scales(hopper, ["model.effort=0.5", "model.friction=2", "model.mass=3"])
    )
    assert json.loads(keys["robot.actuators.leg_force.upper"]) == 50.0
    assert json.loads(keys["robot.actuators.reaction_torque.lower"]) == -25.0
    assert json.loads(keys["ground.friction"]) == 0.9
    assert json.loads(keys["robot.scale.mass"]) == 3.0
    solo = ONE_JUMP.parent / "double_pendulum_wall.yaml"
    task = load_task(solo)
    scaled = load_task(solo, with_scales(solo, ["model.mass=2", "model.length=1.5"]))
    assert (scaled.robot.scale.mass, scaled.robot.scale.length) == (2.0, 1.5)
    assert task.robot.scale.mass == 1.0


def test_a_data_set_is_of_the_plans(table: SweepTable) -> None:
    """Samples are at equal times, episode after episode, and are the states and controls of the plans there."""
    parquet = pytest.importorskip("pyarrow.parquet")
    folder = write_dataset(table, 50.0)
    samples = parquet.read_table(folder / "data" / "chunk-000" / "episodes.parquet").to_pylist()
    info = json.loads((folder / "meta" / "info.json").read_text())
    assert (info["total_episodes"], info["total_frames"]) == (3, len(samples)) == (3, 33)
    assert [sample["index"] for sample in samples] == list(range(33))
    kept = read_plan(table.folder / table.columns["plan"][1])
    own = [sample for sample in samples if sample["episode_index"] == 1]
    np.testing.assert_allclose([sample["timestamp"] for sample in own], 0.02 * np.arange(11), atol=1e-6)
    names = info["features"]["observation.state"]["names"]
    x = names.index("root_x")
    at = [kept.at(min(0.02 * frame, kept.trajectory.time[-1])).configuration["root_x"] for frame in range(11)]
    np.testing.assert_allclose([sample["observation.state"][x] for sample in own], at, rtol=1e-6)
    assert [sample["next.done"] for sample in own] == [False] * 10 + [True]
    assert len(own[0]["action"]) == len(info["features"]["action"]["names"]) == 2


def test_work_is_the_integral_of_power() -> None:
    """Constant controls and speeds of both signs: sizes of powers are added up, whatever their sign."""
    made = read_plan(Path(__file__).parents[1] / "render" / "plans" / "hopper_one_jump.json")
    time = made.trajectory.time
    speeds = {name: np.full_like(time, 2.0 if name == "leg" else -0.5) for name in made.trajectory.velocity}
    controls = {
        name: values if name == "time" else np.full_like(values, {"leg_force": -3.0}.get(name, 4.0))
        for name, values in made.controls.items()
    }
    trajectory = made.trajectory.model_copy(update={"velocity": speeds})
    found = work_of(made.model_copy(update={"trajectory": trajectory, "controls": controls}))
    assert found == pytest.approx((3.0 * 2.0 + 4.0 * 0.5) * time[-1])
