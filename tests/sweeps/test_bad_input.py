"""What a user can do wrong with a sweep ends with one sentence: file, line, key, what was found, what is expected."""

from __future__ import annotations

from pathlib import Path

import pytest

from fesd_robot.errors import FesdRobotError, OptionError, SweepError, TaskError
from fesd_robot.sweeps import SweepSettings, load_sweep, swept
from tests.sweeps.stubs import parabola

FIRST = "task: hopper_one_jump\n"


def written(folder: Path, text: str) -> Path:
    file = folder / "own.yaml"
    file.write_text(FIRST + text)
    return file


def refused(folder: Path, text: str, **settings: object) -> str:
    """Return the sentence with which a sweep is refused, before any row."""
    with pytest.raises(FesdRobotError) as caught:
        swept(load_sweep(written(folder, text)), folder / "out", SweepSettings(**settings), parabola)  # type: ignore[arg-type]
    assert not (folder / "out").exists()
    sentence = str(caught.value)
    assert "\n" not in sentence
    return sentence


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            "vary: {goal.configuration.rootx: [1, 2]}",
            ":2: vary.goal.configuration.rootx: found 'rootx', expected",
        ),
        (
            "vary:\n  ground.frictoin: [0.4]",
            ":3: vary.ground.frictoin: found an unknown key, expected",
        ),
        ("vary: {ground.friction: []}", ":2: vary.ground.friction: found an empty list, expected at least one entry"),
        ("vary: {ground.friction: {range: [0.5, 0.4], count: 3}}", "found the empty range [0.5, 0.4], expected the"),
        ("vary: {ground.friction: {range: [0.4, 0.5], count: 0}}", "found 0, expected a number of at least 1"),
        ("vary: {ground.friction: {range: [0.4, 0.5]}}", "found 'range' alone, expected count or step beside it"),
        ("vary: {ground.friction: {uniform: [0.4, 0.5], step: 0.1}}", "found a step, expected one beside 'range' only"),
        (
            "vary: {ground.friction: {range: [0.4, 0.5], normal: [0, 1], count: 2}}",
            "found range and normal",
        ),
        ("vary: {ground.friction: {log_uniform: [0, 1], count: 2}}", "expected positive numbers"),
        ("vary: {ground.friction: 0.5}", "vary.ground.friction: found 0.5, expected a list"),
        ("vary: {}", ":2: vary: found an empty mapping, expected at least one entry"),
        ("vari: {ground.friction: [0.5]}", "did you mean 'vary'"),
        ("vary: {ground.friction: [0.5]}\nset: {ground.friction: 0.4}", "this key varies too"),
        ("vary: {ground.friction: [0.5]}\ncombine: sum", "expected 'product' or 'zip'"),
        (
            "vary: {model.mas: [1.1]}",
            ":2: vary.model.mas: found an unknown quantity",
        ),
        ("vary: {model.mass: [-1]}", "vary.model.mass: found -1, expected a factor greater than 0"),
        ("vary: {ground.friction: [-0.5]}", ":2: vary.ground.friction: found -0.5, expected a number of at least 0"),
        (
            "set: {horizon.intervals: x}\nvary: {ground.friction: [0.5]}",
            ":2: set.horizon.intervals: found the text",
        ),
        ("vary: {ground.friction: [.inf]}", "expected a finite number"),
        ("vary: {task: [block_push]}", ":1: task: the task varies too, expected it here or in 'vary'"),
        ("cases: {wet: {ground.frictoin: 0.2}}", ":2: cases.wet.ground.frictoin: found an unknown key, expected"),
        ("vary: {ground.friction: [0.4]}\ncases: {wet: {ground.friction: 0.2}}", "this key varies too, expected it in"),
        ("cases: {wet: {ground.friction: .nan}}", "cases.wet.ground.friction: found nan, expected a finite number"),
        ("cases: {a: {}, b: {task: block_push}}\nwarm: nearest", ":3: warm: found 2 tasks, expected one"),
        ("vary: {ground.friction: [0.4, 0.5]}\nwarm: nearest", None),
    ],
)
def test_mistakes_in_the_file(tmp_path: Path, text: str, sentence: str | None) -> None:
    """The key of the sweep is named, with its line; nothing is written."""
    settings = {"keep": "none"} if sentence is None else {}
    said = refused(tmp_path, text, **settings)
    assert (sentence or ":3: warm: found keep 'none', expected 'all' or 'solved'") in said
    assert "own.yaml:" in said


