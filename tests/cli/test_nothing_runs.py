"""Nothing in the folder of a task is executed, imported or read as settings."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from fesd_robot.native.compiler import CompilationError, find_compiler

from .conftest import ROOT

TASK = f"""
name: slide
robot: {{model: {ROOT}/models/block/block.urdf}}
ground: {{type: plane, friction: 0.3}}
contacts: {{rear: {{frame: rear}}, front: {{frame: front}}}}
horizon: {{duration: 0.2, intervals: 4}}
initial: {{configuration: {{root_x: 0, root_z: 0.1, root_pitch: 0}}, velocity: {{root_x: 1}}}}
goal: {{configuration: {{root_x: 0.1}}, soft: true}}
output: {{page: false}}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The current folder with a task in it."""
    (tmp_path / "slide.yaml").write_text(TASK)
    return tmp_path


def ran(folder: Path, *words: str, module: bool = False, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run the program there in a process of its own."""
    start = ["-m", "fesd_robot"] if module else ["-P", "-m", "fesd_robot"] if sys.version_info >= (3, 11) else []
    if not start:
        start = ["-c", "import sys; del sys.path[0]; from fesd_robot.cli.main import main; main()"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **variables}
    return subprocess.run(
        [sys.executable, *start, *words], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


def test_git_does_not_run(folder: Path) -> None:
    """A repository whose configuration names programs has its commit in the plan, and none of them runs."""
    if not shutil.which("git"):
        pytest.skip("git is not installed")
    program = f"echo ran >> '{folder}/HACKED'; false"
    for words in (
        ("init", "-q"),
        ("add", "slide.yaml"),
        ("-c", "user.name=a", "-c", "user.email=a@b", "commit", "-qm", "x"),
        ("config", "core.fsmonitor", program),
        ("config", "filter.evil.clean", program),
    ):
        subprocess.run(["git", *words], cwd=folder, check=True)
    (folder / ".gitattributes").write_text("* filter=evil\n")
    done = ran(folder, "simulate", "slide.yaml", "--out", "out", "-q", "--set", "output.figures=false")
    assert done.returncode == 0, done.stderr
    assert not (folder / "HACKED").exists()
    from fesd_robot import read_plan

    assert len(read_plan(folder / "out").provenance.git) == 12


def test_modules_and_settings_of_the_folder_are_not_taken(folder: Path) -> None:
    """Neither modules named as ours and others', nor Matplotlib's settings, nor IPOPT's options."""
    for name in ("numpy", "casadi", "matplotlib", "yaml", "sitecustomize_of_task", "pinocchio", "scipy", "typer"):
        (folder / f"{name}.py").write_text(f"open('HACKED', 'a').write('{name}\\n')\nraise SystemExit(7)\n")
    (folder / "matplotlibrc").write_text("this is: no setting\nfigure.dpi: nonsense\n")
    (folder / "ipopt.opt").write_text("print_level 5\noutput_file written_by_ipopt\n")
    done = ran(folder, "plan", "slide.yaml", "--out", "out", "-q", module=True)
    assert done.returncode == 0, done.stderr
    assert not (folder / "HACKED").exists() and not (folder / "written_by_ipopt").exists()
    assert "matplotlibrc" not in done.stderr and "clobber" not in done.stderr + done.stdout
    assert (folder / "out" / "figures" / "positions.png").exists()


@pytest.mark.parametrize("path", [".", "", "./bin", "bin"])
def test_no_compiler_of_the_folder_is_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, path: str) -> None:
    """A PATH that leads to the current folder finds none there."""
    for place in (tmp_path, tmp_path / "bin"):
        place.mkdir(exist_ok=True)
        for name in ("cc", "gcc", "clang"):
            (place / name).write_text("#!/bin/sh\ntouch HACKED\n")
            (place / name).chmod(0o755)
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", path + os.pathsep + str(tmp_path / "none"))
    with pytest.raises(CompilationError, match="no C compiler found"):
        find_compiler("c")
    monkeypatch.setenv("CC", "./cc")
    assert find_compiler("c") == ["./cc"]
