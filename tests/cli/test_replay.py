"""`fesd-robot replay`: its files, its words, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import mujoco
import pytest
from typer.testing import CliRunner

from fesd_robot import plan as plan_task
from fesd_robot.cli.app import app
from fesd_robot.plans import Plan, read_plan, write_plan
from fesd_robot.task import load_task

TASKS = Path(__file__).parents[2] / "tasks"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the hopper's jump."""
    found = plan_task(load_task(TASKS / "hopper_one_jump.yaml", ["solver.effort=quick", "output.page=false"]))
    return write_plan(found, tmp_path_factory.mktemp("runs") / "jump")


def invoked(*arguments: object) -> tuple[int, str, str]:
    """Return exit status, stdout and stderr of the program."""
    result = CliRunner().invoke(app, [str(each) for each in arguments])
    return result.exit_code, result.stdout, result.stderr


def test_the_own_integrator_goes_beside_mujoco(folder: Path, tmp_path: Path) -> None:
    """From event to event the controls alone lead where the plan does: 0.1 mm and landings to 1 us."""
    status, out, _ = invoked("replay", folder, "--controller", "event-driven", "--out", tmp_path)
    (entry,) = json.loads((tmp_path / "replay.json").read_text())
    assert status == 0 and "event-driven: finished" in out
    assert entry["base_end"] is None or entry["base_end"] <= 1e-4
    assert max(abs(each) for each in entry["touchdown_errors"]) <= 1e-6


def changed(folder: Path, target: Path, **update: object) -> Path:
    """Write a plan with other fields, and return its folder."""
    plan: Plan = read_plan(folder)
    target.mkdir()
    (target / "plan.json").write_text(plan.model_copy(update=update).model_dump_json(), encoding="utf-8")
    return target


def test_files_of_a_replay(folder: Path) -> None:
    """Every controller has its numbers in replay.json, a row in the report, and a page; MuJoCo reads the scene."""
    status, out, err = invoked("replay", folder)
    assert status == 0, err
    written = folder / "replay"
    names = ["errors.png", "replay.json", "replay.md", "replay_lqr.html", "replay_open-loop.html", "replay_pd.html",
             "scene.xml"]  # fmt: skip
    assert sorted(each.name for each in written.iterdir()) == names
    entries = json.loads((written / "replay.json").read_text(encoding="utf-8"))
    assert [each["controller"] for each in entries] == ["open-loop", "pd", "lqr"]
    for each in entries:
        assert each["finished"] is True
        assert 0 < each["base_rms"] < 5e-3
        assert len(each["touchdown_errors"]) == len(each["touchdowns"]) > 0
        assert {"base_end", "joint_rms", "slide_rms", "slip", "effort", "saturated", "bodies", "perturbed"} <= set(each)
        assert f"| {each['controller']} | yes |" in (written / "replay.md").read_text(encoding="utf-8")
        assert f"{each['controller']}: finished, bodies " in out
    assert mujoco.MjModel.from_xml_path(str(written / "scene.xml")).nu == 2


def test_one_controller_perturbed(folder: Path, tmp_path: Path) -> None:
    """Twenty runs differ from the plan; how many finish is told and written, and it is the same again."""
    target = tmp_path / "perturbed"
    status, out, _ = invoked("replay", folder, "--controller", "pd", "--perturb", "--out", target)
    (entry,) = json.loads((target / "replay.json").read_text(encoding="utf-8"))
    assert len(entry["perturbed"]["runs"]) == 20
    count = sum(each["finished"] for each in entry["perturbed"]["runs"])
    assert entry["perturbed"]["finished"] == count
    assert f"{count} of 20 perturbed runs finished" in out
    assert f"**{count} of 20**" in (target / "replay.md").read_text(encoding="utf-8")
    assert status == 0


def test_a_closed_loop(folder: Path, tmp_path: Path) -> None:
    """`--closed-loop` is the controller that plans again; pushes, masses and friction reach all controllers."""
    given = ("--push", "0.05:0.05,0", "--push", "0.3:0,0.01,0", "--mass", "1.02", "--friction", "0.9")
    status, _, err = invoked("replay", folder, "--closed-loop", *given, "--out", tmp_path)
    assert status == 2 and "push: found 0.01 m/s along y" in err
    options = ("--controller", "open-loop", "--closed-loop", "--controller", "replan", *given[:2], *given[4:])
    _, out, _ = invoked("replay", folder, *options, "--period", "0.02", "--real-time", "--out", tmp_path)
    entries = json.loads((tmp_path / "replay.json").read_text(encoding="utf-8"))
    assert [each["controller"] for each in entries] == ["open-loop", "replan"]
    for each in entries:
        assert (each["mass"], each["friction"], each["pushes"][0]["velocity"]) == (1.02, 0.9, [0.05, 0.0, 0.0])
    told = entries[1]["replanning"]
    assert told["period"] == 0.02 and told["real_time"] and told["updates"] <= 50
    assert "updates kept the sequence, feedback " in out
    assert "masses +2 %; friction -10 %; pushed by 0.05 m/s" in (tmp_path / "replay.md").read_text(encoding="utf-8")


