"""The limits of joints in a URDF file: those that contradict themselves, and those that it leaves out."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path

from fesd_robot.errors import RobotError

_RANGED = ("revolute", "prismatic")
"""Types of joints with a lower and an upper limit."""

_SIZES = ("effort", "velocity")
"""Limits of a size, on both sides of zero."""


def check_limits(path: Path, root: ElementTree.Element) -> None:
    """Refuse limits that nothing can keep.

    Raises:
        RobotError: lower > upper, or a negative limit of effort or velocity; names the joint.
    """
    for name, kind, limit in _limited(root):
        if kind in _RANGED:
            lower, upper = _number(limit, "lower"), _number(limit, "upper")
            if lower > upper:
                raise RobotError(
                    f"{path}: found limits [{lower:g}, {upper:g}] of joint '{name}', lower > upper, expected lower <= "
                    "upper."
                )
        for key in _SIZES:
            if _number(limit, key) < 0:
                raise RobotError(
                    f"{path}: found {key} {_number(limit, key):g} in the <limit> of joint '{name}', expected a number "
                    "of at least 0."
                )


def missing_ranges(root: ElementTree.Element) -> dict[str, str]:
    """Return the joints to which a file does not give both ends of their range, each with a sentence."""
    found = {}
    for name, kind, limit in _limited(root):
        missing = [end for end in ("lower", "upper") if limit.get(end) is None]
        if kind in _RANGED and missing:
            taken = f"[{_number(limit, 'lower'):g}, {_number(limit, 'upper'):g}]"
            what = "range" if len(missing) == 2 else f"{missing[0]} limit"
            found[name] = (
                f"The file gives '{name}' no {what}, which URDF takes as {taken}; limits.position.{name} gives it one."
            )
    return found


def unread_ranges(root: ElementTree.Element) -> list[str]:
    """Return a sentence for every range of a continuous joint, which has none."""
    return [
        f"The range of the continuous joint '{name}' is not read: [{limit.get('lower')}, {limit.get('upper')}] rad."
        for name, kind, limit in _limited(root)
        if kind == "continuous" and _number(limit, "lower") < _number(limit, "upper")
    ]


def _limited(root: ElementTree.Element) -> Iterator[tuple[str, str, ElementTree.Element]]:
    """Yield name, type and <limit> of every joint that has one."""
    for joint in root.findall("joint"):
        limit = joint.find("limit")
        if limit is not None and joint.get("type") != "fixed":
            yield joint.get("name", ""), joint.get("type", ""), limit


def _number(limit: ElementTree.Element, key: str) -> float:
    """Return a limit, 0 where the file has none as in URDF, NaN where it is no number."""
    try:
        return float(limit.get(key, "0"))
    except ValueError:
        return math.nan
