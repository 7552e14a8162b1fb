"""A folder of results: what is the user's stays, and a plan is there whatever ends a run."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fesd_robot.plans import Plan, PlanFileError, check_output_folder, export, read_plan, write_or_keep, write_plan
from fesd_robot.plans.results_folder import DERIVED, FIGURES, is_plan_of_ours
from fesd_robot.writing import COMPLETE

OWN = {"plan.json", "trajectory.csv", "trajectory.npz", "report.md"}
FOREIGN = {"notes.txt": b"mine", "figures/photo.png": b"a photograph", "videos/deep/jump.mp4": b"mine too"}


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def contents(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def add_foreign(folder: Path) -> None:
    for name, content in FOREIGN.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)


def drawn(*figures: str) -> Callable[[Path], None]:
    """What draws a page and these figures."""

    def draw(stage: Path) -> None:
        (stage / "plan.html").write_text("page")
        (stage / "figures").mkdir()
        for name in figures:
            (stage / "figures" / name).write_text(name)

    return draw


def renamed(plan: Plan, name: str) -> Plan:
    """The plan of another motion: its table is another one, too."""
    moved = {name: values + 1.0 for name, values in plan.trajectory.velocity.items()}
    trajectory = plan.trajectory.model_copy(update={"velocity": moved})
    return plan.model_copy(update={"name": name, "trajectory": trajectory})


class Interruption(BaseException):
    """What Ctrl-C does."""


@pytest.mark.parametrize("error", [ValueError, Interruption, KeyboardInterrupt])
def test_an_interrupted_write_leaves_the_earlier_run(plan: Plan, tmp_path: Path, error: type[BaseException]) -> None:
    """If writing stops half way the earlier results stand as they were and nothing lies beside them."""
    folder = write_plan(plan, tmp_path / "run", drawn("positions.png"))
    add_foreign(folder)
    earlier = contents(folder)

    def fail(stage: Path) -> None:
        assert names(stage) == OWN
        (stage / "plan.html").write_text("half")
        raise error

    with pytest.raises(error):
        write_plan(renamed(plan, "other"), folder, fail)
    assert contents(folder) == earlier and names(tmp_path) == {"run"}


def test_an_interrupted_first_write_leaves_nothing(plan: Plan, tmp_path: Path) -> None:
    """If the first run stops half way there is no folder."""

    def fail(_: Path) -> None:
        raise Interruption

    with pytest.raises(Interruption):
        write_plan(plan, tmp_path / "deep" / "run", fail)
    assert names(tmp_path) == set()


def test_a_second_run_replaces_the_first(plan: Plan, tmp_path: Path) -> None:
    """Files of the earlier plan go, page, figures and exports included; files that are not a run's stay."""
    folder = write_plan(plan, tmp_path / "run", drawn("energy.png", "positions.png", "positions.svg", "motion.gif"))
    (folder / "trajectory.parquet").write_bytes(export(plan, "parquet"))
    add_foreign(folder)
    write_plan(renamed(plan, "second"), folder, drawn("positions.png"))
    assert read_plan(folder).name == "second"
    assert set(contents(folder)) == OWN | {"plan.html", "figures/positions.png", *FOREIGN}
    assert {name: contents(folder)[name] for name in FOREIGN} == FOREIGN and names(tmp_path) == {"run"}


def test_a_run_without_figures_removes_the_folder_of_figures(plan: Plan, tmp_path: Path) -> None:
    """Unless a file is in it that no run wrote."""
    folder = write_plan(plan, tmp_path / "run", drawn(*(f"{name}.pdf" for name in FIGURES)))
    assert names(write_plan(plan, folder)) == OWN
    write_plan(plan, folder, drawn("energy.png"))
    (folder / "figures" / "photo.png").write_text("mine")
    assert set(contents(write_plan(plan, folder))) == OWN | {"figures/photo.png"}


def test_all_figures_of_a_plan_are_known(short_plan: Plan) -> None:
    """A figure under a name that is not listed would never be removed."""
    from fesd_robot.plans import task_of
    from fesd_robot.render.figures import build_figures, robot_motion

    found = build_figures(short_plan, robot_motion(short_plan, task_of(short_plan)))
    assert set(found) == set(FIGURES)


