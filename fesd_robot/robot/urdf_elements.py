"""Elements, attributes and numbers of a URDF file, held against what URDF has.

The reader in C++ leaves out an element that it does not understand, and goes on.
"""

from __future__ import annotations

import difflib
import math
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from fesd_robot.errors import RobotError, number_hint

JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")

_VERSIONS = ("1.0", "1.1", "1.2")

_READ_AS = "1.1"
"""Version from which on capsules and quaternions are read."""

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", re.ASCII)

_LARGEST = 1e9
"""m, kg, kg m² or rad; a robot has none above."""

_ROUNDED_INERTIA = 1e-12
"""kg m²; inertias of bodies that were added up may be this far below zero."""

_CLOSE = 0.8
"""Likeness of two names from which on one is the other misspelled."""


@dataclass(frozen=True)
class _Element:
    """An element of URDF.

    Attributes:
        numbers: attribute -> how many numbers it holds.
        texts: the other attributes.
        needed: attributes and elements that must be there.
        once, often: elements inside that may be there once, or several times.
        positive: whether its numbers are sizes, which are not negative.
        bounded: whether its numbers are in a range with which one can compute; limits may be far away instead.
    """

    numbers: Mapping[str, int] = field(default_factory=dict)
    texts: tuple[str, ...] = ()
    needed: tuple[str, ...] = ()
    once: Mapping[str, _Element] = field(default_factory=dict)
    often: Mapping[str, _Element] = field(default_factory=dict)
    positive: bool = False
    bounded: bool = True


MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
"""Attributes of an inertia."""

_ORIGIN = _Element({"xyz": 3, "rpy": 3, "quat_xyzw": 4})
_INERTIAL = _Element(
    needed=("mass", "inertia"),
    once={
        "origin": _ORIGIN,
        "mass": _Element({"value": 1}, needed=("value",)),
        "inertia": _Element(dict.fromkeys(MOMENTS, 1), needed=MOMENTS),
    },
)
_ROUND = _Element({"radius": 1, "length": 1}, needed=("radius", "length"), positive=True)
_SHAPES = {
    "box": _Element({"size": 3}, needed=("size",), positive=True),
    "sphere": _Element({"radius": 1}, needed=("radius",), positive=True),
    "cylinder": _ROUND,
    "capsule": _ROUND,
    "mesh": _Element({"scale": 3}, texts=("filename",), needed=("filename",)),
}
_COLOR = _Element({"rgba": 4}, needed=("rgba",))
_MATERIAL = _Element(texts=("name",), once={"color": _COLOR, "texture": _Element(texts=("filename",))})
_SHAPE = {"origin": _ORIGIN, "geometry": _Element(once=_SHAPES)}
_LINK = _Element(
    texts=("name",),
    once={"inertial": _INERTIAL},
    often={
        "visual": _Element(texts=("name",), needed=("geometry",), once={**_SHAPE, "material": _MATERIAL}),
        "collision": _Element(texts=("name",), needed=("geometry",), once=_SHAPE),
    },
)
_JOINT = _Element(
    texts=("name", "type"),
    needed=("parent", "child"),
    once={
        "origin": _ORIGIN,
        "parent": _Element(texts=("link",), needed=("link",)),
        "child": _Element(texts=("link",), needed=("link",)),
        "axis": _Element({"xyz": 3}, needed=("xyz",)),
        "limit": _Element(
            dict.fromkeys(("lower", "upper", "effort", "velocity"), 1),
            needed=("effort", "velocity"),
            bounded=False,
        ),
        "dynamics": _Element({"damping": 1, "friction": 1}),
        "mimic": _Element({"multiplier": 1, "offset": 1}, texts=("joint",), needed=("joint",)),
        "calibration": _Element({"rising": 1, "falling": 1}),
        "safety_controller": _Element(
            dict.fromkeys(("soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity"), 1),
            needed=("k_velocity",),
            bounded=False,
        ),
    },
)
_ROBOT = {"link": _LINK, "joint": _JOINT, "material": _MATERIAL}


def check_elements(path: Path, root: ElementTree.Element) -> None:
    """Refuse what the reader of URDF files would leave out, and write all numbers as it reads them.

    Blanks around numbers, which it does not understand, are taken away; capsules and quaternions, which it knows in
    files of version 1.1, are read in all.

    Args:
        path: the file.
        root: its content; numbers are written anew.

    Raises:
        RobotError: for an element or attribute that is missing, there twice or misspelled, and for what is no number;
            names link or joint, element and attribute.
    """
    version = root.get("version", "1.0").strip()
    if version not in _VERSIONS:
        raise RobotError(f"{path}: <robot> version: found '{version}', expected one of {', '.join(_VERSIONS)}.")
    root.set("version", max(version, _READ_AS))
    if not root.get("name"):
        raise RobotError(f"{path}: <robot>: found no name, expected one.")
    for fault in _faults(root):
        raise RobotError(f"{path}: {fault}.")


_SIZES = {"box": ("size",), "sphere": ("radius",), "cylinder": ("radius", "length"), "capsule": ("radius", "length")}


def longest_shape(root: ElementTree.Element) -> float:
    """Return the length of the longest shape of a file after `check_elements` without its meshes, m."""
    sizes = [
        float(part)
        for geometry in root.iterfind("link/*/geometry")
        for shape in geometry
        for key in _SIZES.get(_tag(shape), ())  # an attribute of another shape is nothing that was checked
        for part in shape.get(key, "").split()
    ]
    return max(sizes, default=0.0)


