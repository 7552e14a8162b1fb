"""`fesd-robot simulate`."""

from __future__ import annotations

from pathlib import Path

from typer.testing import CliRunner

from fesd_robot import Plan, read_plan, write_plan
from fesd_robot.cli.app import app

TASKS = Path(__file__).parents[2] / "tasks"


def test_a_plan_is_simulated_into_a_folder(short_plan: Plan, tmp_path: Path) -> None:
    """The folder has the files of a plan, and the summary says that nothing was planned."""
    folder = write_plan(short_plan, tmp_path / "plan")
    done = CliRunner().invoke(app, ["simulate", str(folder), "--out", str(tmp_path / "out"), "--duration", "0.1"])
    assert done.exit_code == 0, done.output
    assert "Simulated with given controls" in done.output and "0.1 s of motion" in done.output
    for name in ("plan.json", "plan.html", "trajectory.csv", "figures"):
        assert (tmp_path / "out" / name).exists(), name
    simulated = read_plan(tmp_path / "out")
    assert simulated.simulation is not None and simulated.trajectory.time[-1] == 0.1


def test_bad_input_is_one_sentence(tmp_path: Path) -> None:
    """A table without a control's column ends with exit status 2 and leaves nothing."""
    (tmp_path / "table.csv").write_text("time,shoulder\n0,1\n")
    task = str(TASKS / "double_pendulum_wall.yaml")
    arguments = ["simulate", task, "--controls", str(tmp_path / "table.csv"), "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 2
    assert "found no column 'elbow'" in done.output and not (tmp_path / "out").exists()