def test_an_empty_folder_is_used(plan: Plan, tmp_path: Path) -> None:
    """A folder that is there but empty takes the results, and a look whether it can leaves it so."""
    (tmp_path / "run").mkdir()
    check_output_folder(tmp_path / "run")
    assert names(tmp_path / "run") == set()
    assert names(write_plan(plan, tmp_path / "run")) == OWN and names(tmp_path) == {"run"}


def test_a_look_leaves_nothing(tmp_path: Path) -> None:
    """Folders that were made to try them are gone."""
    check_output_folder(tmp_path / "new" / "run")
    assert names(tmp_path) == set()


NO_PLANS = {
    "of another program": '{"my": "own plan"}',
    "with a version of its own": '{"schema_version": 2, "name": "project", "status": "draft"}',
    "empty": "",
    "no JSON": "plan: [1, 2]",
    "a list": "[1, 2]",
    "a number": "3",
    "with a version in words": '{"schema_version": "2", "name": "a", "status": {"solved": true}}',
    "deep": "[" * 100000,
}


@pytest.mark.parametrize("text", NO_PLANS.values(), ids=NO_PLANS)
def test_a_plan_of_another_program_is_refused(plan: Plan, tmp_path: Path, text: str) -> None:
    """A folder whose plan.json is none of ours is left alone, although its other files have the names of results."""
    folder = tmp_path / "project"
    (folder / "figures").mkdir(parents=True)
    for name in ("report.md", "trajectory.csv", "figures/photo.png", "figures/positions.png"):
        (folder / name).write_text("mine")
    (folder / "plan.json").write_text(text)
    earlier = contents(folder)
    for refused in (lambda: check_output_folder(folder), lambda: write_plan(plan, folder)):
        with pytest.raises(PlanFileError, match=r"project: holds a plan\.json that is no plan of this program"):
            refused()
    assert contents(folder) == earlier and names(tmp_path) == {"project"}


@pytest.mark.skipif(sys.platform == "win32", reason="no FIFOs")
def test_a_plan_json_that_is_no_file_is_no_plan(tmp_path: Path) -> None:
    """Neither a pipe, which would be waited for, nor a folder, nor a link to nothing."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to(tmp_path / "nothing")
    assert not any(is_plan_of_ours(tmp_path / name) for name in ("pipe", "link", "."))


@pytest.mark.parametrize("version", [1, 2, 3])
def test_plans_of_any_version_are_ours(plan: Plan, tmp_path: Path, version: int) -> None:
    """Also one that a person has sorted, and one that an earlier version was killed while it wrote."""
    data = {**json.loads(plan.model_dump_json()), "schema_version": version}
    for text in (json.dumps(data), json.dumps(data, sort_keys=True, indent=4), json.dumps(data)[:3000]):
        (tmp_path / "plan.json").write_text(text)
        assert is_plan_of_ours(tmp_path / "plan.json")


def test_a_folder_of_other_things_is_refused(plan: Plan, tmp_path: Path) -> None:
    """A folder that holds files but no plan is left alone."""
    folder = tmp_path / "thesis"
    folder.mkdir()
    (folder / "chapter.tex").write_text("years of work")
    with pytest.raises(PlanFileError, match=r"thesis: holds files but no plan\.json"):
        write_plan(plan, folder)
    assert names(folder) == {"chapter.tex"} and names(tmp_path) == {"thesis"}


@pytest.mark.parametrize("name", ["report.md", "trajectory.npz", "figures/positions.png"])
def test_a_folder_in_the_place_of_a_file_is_refused(plan: Plan, tmp_path: Path, name: str) -> None:
    """Its files would be in the way at the end of a run."""
    folder = write_plan(plan, tmp_path / "run")
    (folder / name).unlink(missing_ok=True)
    (folder / name).mkdir(parents=True)
    with pytest.raises(PlanFileError, match=f"{name}: is a folder where results have a file"):
        check_output_folder(folder)


def test_figures_elsewhere_are_refused(plan: Plan, tmp_path: Path) -> None:
    """A link would lead to files that are not a run's."""
    folder = write_plan(plan, tmp_path / "run")
    (tmp_path / "pictures").mkdir()
    (folder / "figures").symlink_to(tmp_path / "pictures")
    with pytest.raises(PlanFileError, match=r"figures: is a link or a file"):
        check_output_folder(folder)


