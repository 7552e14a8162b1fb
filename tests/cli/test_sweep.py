"""`fesd-robot sweep` as a user runs it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fesd_robot.sweeps import read_sweep

TEXT = """task: published_hopper_one_jump
set:
  horizon.duration: 0.2
  horizon.intervals: 2
  reference: {type: line}
  costs.slipping: {}
  solver.tolerance: 1e-6
vary:
  goal.configuration.root_x: [0.11, 0.12]
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A sweep of two short motions."""
    path = tmp_path / "short.yaml"
    path.write_text(TEXT)
    return path


def test_a_sweep_is_planned_and_goes_on(run: Callable[..., Any], file: Path, tmp_path: Path) -> None:
    """Table, page and plans are there, each with its page; again needs --resume, and then nothing is left to do."""
    out = tmp_path / "out"
    outcome = run("sweep", file, "--out", out, "--jobs", "1", "--dataset", "100")
    assert outcome.code == 0, outcome.err
    assert "2 plans: 2 solved" in outcome.sentences
    assert f"written to {out}: sweep.json, rows.csv, rows.parquet, sweep.html, plans, dataset" in outcome.sentences
    table = read_sweep(out)
    assert all((out / plan / "plan.html").is_file() for plan in table.columns["plan"])
    refused = run("sweep", file, "--out", out)
    assert refused.code == 2 and "--resume goes on with it" in refused.err
    again = run("sweep", file, "--out", out, "--resume", "--against", out)
    assert again.code == 0 and read_sweep(out).columns == table.columns
    assert 'id="comparison"' in (out / "sweep.html").read_text()


def test_a_sweep_that_is_not_all_solved_says_so(run: Callable[..., Any], file: Path, tmp_path: Path) -> None:
    """The exit status is that of a plan that is not solved."""
    outcome = run("sweep", file, "--out", tmp_path / "out", "--jobs", "1", "--timeout", "0.05", "--keep", "none")
    assert outcome.code == 3
    assert "2 plans: " in outcome.sentences and "solved" in outcome.sentences


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--keep", "some"], "keep: found 'some', expected all or solved or best or none"),
        (["--jobs", "0"], "jobs: found 0, expected a number greater than 0"),
        (["--timeout", "-1"], "timeout: found -1, expected a number greater than 0"),
    ],
)
def test_wrong_options(run: Callable[..., Any], file: Path, tmp_path: Path, words: list[str], sentence: str) -> None:
    """One sentence says what is expected, and nothing is written."""
    outcome = run("sweep", file, "--out", tmp_path / "out", *words)
    assert outcome.code == 2 and sentence in outcome.err
    assert not (tmp_path / "out").exists()
