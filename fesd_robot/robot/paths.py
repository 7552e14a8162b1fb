"""The file of a robot, from a path or an address."""

from __future__ import annotations

import os
from pathlib import Path

from fesd_robot.errors import RobotError
from fesd_robot.robot.library import PREFIX, resolve_example

PACKAGE = "package://"
_SEARCHED_LEVELS = 6
"""Folders in which a package is looked for: that of the file and those above it."""


def locate_robot(source: str | Path, search_path: Path | None) -> Path:
    """Return the file of a robot.

    Args:
        source: a path, ``package://NAME/PATH`` or ``example-robot-data:NAME``.
        search_path: folder that relative paths start from; the working directory if absent.

    Raises:
        RobotError: if there is no such file.
    """
    if isinstance(source, str) and source.startswith(PREFIX):
        return resolve_example(source.removeprefix(PREFIX))
    if isinstance(source, str) and source.startswith(PACKAGE):
        return _in_package(source, (search_path or Path()).resolve())
    path = Path(source).expanduser()
    path = (path if search_path is None else search_path / path).resolve()
    if not path.is_file():
        raise RobotError(f"There is no robot file {path}.")
    return path


def package_directories(path: Path, search_path: Path | None) -> tuple[Path, ...]:
    """Return where the meshes of a robot's file look for packages, beside ROS's own folders, which Pinocchio adds."""
    return (*([search_path.resolve()] if search_path else []), *_upwards(path.parent))


def ros_directories() -> tuple[Path, ...]:
    """Return ROS's own folders in which Pinocchio looks for the packages of meshes."""
    folders = _entries("ROS_PACKAGE_PATH")
    above = [folder.parent for folder in folders if (folder / "package.xml").is_file()]
    return (*folders, *above, *(entry / "share" for entry in _entries("AMENT_PREFIX_PATH")))


def _in_package(address: str, folder: Path) -> Path:
    """Return the file behind ``package://NAME/PATH``: in a folder NAME beside or above `folder`, or where ROS looks."""
    name, _, inside = address.removeprefix(PACKAGE).partition("/")
    packages = [above / name for above in _upwards(folder)]
    for entry in _entries("ROS_PACKAGE_PATH"):
        packages += [entry / name, *([entry] if entry.name == name else [])]
    packages += [entry / "share" / name for entry in _entries("AMENT_PREFIX_PATH")]
    for package in packages:
        if name and inside and (package / inside).is_file():
            return (package / inside).resolve()
    raise RobotError(
        f"There is no file for '{address}': package:// is followed by the name of a folder and a path in it, and that "
        f"folder is looked for in {folder} and the folders above it, in ROS_PACKAGE_PATH, and below share/ in "
        "AMENT_PREFIX_PATH."
    )


def _upwards(folder: Path) -> list[Path]:
    return [folder, *folder.parents][:_SEARCHED_LEVELS]


def _entries(variable: str) -> list[Path]:
    return [Path(entry) for entry in os.environ.get(variable, "").split(os.pathsep) if entry]
