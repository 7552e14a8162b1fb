"""Mesh files of a URDF file, looked at before a reader in C++ gets them."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import coal
import numpy as np

from fesd_robot.errors import RobotError
from fesd_robot.robot.paths import ros_directories

LARGEST = 50_000_000
"""Bytes of a mesh file; a scanned hall has fewer."""

_BEGINNING = 65_536
"""Bytes in which a file says what it is."""

_STL_HEADER, _STL_COUNT, _STL_TRIANGLE = 80, 4, 50
"""Bytes of a binary STL file: header, number of triangles, every triangle."""

_SIGNATURES = {".dae": (b"<COLLADA", b":COLLADA"), ".obj": (b"v ", b"v\t")}
"""Ending -> what the beginning of such a file has, one of them."""

_WHOLE, _REAL = re.compile(r"[\d\s]*", re.ASCII), re.compile(r"[-+.\deE\s]*", re.ASCII)
_COLLADA_NUMBERS = {
    **dict.fromkeys(("p", "h", "v", "vcount"), _WHOLE),
    **dict.fromkeys(("float_array", "matrix", "translate", "rotate", "scale", "skew", "lookat"), _REAL),
}
"""Element of Collada -> what its text is made of."""

FORMATS = (".stl", *_SIGNATURES)
"""Endings of mesh files that are read; the reader of others, as PLY, does not survive files that are cut off."""


def check_meshes(path: Path, document: ElementTree.Element, kind: str, directories: Sequence[Path]) -> None:
    """Look at the files of all meshes of a URDF file.

    Args:
        path: the URDF file.
        document: its content.
        kind: ``visual`` or ``collision``.
        directories: where addresses begin, in the order in which they are looked for.

    Raises:
        RobotError: for a mesh that is missing, no mesh or cut off; names its link.
    """
    for place, mesh in _meshes(path, document, kind):
        for fault in _faults_of(mesh, directories):
            raise RobotError(f"{place}: {fault}.")


def find_damaged(path: Path, document: ElementTree.Element, kind: str, directories: Sequence[Path]) -> None:
    """Read meshes one by one until one cannot be read.

    Args:
        path, document, kind, directories: as for `check_meshes`, after it.

    Raises:
        RobotError: for a mesh that cannot be read, or is not one; names its link.
    """
    loader = coal.MeshLoader(coal.NODE_TYPE.BV_OBBRSS)
    for place, mesh in _meshes(path, document, kind):
        address = _address_of(mesh.get("filename", ""), directories)
        scale = np.array([float(number) for number in mesh.get("scale", "1 1 1").split()])
        try:
            read = loader.load(address, scale)
        except Exception as error:  # of the reader in C++, with the place in its source
            kind_of_file = Path(address).suffix[1:].upper()
            raise RobotError(f"{place}: found a file that is damaged or no {kind_of_file}, expected a mesh.") from error
        if not is_mesh(read):
            raise RobotError(f"{place}: found no triangles, or corners that are not finite, expected a mesh.")


def is_mesh(geometry: Any) -> bool:
    """Return whether a shape of coal has triangles and finite corners, if it is a mesh."""
    if not isinstance(geometry, coal.BVHModelBase):
        return True
    return geometry.num_tris > 0 and bool(np.isfinite(np.array(geometry.vertices())).all())


def _meshes(path: Path, document: ElementTree.Element, kind: str) -> Iterator[tuple[str, ElementTree.Element]]:
    """Yield file, link and address of every mesh, as text, and its element."""
    for link in document.iterfind("link"):
        for mesh in link.iterfind(f"{kind}/geometry/mesh"):
            yield f"{path}: link '{link.get('name')}', mesh {mesh.get('filename')}", mesh


def _address_of(address: str, directories: Sequence[Path]) -> str:
    """Return the file of an address as Pinocchio finds it."""
    scheme, separator, place = address.rpartition("://")
    if separator and scheme not in ("package", "model", "file"):
        raise RobotError(f"found an address that begins with {scheme}://, expected package://, file:// or a path")
    if scheme == "file" or (not separator and Path(place).is_absolute()):
        return place
    for directory in (*directories, *ros_directories()):
        if (directory / place).exists():
            return str(directory / place)
    raise RobotError(f"found no such file in {directories[0]}, its parents and the folders of ROS, expected one")


def _faults_of(mesh: ElementTree.Element, directories: Sequence[Path]) -> Iterator[str]:
    """Yield why the file of a mesh cannot be one."""
    try:
        yield from _faults(Path(_address_of(mesh.get("filename", ""), directories)))
    except RobotError as error:
        yield str(error)


def _faults(file: Path) -> Iterator[str]:
    if not file.is_file():
        yield "found no file of this name, expected one" if not file.exists() else "found a folder, expected a file"
    suffix = file.suffix.lower()
    if suffix not in FORMATS:
        yield f"found a file that ends in '{file.suffix}', expected one of {', '.join(FORMATS)}"
    size = file.stat().st_size
    if size > LARGEST:
        yield f"found {size / 1e6:.0f} MB, expected at most {LARGEST / 1e6:.0f} MB"
    try:
        with file.open("rb") as stream:
            beginning = stream.read(_BEGINNING)
            stream.seek(max(0, size - _BEGINNING))
            end = stream.read(_BEGINNING)
    except OSError as error:
        yield f"cannot be read ({error.strerror})"
        return
    if suffix == ".stl":
        yield from _faults_of_stl(beginning, end, size)
    elif not any(sign in beginning for sign in _SIGNATURES[suffix]):
        yield f"found a file that is no {suffix[1:].upper()}, expected a mesh"
    elif suffix == ".dae":
        yield from _faults_of_collada(file)


def _faults_of_collada(file: Path) -> Iterator[str]:
    """Yield where a Collada file has something else than numbers; its reader in C++ waits for them for ever."""
    try:
        for _, element in ElementTree.iterparse(file):
            tag = element.tag.rpartition("}")[2]
            if tag in _COLLADA_NUMBERS and not _COLLADA_NUMBERS[tag].fullmatch(element.text or ""):
                yield f"found something else than numbers in <{tag}>, expected numbers"
                return
            element.clear()
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        yield f"found a Collada file that is cut off or damaged ({error}), expected a whole one"


def _faults_of_stl(beginning: bytes, end: bytes, size: int) -> Iterator[str]:
    header = _STL_HEADER + _STL_COUNT
    claimed = int.from_bytes(beginning[_STL_HEADER:header], "little")
    if size >= header and size == header + _STL_TRIANGLE * claimed:
        return
    if beginning.lstrip().lower().startswith(b"solid") and b"facet" in beginning:
        if b"endsolid" not in end.lower():
            yield "found an STL file that is cut off, expected 'endsolid' at its end"
    elif size < header:
        yield "found a file that is no STL, expected a mesh"
    elif size < header + _STL_TRIANGLE * claimed:
        yield (
            f"found an STL file that is cut off or no STL, with {(size - header) // _STL_TRIANGLE} of {claimed} "
            "triangles, expected all"
        )
