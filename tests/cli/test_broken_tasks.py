"""Task files with one fault each: the command line says where it is and what would be valid.

Every file in ``broken`` begins with what is wrong with it, and with what the program says about that: ``expect`` gives
line and key, ``says`` the sentence, with `` ... `` where it is left out.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest

FOLDER = Path(__file__).parent / "broken"
FILES = sorted(FOLDER.glob("*.yaml"))
_HEADER = re.compile(r"# .+\n# expect: line=(?P<line>\d+)(?: key=(?P<key>\S+))?\n# says: (?P<says>.+)\n")


class Expected(NamedTuple):
    """What is said about a fault: its line, its key if it has one, parts of the sentence in their order."""

    line: int
    key: str | None
    parts: list[str]


def expected(file: Path) -> Expected:
    """Return what the header of a file says."""
    header = _HEADER.match(file.read_text(encoding="utf-8"))
    assert header is not None, f"{file} does not begin with its fault, 'expect' and 'says'"
    return Expected(int(header["line"]), header["key"], header["says"].split(" ... "))


def assert_refused(outcome: Any, file: Path, folder: Path) -> None:
    """Exit status 2, one line on stderr with file, line, key and sentence, nothing else said and nothing written."""
    line, key, parts = expected(file)
    assert (outcome.code, outcome.said, outcome.err.count("\n")) == (2, "", 1), outcome
    assert outcome.err.startswith(f"error: {file}:{line}: {f'{key}: ' if key else ''}"), outcome.err
    assert re.search(".*".join(map(re.escape, parts)), outcome.err), outcome.err
    assert not re.search(r"and \d+ more error", outcome.err), f"{file.name} has more than one fault"
    assert not list((folder / "work").iterdir())


def test_there_are_at_least_fifty() -> None:
    """The corpus covers all sections, and no two files hold the same task."""
    assert len(FILES) >= 50
    sections = {(expected(file).key or "").split(".")[0] for file in FILES}
    assert sections >= {
        "name", "robot", "ground", "contacts", "horizon", "initial", "goal", "waypoints", "reference", "costs",
        "limits", "constraints", "method", "solver",
    }  # fmt: skip
    tasks = {_HEADER.sub("", file.read_text(encoding="utf-8")) for file in FILES}
    assert len(tasks) == len(FILES)


@pytest.mark.parametrize("file", FILES, ids=[file.stem for file in FILES])
def test_a_fault_is_reported(run: Callable[..., Any], tmp_path: Path, file: Path) -> None:
    """`check` ends with status 2 and one sentence that names file, line, key and what would be valid."""
    assert_refused(run("check", file), file, tmp_path)


@pytest.mark.parametrize("name", ["misspelt_key", "unknown_frame", "start_below_ground", "terrain_absent"])
def test_a_plan_is_refused_as_a_check_is(run: Callable[..., Any], tmp_path: Path, name: str) -> None:
    """`plan` says the same, and writes nothing."""
    file = FOLDER / f"{name}.yaml"
    assert_refused(run("plan", file), file, tmp_path)


@pytest.mark.parametrize(
    ("name", "fault", "repair"), [("unknown_frame", "foott", "foot"), ("unknown_coupled", "FL_KNEE", "FL_KFE")]
)
def test_the_tasks_are_valid_but_for_the_fault(
    run: Callable[..., Any], tmp_path: Path, name: str, fault: str, repair: str
) -> None:
    """The two tasks that the files are made of pass once the fault is repaired."""
    text = (FOLDER / f"{name}.yaml").read_text(encoding="utf-8")
    repaired = tmp_path / "task.yaml"
    text = _HEADER.sub("", text).replace(fault, repair).replace("../../../models", str(FOLDER.parents[2] / "models"))
    repaired.write_text(text, encoding="utf-8")
    outcome = run("check", repaired)
    assert (outcome.code, outcome.err) == (0, "")