def test_no_display(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a display, and for a video of another kind, one sentence says so; the rest is written."""
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    common = ("replay", folder, "--controller", "open-loop", "--quiet", "--out", tmp_path / "out")
    status, out, err = invoked(*common, "--viewer")
    assert (status, out) == (0, "")
    assert err == "no viewer is opened: there is no display (neither DISPLAY nor WAYLAND_DISPLAY is set)\n"
    status, _, err = invoked(*common, "--video", tmp_path / "jump.avi")
    assert status == 0
    assert err == f"{tmp_path / 'jump.avi'}: found the ending '.avi', expected .gif or .webp\n"


def test_an_unsolved_plan(folder: Path, tmp_path: Path) -> None:
    """It is refused unless it is forced, then in open loop."""
    status = read_plan(folder).status.model_copy(update={"solved": False})
    unsolved = changed(folder, tmp_path / "unsolved", status=status)
    code, _, err = invoked("replay", unsolved)
    assert code == 2
    assert err.strip().splitlines()[-1] == (
        "error: hopper_one_jump: found a plan that is not solved, expected one that is; --force replays it all the same"
    )
    code, out, _ = invoked("replay", unsolved, "--force")
    assert code == 0
    assert out.startswith("pd is left out: ")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["--controller", "lqg"],
            "found controller 'lqg', expected one of open-loop, pd, lqr, replan, event-driven (did you mean 'lqr'?)",
        ),
        (["--out", "{file}"], "{file}: cannot be written to (File exists)"),
        (
            ["--push", "0.3"],
            "--push: found '0.3', expected TIME:VX,VZ or TIME:VX,VY,VZ in s and m/s, as 0.3:0.2,0",
        ),
        (
            ["--push", "0.3s:0.2,0"],
            "--push: found '0.3s' in '0.3s:0.2,0', expected a number without unit, in SI units and radians: TIME:VX,VZ "
            "or TIME:VX,VY,VZ in s and m/s, as 0.3:0.2,0",
        ),
        (["--push", "2:0.2,0"], "push: found one at 2 s, expected a time before the run ends, 1 s"),
        (["--friction", "-1"], "friction: found the factor -1, expected a number greater than 0"),
        (
            ["--closed-loop", "--goal", "root_x=1.1"],
            "--goal: found 'root_x=1.1', expected TIME:NAME=VALUE in s and m or rad, as 0.3:root_x=1.1",
        ),
        (
            ["--closed-loop", "--goal", "0.3:left_hip=1.1"],
            "goal: found 'left_hip', expected a configuration coordinate of the task's goal (valid: leg, root_pitch, "
            "root_x, root_z)",
        ),
        (
            ["--controller", "lqr", "--real-time"],
            "found a period, real time or a goal for lqr, expected replan among the controllers",
        ),
        (
            ["--controller", "event-driven", "--mass", "1.1"],
            "found event-driven with something different from the plan, expected a run in MuJoCo",
        ),
    ],
)
def test_bad_input(folder: Path, tmp_path: Path, arguments: list[str], message: str) -> None:
    """One sentence for a controller that there is not, a folder that is a file, and what cannot be different."""
    file = tmp_path / "file"
    file.write_text("", encoding="utf-8")
    code, _, err = invoked("replay", folder, "--quiet", *(each.format(file=file) for each in arguments))
    assert code == 2
    assert err == f"error: {message.format(file=file)}\n"


def test_without_its_model(folder: Path, tmp_path: Path) -> None:
    """A plan whose model is gone says which file is missing."""
    task = read_plan(folder).task
    task = {**task, "robot": {**task["robot"], "model": "gone.urdf"}}
    code, _, err = invoked("replay", changed(folder, tmp_path / "gone", task=task), "--quiet")
    assert code == 2
    assert "gone.urdf" in err
    assert len(err.strip().splitlines()) == 1


def test_export_of_the_scene(folder: Path, tmp_path: Path) -> None:
    """`export --format mujoco` writes the scene of any robot into a file .xml, with what one sees of it."""
    file = tmp_path / "scene.xml"
    code, out, err = invoked("export", folder, "--format", "mujoco", "--out", file)
    assert code == 0, err
    assert out == f"written to {file}\n"
    model = mujoco.MjModel.from_xml_path(str(file))
    assert (model.nq, model.nv, model.nu, model.npair) == (4, 4, 2, 1)
    assert model.ngeom > 2
