"""`fesd-robot robots` lists the robots of example-robot-data."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import pytest

from fesd_robot.robot import example_robots, load_robot


def test_the_table_names_every_robot_once(run: Callable[..., Any]) -> None:
    """Names, degrees of freedom, drives and masses stand in columns; what cannot be read says why."""
    outcome = run("robots")
    assert (outcome.code, outcome.err) == (0, "")
    table, _, unread = outcome.out.partition("\n\n")
    header, *rows = table.splitlines()
    assert [row.split()[0] for row in rows] == list(example_robots())
    assert all(row[header.index("mass") :].strip() for row in rows)
    solo = next(row for row in rows if row.startswith("solo12 "))
    assert solo.split() == ["solo12", "12", "12", "2.5", "solo_description/robots/solo12.urdf"]
    assert "cassie: this build of Pinocchio reads no SDF files" in unread


@pytest.mark.parametrize(
    ("pattern", "names"),
    [("SOLO", ["solo", "solo12", "solo8"]), ("s?lo", ["solo"]), ("*12", ["solo12"]), ("hector", ["hector"])],
)
def test_json_of_a_pattern(run: Callable[..., Any], pattern: str, names: list[str]) -> None:
    """A pattern is a part of the name, or with * and ? all of it; JSON holds full paths that load."""
    outcome = run("robots", pattern, "--json")
    entries = json.loads(outcome.out)
    assert [entry["name"] for entry in entries] == names
    for entry in entries:
        robot = load_robot(entry["file"], root="free_flyer")
        assert entry["degrees_of_freedom"] == robot.model.nv - 6 == entry["driven"]
        assert entry["mass"] == pytest.approx(sum(inertia.mass for inertia in robot.model.inertias))


def test_an_unknown_pattern_names_the_nearest(run: Callable[..., Any]) -> None:
    """Nothing found is bad input."""
    outcome = run("robots", "talso")
    assert (outcome.code, outcome.out) == (2, "")
    assert "no robot 'talso'" in outcome.err and "did you mean 'talos'?" in outcome.err


def test_the_shell_completes_names() -> None:
    """What a bash completion asks for lists the names that begin so."""
    asked = {"_FESD_ROBOT_COMPLETE": "complete_bash", "COMP_WORDS": "fesd-robot robots so", "COMP_CWORD": "2"}
    code = "import sys; sys.argv = ['fesd-robot']; from fesd_robot.cli.main import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, **asked}, capture_output=True, text=True, timeout=60
    )
    assert done.stdout.split() == [name for name in example_robots() if name.startswith("so")]
