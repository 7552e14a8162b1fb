"""Where model files are looked for."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from fesd_robot.errors import RobotError
from fesd_robot.robot import load_robot

from .conftest import HOPPER


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package with a robot in it, share/my_robot/urdf/hopper.urdf."""
    folder = tmp_path / "share" / "my_robot"
    (folder / "urdf").mkdir(parents=True)
    (folder / "urdf" / "hopper.urdf").write_bytes(HOPPER.read_bytes())
    return folder


ADDRESS = "package://my_robot/urdf/hopper.urdf"


@pytest.mark.parametrize("start", [".", "tasks", "tasks/deep"])
def test_a_package_is_found_in_the_folders_above(package: Path, start: str) -> None:
    """From a folder inside the package, and from the one that holds it, the address is the same file."""
    (package / start).mkdir(parents=True, exist_ok=True)
    for folder in (package / start, package.parent):
        robot = load_robot(ADDRESS, search_path=folder)
        assert robot.source == package / "urdf" / "hopper.urdf"


@pytest.mark.parametrize(
    ("variable", "entry"),
    [("ROS_PACKAGE_PATH", "share"), ("ROS_PACKAGE_PATH", "share/my_robot"), ("AMENT_PREFIX_PATH", "")],
)
def test_a_package_is_found_where_ros_looks(
    package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, variable: str, entry: str
) -> None:
    """The folders of both generations of ROS are searched."""
    away = tmp_path / "away"
    away.mkdir()
    monkeypatch.setenv(variable, os.pathsep.join(["/nowhere", str(tmp_path / entry)]))
    assert load_robot(ADDRESS, search_path=away).source == package / "urdf" / "hopper.urdf"


@pytest.mark.parametrize("address", ["package://my_robot/urdf/hooper.urdf", "package://my_robot", "package:///etc"])
def test_a_file_that_is_in_no_package_is_refused(package: Path, address: str) -> None:
    """The error says where was looked."""
    with pytest.raises(RobotError, match=r"no file for 'package://.*AMENT_PREFIX_PATH"):
        load_robot(address, search_path=package)


def test_xacro_has_to_be_expanded(tmp_path: Path) -> None:
    """A xacro file is not read as if it were complete; the error names the command."""
    file = tmp_path / "arm.urdf.xacro"
    text = '<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:property name="a" value="1"/></robot>'
    file.write_text(text)
    with pytest.raises(RobotError, match=r"expand it first: xacro arm.urdf.xacro > arm.urdf"):
        load_robot(file)
