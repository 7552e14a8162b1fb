"""XML files of robots, read in the encoding that they declare."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path

from fesd_robot.errors import RobotError

LARGEST = 100_000_000
"""Bytes of an XML file of a robot; those of humanoids have a million."""

_DEEPEST = 450
"""Elements inside each other; the readers in C++ give up at 500."""


def read_xml(path: Path) -> ElementTree.Element:
    """Return the first element of an XML file, whatever encoding it declares.

    Raises:
        RobotError: for a file that is no XML, too large, or in an encoding that Python does not know.
    """
    try:
        size = path.stat().st_size
        if size > LARGEST:
            raise RobotError(f"{path}: found {size / 1e6:.0f} MB, expected at most {LARGEST / 1e6:.0f} MB.")
        root = ElementTree.parse(path).getroot()
    except OSError as error:
        raise RobotError(f"{path} cannot be read: {error.strerror}.") from error
    except (ElementTree.ParseError, UnicodeDecodeError) as error:
        raise RobotError(f"{path} is not an XML file: {error}.") from error
    except (LookupError, ValueError) as error:  # of the declared encoding
        raise RobotError(
            f"{path} cannot be read: found an encoding that is not known ({error}), expected UTF-8."
        ) from (error)
    _check_depth(path, root)
    return root


def _check_depth(path: Path, root: ElementTree.Element) -> None:
    level, depth = [root], 0
    while level:
        depth += 1
        if depth > _DEEPEST:
            raise RobotError(f"{path}: found elements inside each other {depth} deep, expected at most {_DEEPEST}.")
        level = [child for element in level for child in element]


def xml_text(root: ElementTree.Element) -> str:
    """Return an element as text, without comments and declaration, for readers that know UTF-8 only."""
    return ElementTree.tostring(root, encoding="unicode")
