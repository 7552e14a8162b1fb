"""Output in a console of another code page, and names that try to write on the terminal."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROBOT = """<robot name="Bein"><link name="world"/>
<link name="Körper"><inertial><mass value="4"/>
<inertia ixx="0.04" ixy="0" ixz="0" iyy="0.04" iyz="0" izz="0.04"/></inertial></link>
<link name="足"><inertial><mass value="1"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
<joint name="slide_z" type="prismatic"><parent link="world"/><child link="Körper"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="2" velocity="10" effort="0"/></joint>
<joint name="π12" type="revolute"><parent link="Körper"/><child link="足"/><origin xyz="0 0 -0.3"/><axis xyz="0 1 0"/>
<limit lower="-2.5" upper="1" velocity="20" effort="40"/></joint></robot>
"""
TASK = """name: leg
robot: {model: robot.urdf}
contacts: {foot: {frame: 足}}
horizon: {duration: 0.6, intervals: 6}
initial: {configuration: {slide_z: 0.5, π12: -1.0}}
goal: {configuration: {π12: 0.5}}
"""
ENCODINGS = {
    "cp1252": {"PYTHONIOENCODING": "cp1252"},
    "cp437": {"PYTHONIOENCODING": "cp437"},
    "cp932": {"PYTHONIOENCODING": "cp932"},
    "ascii": {"PYTHONIOENCODING": "ascii"},
    "C": {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "PYTHONIOENCODING": ""},
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A robot whose names lie in no code page of Windows, and its task."""
    (tmp_path / "robot.urdf").write_text(ROBOT, encoding="utf-8")
    (tmp_path / "task.yaml").write_text(TASK, encoding="utf-8")
    return tmp_path


def _ran(folder: Path, *words: str, **environment: str) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(
        [sys.executable, "-m", "fesd_robot", *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2]), **environment},
        capture_output=True,
        check=False,
    )


@pytest.mark.parametrize("environment", ENCODINGS.values(), ids=ENCODINGS)
@pytest.mark.parametrize(
    ("words", "code"),
    [
        (["robots", "robot.urdf"], 0),
        (["check", "task.yaml"], 0),
        (["check", "task.yaml", "--set", "initial.configuration.π13=0"], 2),
        (["check", "足.yaml"], 2),
    ],
)
def test_what_a_code_page_lacks_is_escaped(
    folder: Path, words: list[str], code: int, environment: dict[str, str]
) -> None:
    """Every command ends as it does elsewhere, and says the rest."""
    done = _ran(folder, *words, **environment)
    assert done.returncode == code and b"Traceback" not in done.stderr
    said = done.stdout + done.stderr
    assert any(word.encode() in said for word in ("\\u03c0", "\\u8db3")) or environment != ENCODINGS["cp1252"]


def test_a_path_with_an_escape_sequence_is_shown_escaped(folder: Path) -> None:
    """A file from a stranger does not write on the terminal by its name."""
    (folder / "e\x1b[31m.yaml").write_text("name: 1\n", encoding="utf-8")
    done = _ran(folder, "check", "e\x1b[31m.yaml")
    assert done.returncode == 2 and b"\x1b" not in done.stderr and b"e\\x1b[31m.yaml" in done.stderr