@pytest.mark.parametrize("below", ["", "deep/run"])
def test_a_file_in_the_way_is_refused(plan: Plan, tmp_path: Path, below: str) -> None:
    """Results are not written over a file, nor below one."""
    (tmp_path / "run").write_text("a file")
    with pytest.raises(PlanFileError, match=r"choose another --out"):
        write_plan(plan, tmp_path / "run" / below)
    assert (tmp_path / "run").read_text() == "a file" and names(tmp_path) == {"run"}


@pytest.mark.parametrize("folder", [".", ".."])
def test_the_current_folder_is_refused(
    plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, folder: str
) -> None:
    """The folder one works in, or one above it, is none of results."""
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    with pytest.raises(PlanFileError, match="current folder"):
        write_plan(plan, Path(folder))
    assert names(tmp_path) == {"work"} and names(tmp_path / "work") == set()


def test_a_name_that_is_too_long_is_refused(plan: Plan, tmp_path: Path) -> None:
    """Before anything is solved; also one that leads in a circle."""
    (tmp_path / "circle").symlink_to(tmp_path / "circle")
    for folder in (tmp_path / ("x" * 300), tmp_path / "/".join(["y" * 200] * 30), tmp_path / "circle"):
        with pytest.raises(PlanFileError, match=r"cannot hold results \(.+\); choose another --out"):
            check_output_folder(folder)
    assert names(tmp_path) == {"circle"}


def test_a_link_to_a_folder_stays_a_link(plan: Plan, tmp_path: Path) -> None:
    """Results go where a link points to."""
    (tmp_path / "disk").mkdir()
    (tmp_path / "run").symlink_to(tmp_path / "disk")
    write_plan(plan, tmp_path / "run")
    assert (tmp_path / "run").is_symlink() and names(tmp_path / "disk") == OWN


def test_a_plan_that_is_a_link_is_replaced_not_followed(plan: Plan, tmp_path: Path) -> None:
    """The file that it points to stays as it is."""
    elsewhere = write_plan(plan, tmp_path / "elsewhere") / "plan.json"
    earlier = elsewhere.read_bytes()
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "plan.json").symlink_to(elsewhere)
    write_plan(renamed(plan, "second"), tmp_path / "run")
    assert elsewhere.read_bytes() == earlier and read_plan(tmp_path / "run").name == "second"


def full(*_: Any) -> None:
    raise OSError(28, "No space left on device")


def test_a_plan_that_cannot_be_written_is_written_elsewhere(
    plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One sentence says where, and the earlier plan stays."""
    folder = write_plan(plan, tmp_path / "run")
    earlier = contents(folder)
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    with pytest.raises(
        PlanFileError, match=r"run: cannot be written to \(No space left on device\); the plan"
    ) as caught:
        write_plan(renamed(plan, "second"), folder, full)
    assert caught.value.kept is not None and str(caught.value).endswith(f"is written to {caught.value.kept}")
    assert caught.value.kept.parent == tmp_path / "work" and read_plan(caught.value.kept).name == "second"
    assert contents(folder) == earlier


def test_the_temporary_folder_keeps_a_plan_where_the_current_one_cannot(
    plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where a folder has become one of something else since it was checked."""
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    (tmp_path / "work").rmdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "mine").write_text("mine")
    with pytest.raises(PlanFileError, match=r"run: .*; the plan is written to") as caught:
        write_or_keep(plan, tmp_path / "run")
    assert caught.value.kept is not None and caught.value.kept.parent == tmp_path
    assert names(caught.value.kept) == OWN and names(tmp_path / "run") == {"mine"}