def test_another_task(tmp_path: Path) -> None:
    """A task that is not there is named where the sweep names it."""
    file = tmp_path / "own.yaml"
    file.write_text("vary: {ground.friction: [0.5]}\ntask: hoper_one_jump\n")
    with pytest.raises(TaskError, match=r"own.yaml:2: task: found 'hoper_one_jump'.*did you mean 'hopper_one_jump'"):
        swept(load_sweep(file), tmp_path / "out", SweepSettings(), parabola)
    file.write_text("vary:\n  task: [block_push, hoper_one_jump]\n")
    with pytest.raises(TaskError, match=r"own.yaml:2: vary.task: found 'hoper_one_jump'.*did you mean"):
        swept(load_sweep(file), tmp_path / "out", SweepSettings(), parabola)
    file.write_text("cases: {a: {}, b: {task: block_push}}\n")
    with pytest.raises(TaskError, match=r"task: found no task, expected one here, a list in 'vary', or one in every"):
        load_sweep(file)


def test_a_million_rows_need_a_yes(tmp_path: Path) -> None:
    """The number of rows is said, and how it is meant."""
    keys = ", ".join(
        f"costs.configuration.{name}: {{range: [1, 2], count: 101}}" for name in ("root_x", "root_z", "leg")
    )
    said = refused(tmp_path, f"vary: {{{keys}}}")
    assert "vary: found 1030301 rows, expected at most 1000000; --yes plans them all" in said


def test_a_name_that_is_no_sweep() -> None:
    """A name is looked up among those that come with the program, and the nearest one is named."""
    with pytest.raises(TaskError, match=r"found 'jump_over_frictoin'.*did you mean 'jump_over_friction'"):
        load_sweep("jump_over_frictoin")
    with pytest.raises(TaskError, match=r"there.yaml: there is no such file, expected a sweep file"):
        load_sweep("there.yaml")


def test_folders_of_others(tmp_path: Path) -> None:
    """A folder of something else, a file, and another sweep's folder are refused; this one's needs --resume."""
    sweep = load_sweep(written(tmp_path, "vary: {goal.configuration.root_x: [0.9, 1.0]}"))
    (tmp_path / "file").write_text("mine")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "notes.txt").write_text("mine")
    with pytest.raises(SweepError, match="is a file, expected a folder"):
        swept(sweep, tmp_path / "file", SweepSettings(), parabola)
    with pytest.raises(SweepError, match=r"holds files but no sweep\.json"):
        swept(sweep, tmp_path / "other", SweepSettings(), parabola)
    swept(sweep, tmp_path / "out", SweepSettings(jobs=1), parabola)
    with pytest.raises(SweepError, match="holds this sweep already; --resume goes on with it"):
        swept(sweep, tmp_path / "out", SweepSettings(), parabola)
    another = load_sweep(written(tmp_path, "vary: {goal.configuration.root_x: [0.9, 1.1]}"))
    with pytest.raises(SweepError, match="holds another sweep, 'own', whose task or values are not these"):
        swept(another, tmp_path / "out", SweepSettings(resume=True), parabola)
    assert (tmp_path / "other" / "notes.txt").read_text() == "mine"


def test_settings() -> None:
    """Values of settings are checked where they are made."""
    with pytest.raises(OptionError, match=r"keep: found 'some', expected all or solved or best or none"):
        SweepSettings(keep="some")
    with pytest.raises(OptionError, match=r"timeout: found -1, expected a number greater than 0"):
        SweepSettings(timeout=-1.0)
    with pytest.raises(OptionError, match="jobs"):
        SweepSettings(jobs=0)


def test_a_scheduler_that_does_not_answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One sentence names the address."""
    pytest.importorskip("distributed")
    monkeypatch.setattr("fesd_robot.sweeps.dask_workers.SECONDS_TO_ANSWER", 0.5)
    sweep = load_sweep(written(tmp_path, "vary: {ground.friction: [0.5]}"))
    with pytest.raises(SweepError, match=r"found no scheduler of Dask at tcp://127\.0\.0\.1:9 within 0\.5 s"):
        swept(sweep, tmp_path / "out", SweepSettings(scheduler="tcp://127.0.0.1:9"), parabola)
    with pytest.raises(SweepError, match="found no scheduler of Dask at nonsense:x"):
        swept(sweep, tmp_path / "out2", SweepSettings(scheduler="nonsense:x"), parabola)