def _faults(root: ElementTree.Element) -> Iterator[str]:
    numbered = dict.fromkeys(_ROBOT, 0)
    for element in root:
        tag = _tag(element)
        if tag not in _ROBOT:
            yield from _misspelled(f"<{tag}>", tag, [f"<{known}>" for known in _ROBOT])
            continue
        numbered[tag] += 1
        name = element.get("name")
        if not name and tag != "material":
            yield f"<{tag}> number {numbered[tag]}: found no name, expected one"
        yield from _faults_of(f"{tag} '{name}'", "", element, _ROBOT[tag])
        yield from _faults_of_inertia(name, element) if tag == "link" else ()
        yield from _faults_of_joint(name, element) if tag == "joint" else ()


def _faults_of(owner: str, inside: str, element: ElementTree.Element, known: _Element) -> Iterator[str]:
    """Yield what is wrong with an element, a sentence each.

    Args:
        owner: the link, joint or material.
        inside: the elements between, as ``<inertial>``.
        element: to look at.
        known: what URDF says of it.
    """
    place = f"{owner}, {inside}" if inside else owner
    children, inner = {**known.once, **known.often}, [_tag(child) for child in element]
    for name in known.needed:
        if name not in children and name not in element.attrib:
            yield f"{place}: found no {name}, expected {_amount(known.numbers.get(name))}"
        if name in children and name not in inner:
            yield f"{place}: found no <{name}>, expected one"
    for name in element.attrib:
        if name in known.numbers:
            yield from _faults_of_numbers(f"{place} {name}", element, name, known)
        elif name not in known.texts:
            yield from _misspelled(f"{place}: {name}", name, [*known.numbers, *known.texts])
    for tag in dict.fromkeys(inner):
        if tag not in children:
            yield from _misspelled(f"{place}: <{tag}>", tag, [f"<{name}>" for name in children])
        if tag in known.once and inner.count(tag) > 1:
            yield f"{place}: found {inner.count(tag)} times <{tag}>, expected one"
    for child, tag in zip(element, inner, strict=True):
        if tag in children:
            yield from _faults_of(owner, f"{inside}<{tag}>", child, children[tag])
        elif _tag(element) == "geometry":
            yield f"{place}: found <{tag}>, expected one of {', '.join(f'<{name}>' for name in children)}"
    if _tag(element) == "geometry" and len(inner) != 1:
        yield f"{place}: found {len(inner) or 'no'} shapes, expected one"


def _faults_of_numbers(place: str, element: ElementTree.Element, name: str, known: _Element) -> Iterator[str]:
    parts, count = element.get(name, "").split(), known.numbers[name]
    wrong = next((part for part in parts if not _NUMBER.fullmatch(part)), None)
    found = f"{place}: found '{_short(element.get(name, ''))}', expected"
    if wrong is not None and wrong.strip("+-").lower() in ("nan", "inf", "infinity"):
        yield f"{found} {_amount(count, 'finite ')}"
    elif wrong is not None:
        yield f"{found} {_amount(count)}{number_hint(' '.join(parts) if count == 1 else wrong)}"
    elif len(parts) != count:
        yield f"{found} {_amount(count)}"
    elif not all(math.isfinite(float(part)) for part in parts):
        yield f"{found} {_amount(count, 'finite ')}"
    elif known.bounded and any(abs(float(part)) > _LARGEST for part in parts):
        yield f"{found} {_amount(count)} up to {_LARGEST:g}"
    elif known.positive and any(float(part) < 0 for part in parts):
        yield f"{found} {_amount(count)} of at least 0"
    elif name == "scale" and any(float(part) == 0 for part in parts):
        yield f"{found} {_amount(count)} other than 0"
    else:
        element.set(name, " ".join(parts))


def _faults_of_joint(name: str | None, joint: ElementTree.Element) -> Iterator[str]:
    kind = joint.get("type")
    if kind is None:
        yield f"joint '{name}': found no type, expected one of {', '.join(JOINT_TYPES)}"
    elif kind not in JOINT_TYPES:
        yield f"joint '{name}': found type '{kind}', expected one of {', '.join(JOINT_TYPES)}"
    axis = joint.find("axis")
    if kind not in ("fixed", "floating") and axis is not None and not any(map(float, axis.get("xyz", "").split())):
        yield f"joint '{name}', <axis> xyz: found '{axis.get('xyz')}', expected a direction, as 0 0 1"
    if kind in ("revolute", "prismatic") and joint.find("limit") is None:
        yield f"joint '{name}': found no <limit>, expected one for a {kind} joint"


def _faults_of_inertia(name: str | None, link: ElementTree.Element) -> Iterator[str]:
    for mass in link.iterfind("inertial/mass"):
        if float(mass.get("value", "")) < 0:
            yield f"link '{name}', <inertial><mass> value: found {mass.get('value')}, expected a number of at least 0"
    for moments in link.iterfind("inertial/inertia"):
        for key in ("ixx", "iyy", "izz"):
            if float(moments.get(key, "")) < -_ROUNDED_INERTIA:
                yield (
                    f"link '{name}', <inertial><inertia> {key}: found {moments.get(key)}, expected at least 0: no body "
                    "has this inertia"
                )


def _tag(element: ElementTree.Element) -> str:
    return element.tag if isinstance(element.tag, str) else ""


def _misspelled(place: str, name: str, known: list[str]) -> Iterator[str]:
    """Yield a sentence if an unknown name is close to a known one; others belong to other programs."""
    plain = {each.strip("<>"): each for each in known}
    for close in difflib.get_close_matches(name.lower(), plain, n=1, cutoff=_CLOSE):
        what = "element" if plain[close] != close else "attribute"
        yield f"{place}: found an unknown {what}, expected a known one (did you mean '{plain[close]}'?)"


def _amount(count: int | None, kind: str = "") -> str:
    if count is None:
        return "a name"
    return f"{count} {kind}numbers" if count > 1 else f"a {kind}number"


def _short(text: str) -> str:
    return text if len(text) <= 60 else f"{text[:57]}..."