KILLING = {"os.rename", "os.remove", "os.mkdir", "os.rmdir", "open"}


def killed_at(number: int, work: Callable[[], Any], folder: Path) -> bool:
    """Do something in a process that is killed before it changes something for the n-th time; return whether it was."""
    process = os.fork()
    if not process:
        seen = [0]

        def count(event: str, arguments: tuple[Any, ...]) -> None:
            if event not in KILLING or (event == "open" and not arguments[2] & (os.O_WRONLY | os.O_RDWR)):
                return
            if str(arguments[0]).startswith(str(folder)):
                seen[0] += 1
                if seen[0] == number:
                    os.kill(os.getpid(), signal.SIGKILL)

        sys.addaudithook(count)
        try:
            work()
        finally:
            os._exit(0)
    return os.WIFSIGNALED(os.waitpid(process, 0)[1])


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="no processes that are forked")
@pytest.mark.parametrize("first", [False, True], ids=["over an earlier plan", "in a new folder"])
def test_a_kill_leaves_the_earlier_or_the_new_plan(plan: Plan, tmp_path: Path, first: bool) -> None:
    """At every change that a write makes: after it the plan is whole, all files are its, and the user's are there."""
    later, number, seen = renamed(plan, "second"), 0, set()
    figures = "positions.png", "energy.png"
    while True:
        number += 1
        folder = tmp_path / str(number)
        if not first:
            write_plan(plan, folder, drawn("controls.svg", *figures))
            add_foreign(folder)
        killed = killed_at(number, lambda: write_plan(later, folder, drawn(*figures)), folder)  # noqa: B023
        raw = (folder / "plan.json").read_bytes() if (folder / "plan.json").exists() else None
        if raw is not None:
            seen.add(Plan.model_validate_json(raw).name)
        assert raw is not None or first
        if not first:
            assert contents(folder).items() >= FOREIGN.items()
        try:
            found = read_plan(folder)
        except PlanFileError:
            assert first
        else:
            assert (folder / "trajectory.csv").read_bytes() == export(found, "csv")
            assert found.name == "second" or contents(folder)["figures/controls.svg"]
        write_plan(later, folder)
        assert not list(folder.rglob(".fesd-robot-*")) and names(folder) >= OWN
        if not killed:
            break
    assert number > 30 and seen == ({"second"} if first else {plan.name, "second"})


def test_a_reader_that_may_not_write_warns(plan: Plan, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Where an interrupted run cannot be finished, files beside the plan may be of another one."""
    folder = write_plan(plan, tmp_path / "run")
    stage = folder / ".fesd-robot-0123456789abcdef.part"
    (stage / "report.md").mkdir(parents=True)
    (stage / COMPLETE).write_text("report.md")
    (stage / "report.md" / "a").write_text("")
    assert read_plan(folder).name == plan.name
    assert "a run was killed while it wrote there" in caplog.text


def test_writers_wait_for_each_other(plan: Plan, tmp_path: Path) -> None:
    """Five at once: a plan is there at any time, all files are of one run at the end, and other files stay."""
    folder = write_plan(plan, tmp_path / "run")
    add_foreign(folder)

    def write(number: int) -> None:
        for _ in range(5):
            write_plan(renamed(plan, f"writer {number}"), folder, drawn("positions.png"))

    fork, looks = multiprocessing.get_context("fork"), 0
    processes = [fork.Process(target=write, args=(number,)) for number in range(5)]
    for process in processes:
        process.start()
    while any(process.is_alive() for process in processes):
        Plan.model_validate_json((folder / "plan.json").read_bytes())
        looks += 1
    assert [process.exitcode for process in processes] == [0] * 5 and looks > 5
    assert set(contents(folder)) == OWN | {"plan.html", "figures/positions.png", *FOREIGN}
    found = read_plan(folder)
    assert (folder / "report.md").read_text().startswith(f"# {found.name}")


def test_every_file_of_a_run_is_known(plan: Plan) -> None:
    """Names of results are those of files within the folder."""
    assert all(".." not in name and not name.startswith("/") for name in DERIVED)
