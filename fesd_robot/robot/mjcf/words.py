"""A MuJoCo file before MuJoCo reads it, and MuJoCo's errors as sentences."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from fesd_robot.errors import RobotError
from fesd_robot.robot.xml_file import read_xml

_MOST_COPIES = 10_000
"""Bodies that one element may stand for; the compiler would work for hours, and take all memory."""

_COPIED = ("replicate", "composite", "flexcomp")

_PLACE = re.compile(r"^Element (?:name )?'([^']*)'(?:, id \d+)?, line (-?\d+)", re.MULTILINE)
"""Line of an error in which MuJoCo says where it is."""

_NO_INERTIA = "found a body that moves with no positive mass or inertia, expected <inertial> or <geom> with both"
_UNEQUAL = "found a moment of inertia larger than the sum of the others, expected none: no body has this inertia"
_NO_NUMBERS = r"found something else than numbers in '\1', expected numbers with a decimal point and without unit"

_PLAIN = (
    (r"Error opening file '([^']*)'", r"found no file \1, expected one"),
    (r"mass and inertia of moving bodies must be larger than mjMINVAL.*", _NO_INERTIA),
    (r"no decoder found for mesh file '([^']*)'.*", r"found mesh file \1, expected .stl, .obj or .msh"),
    (r"inertia must satisfy A \+ B >= C; use 'balanceinertia' to fix", _UNEQUAL),
    (r"unrecognized attribute: '([^']*)'", r"found an unknown attribute '\1', expected one of MuJoCo's"),
    (r"unrecognized element", "found an unknown element, expected one of MuJoCo's"),
    (r"bad format in attribute '([^']*)'", _NO_NUMBERS),
    (r"stl_decoder: .* in STL file '([^']*)'.*", r"found mesh file \1, expected a whole binary STL file"),
    (r"XML parse error .*", "found an included file that is no XML, expected XML"),
    (r"axis too small in joint", "found an axis without direction, expected one as 0 0 1"),
    (r"repeated name '([^']*)' in (\w+)", r"found the name '\1' twice, expected one \2 of this name"),
)
"""Errors of MuJoCo that users meet, and what they mean."""


def check_mjcf(path: Path) -> None:
    """Refuse a file that MuJoCo would misread, or never finish.

    Raises:
        RobotError: for letters in another encoding than UTF-8, and for an element that stands for too many bodies.
    """
    root = read_xml(path)
    try:
        path.read_bytes().decode()
    except UnicodeDecodeError as error:
        raise RobotError(f"{path}: found letters that are not in UTF-8, expected that encoding for MuJoCo.") from (
            error
        )
    copies = _copies(root)
    if copies > _MOST_COPIES:
        raise RobotError(f"{path}: found {copies:g} copies by <replicate> or alike, expected at most {_MOST_COPIES}.")


def _copies(element: ElementTree.Element) -> float:
    """Return the largest number of copies that elements inside each other ask for."""
    own = 1.0
    if element.tag in _COPIED:
        for number in element.get("count", "1").split():
            own *= float(number) if number.isdecimal() else 1.0
    return own * max((_copies(child) for child in element), default=1.0)


def in_one_sentence(text: str) -> str:
    """Return an error of MuJoCo as one sentence, the element and its line first, without the full stop."""
    place = _PLACE.search(text)
    said = text[: place.start()] if place else text
    said = re.sub(r"^(XML )?Error: (Schema violation: |Error: )?|ErrorID=.*? ", "", " ".join(said.split()))
    for found, plain in _PLAIN:
        said = re.sub(found, plain, said)
    said = said.rstrip(" .")
    if not place:
        return said
    name, line = place.groups()
    where = f"element '{name}'" if name else "an element"
    return f"{where} in line {line}: {said}" if int(line) > 0 else f"{where}: {said}"
