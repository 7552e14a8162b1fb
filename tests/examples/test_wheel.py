"""What is installed from the wheel: tasks and models with it, without servers, robots and tests."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from email.parser import Parser
from pathlib import Path

import pytest

from fesd_robot import __version__

ROOT = Path(__file__).parents[2]
pytest.importorskip("hatchling", reason="the wheel is built with hatchling: pip install -e .[dev]")


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built once and unpacked."""
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    (wheel,) = folder.glob("*.whl")
    assert wheel.stat().st_size < 2e6
    zipfile.ZipFile(wheel).extractall(folder / "installed")
    return folder / "installed"


def test_a_task_is_found_by_its_name_in_an_empty_folder(installed: Path, tmp_path: Path) -> None:
    """The installed program checks a shipped task, and copies it, with nothing of the repository around."""
    environment = {**os.environ, "PYTHONPATH": str(installed)}

    def said(*arguments: str) -> str:
        command = [sys.executable, "-m", "fesd_robot", *arguments]
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done.stderr
        return done.stdout

    assert said("check", "hopper_one_jump").startswith("hopper_one_jump: the task fits its robot")
    assert "written: models/hopper/hopper.urdf" in said("examples", "hopper_one_jump")
    where = subprocess.run(
        [sys.executable, "-c", "import fesd_robot; print(fesd_robot.__file__)"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
    )
    assert Path(where.stdout.strip()).is_relative_to(installed)


def test_the_wheel_has_the_repository_s_tasks_and_models(installed: Path) -> None:
    """File by file, and neither tests nor scripts."""
    for folder in ("tasks", "models"):
        copied = installed / "fesd_robot" / "examples" / folder
        files = [file.relative_to(ROOT / folder) for file in (ROOT / folder).rglob("*") if file.is_file()]
        assert sorted(files) == sorted(file.relative_to(copied) for file in copied.rglob("*") if file.is_file())
    assert {path.name for path in installed.iterdir()} == {"fesd_robot", f"fesd_robot-{__version__}.dist-info"}


def test_what_is_large_is_an_extra(installed: Path) -> None:
    """Robots, documentation and Meshcat's server are not installed with the program; licences of what is inside are."""
    text = (installed / f"fesd_robot-{__version__}.dist-info" / "METADATA").read_text(encoding="utf-8")
    required = Parser().parsestr(text).get_all("Requires-Dist") or []
    always = [one for one in required if "extra ==" not in one]
    for name in ("meshcat", "example-robot-data", "mkdocs", "pytest"):
        assert not any(one.startswith(name) for one in always), name
    assert any(one.startswith("example-robot-data") and "robots" in one for one in required)
    kept = installed / f"fesd_robot-{__version__}.dist-info" / "licenses"
    licences = {file.name for file in kept.rglob("*") if file.is_file()}
    assert {"LICENSE", "LICENSE.txt", "main.min.js.THIRD_PARTY_LICENSES.json"} <= licences
