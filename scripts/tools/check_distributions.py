"""Wheel and sdist hold what the repository does, and nothing else."""

from __future__ import annotations

import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path, PurePosixPath

import fesd_robot

ROOT = Path(__file__).parents[2]
LEFT_OUT = ("__pycache__", ".venv", "runs", "build", "dist", ".cache")
"""Folders that belong to a machine, not to a release."""

TOO_LARGE = 3e6
"""Bytes of a file in a distribution: a plan or a picture of a run that slipped in."""


def tracked() -> set[str]:
    """Return the files of the repository, as git lists them."""
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True)
    return set(listed.stdout.splitlines())


def faults_of_wheel(wheel: Path) -> list[str]:
    """Return what is wrong with a wheel, a sentence each.

    Args:
        wheel: the file.
    """
    with zipfile.ZipFile(wheel) as archive:
        sizes = {entry.filename: entry.file_size for entry in archive.infolist()}
    metadata = f"fesd_robot-{fesd_robot.__version__}.dist-info"
    expected = {file for file in tracked() if file.startswith("fesd_robot/")}
    expected |= {
        f"fesd_robot/examples/{file}" for file in tracked() if file.split("/")[0] in ("tasks", "models", "sweeps")
    }
    inside = {name for name in sizes if not name.startswith(metadata)}
    return [
        *(f"{name}: is in the repository, not in the wheel" for name in sorted(expected - inside)),
        *(f"{name}: is in the wheel, not in the repository" for name in sorted(inside - expected)),
        *_faults(sizes),
    ]


def faults_of_sdist(sdist: Path) -> list[str]:
    """Return what is wrong with an sdist, a sentence each.

    Args:
        sdist: the file.
    """
    with tarfile.open(sdist) as archive:
        sizes = {member.name.partition("/")[2]: member.size for member in archive.getmembers() if member.isfile()}
    made = {"PKG-INFO"}
    return [
        *(f"{name}: is in the repository, not in the sdist" for name in sorted(tracked() - set(sizes))),
        *(f"{name}: is in the sdist, not in the repository" for name in sorted(set(sizes) - tracked() - made)),
        *_faults(sizes),
    ]


def _faults(sizes: dict[str, int]) -> list[str]:
    return [
        *(f"{name}: belongs to a machine" for name in sizes if set(PurePosixPath(name).parts) & set(LEFT_OUT)),
        *(f"{name}: has {size} bytes, {TOO_LARGE:g} at most" for name, size in sizes.items() if size > TOO_LARGE),
    ]


def main(folder: Path) -> int:
    """Print what is wrong with the distributions of a folder; return the exit status.

    Args:
        folder: with one wheel and one sdist of this version.
    """
    version = fesd_robot.__version__
    wheel, sdist = folder / f"fesd_robot-{version}-py3-none-any.whl", folder / f"fesd_robot-{version}.tar.gz"
    missing = [f"{file}: is not there" for file in (wheel, sdist) if not file.is_file()]
    faults = missing or [*faults_of_wheel(wheel), *faults_of_sdist(sdist)]
    for fault in faults:
        print(fault)
    if not faults:
        print(f"{wheel.name}: {wheel.stat().st_size / 1e6:.1f} MB, {sdist.name}: {sdist.stat().st_size / 1e6:.1f} MB")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
