"""The robots of the package example-robot-data, by name."""

from __future__ import annotations

import sys
from importlib import metadata
from pathlib import Path

from fesd_robot.errors import RobotError, nearest

PREFIX = "example-robot-data:"

INSTALL = "pip install 'fesd-robot[robots]'"
"""The extra with the robots, 400 MB with their meshes, which most users do not need."""

_FOLDER = Path("share/example-robot-data/robots")
_FILES = {
    "alex": "alex_description/urdf/alex_nub_hands.urdf",
    "anymal": "anymal_b_simple_description/robots/anymal.urdf",
    "anymal_b": "anymal_b_simple_description/robots/anymal.urdf",
    "anymal_c": "anymal_c_simple_description/urdf/anymal.urdf",
    "anymal_kinova": "anymal_b_simple_description/robots/anymal-kinova.urdf",
    "asr_twodof": "asr_twodof_description/urdf/TwoDofs.urdf",
    "b1_z1": "b1_description/urdf/b1-z1.urdf",
    "borinot": "borinot_description/urdf/borinot_flying_arm_2.urdf",
    "g1": "g1_description/urdf/g1_29dof_rev_1_0.urdf",
    "hector": "hector_description/robots/quadrotor_base.urdf",
    "hextilt": "hextilt_description/urdf/hextilt_flying_arm_5.urdf",
    "hyq": "hyq_description/robots/hyq_no_sensors.urdf",
    "iris": "iris_description/robots/iris_simple.urdf",
    "solo8": "solo_description/robots/solo.urdf",
    "talos": "talos_data/robots/talos_reduced.urdf",
    "talos_arm": "talos_data/robots/talos_left_arm.urdf",
    "talos_box": "talos_data/robots/talos_reduced_box.urdf",
    "talos_full": "talos_data/robots/talos_full_v2.urdf",
    "talos_full_box": "talos_data/robots/talos_full_v2_box.urdf",
    "ur3": "ur_description/urdf/ur3_robot.urdf",
    "ur3_limited": "ur_description/urdf/ur3_joint_limited_robot.urdf",
    "ur5": "ur_description/urdf/ur5_robot.urdf",
    "ur5_limited": "ur_description/urdf/ur5_joint_limited_robot.urdf",
    "ur10": "ur_description/urdf/ur10_robot.urdf",
    "ur10_limited": "ur_description/urdf/ur10_joint_limited_robot.urdf",
}
"""The names of example-robot-data's own loaders that are not simply the name of a file."""


def example_robots() -> dict[str, Path]:
    """Return the names that ``example-robot-data:NAME`` accepts, each with its file, sorted.

    A name is that of a file without its suffix, or one of the names used by the loaders of example-robot-data.

    Raises:
        RobotError: if the package example-robot-data is not installed.
    """
    folder = examples_folder()
    names = {stem: paths[0] for stem, paths in _files_by_stem(folder).items() if len(paths) == 1}
    names |= {name: folder / path for name, path in _FILES.items() if (folder / path).is_file()}
    return dict(sorted(names.items()))


def resolve_example(name: str) -> Path:
    """Return the file of an example robot, given by name or by its path below the data's ``robots`` folder.

    Raises:
        RobotError: for an unknown name, with the nearest valid one; for an ambiguous one, with the choices.
    """
    robots = example_robots()
    if name in robots:
        return robots[name]
    folder = examples_folder()
    choices = [path.relative_to(folder).as_posix() for path in _files_by_stem(folder).get(name, [])]
    if choices:
        raise RobotError(f"Robot '{name}' of example-robot-data is ambiguous; write one of {', '.join(choices)}.")
    if name and (folder / name).is_file():
        return folder / name
    raise RobotError(f"There is no robot '{name}' in example-robot-data{nearest(name, robots)}.")


def examples_folder() -> Path:
    """Return the folder that holds the robots, as installed by a wheel or by a conda package.

    Raises:
        RobotError: if the package example-robot-data is not installed.
    """
    candidates = [Path(sys.prefix) / _FOLDER]
    try:
        distribution = metadata.distribution("example-robot-data")
        candidates.insert(0, Path(str(distribution.locate_file("cmeel.prefix"))) / _FOLDER)
    except metadata.PackageNotFoundError:
        pass
    for candidate in candidates:
        if candidate.is_dir():
            return candidate
    raise RobotError(f"The robots of example-robot-data are not installed; run: {INSTALL}.")


def _files_by_stem(folder: Path) -> dict[str, list[Path]]:
    files: dict[str, list[Path]] = {}
    for path in sorted([*folder.glob("*/*/*.urdf"), *folder.glob("*/*/*.sdf")]):
        files.setdefault(path.stem, []).append(path)
    return files
