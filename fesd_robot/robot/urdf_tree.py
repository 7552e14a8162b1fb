"""Links and joints of a URDF file as one tree."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from fesd_robot.errors import RobotError, nearest

_DEEPEST = 1000
"""Links behind each other; the reader in C++ calls itself for each, and runs out of stack some thousands deeper."""


@dataclass(frozen=True)
class UrdfTree:
    """The links of a URDF file.

    Attributes:
        links: name -> element, every link behind its parent.
        joints: name of a link -> the joint that it hangs on, of all but the first.
    """

    links: Mapping[str, ElementTree.Element]
    joints: Mapping[str, ElementTree.Element]

    def parent(self, link: str) -> str:
        """Return the link that carries a link."""
        return _end(self.joints[link], "parent")


def read_tree(path: Path, root: ElementTree.Element) -> UrdfTree:
    """Return the tree of links of a file.

    Args:
        path: the file.
        root: its content, after `check_elements`.

    Raises:
        RobotError: for names that are there twice or nowhere, a link with two parents, a loop, and several first links.
    """
    links = {link.get("name", ""): link for link in root.findall("link")}
    for fault in _faults(root, links):
        raise RobotError(f"{path}: {fault}.")
    joints = {_end(joint, "child"): joint for joint in root.findall("joint")}
    children: dict[str, list[str]] = {name: [] for name in links}
    for child, joint in joints.items():
        children[_end(joint, "parent")].append(child)
    level, order, depth = [name for name in links if name not in joints], list[str](), 0
    while level:
        depth += 1
        order += level
        level = [child for name in level for child in children[name]]
    if depth > _DEEPEST:
        raise RobotError(f"{path}: found {depth} links behind each other, expected at most {_DEEPEST}.")
    return UrdfTree({name: links[name] for name in order}, joints)


def _faults(root: ElementTree.Element, links: Mapping[str, ElementTree.Element]) -> Iterator[str]:
    """Yield what keeps links and joints from being one tree, a sentence each."""
    if not links:
        yield "found no <link>, expected one at least"
    joints = root.findall("joint")
    for what, elements in (("link", root.findall("link")), ("joint", joints)):
        for name, count in Counter(element.get("name", "") for element in elements).items():
            if count > 1:
                yield f"found {count} {what}s called '{name}', expected one"
    carrier: dict[str, ElementTree.Element] = {}
    for joint in joints:
        name, parent, child = joint.get("name", ""), _end(joint, "parent"), _end(joint, "child")
        for end, link in (("parent", parent), ("child", child)):
            if link not in links:
                yield f"joint '{name}', <{end}> link: found '{link}', expected a link of the file{nearest(link, links)}"
        if parent == child:
            yield f"joint '{name}': found link '{parent}' as parent and child, expected two links"
        if child in carrier:
            yield (
                f"link '{child}' is the child of joints '{carrier[child].get('name')}' and '{name}', which closes a "
                "loop, expected a tree of joints; leave one of them out"
            )
        carrier[child] = joint
    yield from _loops(carrier)
    first = [name for name in links if name not in carrier]
    if len(first) > 1:
        yield (
            f"found {len(first)} links that are the child of no joint ({_listed(first)}), expected one, the robot's "
            "first"
        )


def _loops(carrier: Mapping[str, ElementTree.Element]) -> Iterator[str]:
    """Yield a sentence for a link that carries itself; every link has one joint that carries it at most."""
    safe: set[str] = set()
    for start in carrier:
        way: dict[str, None] = {}
        link = start
        while link in carrier and link not in safe:
            if link in way:
                ring = list(way)[list(way).index(link) :]
                names = _listed([carrier[each].get("name", "") for each in reversed(ring)])
                yield f"joints {names} close a loop, expected a tree of joints; leave one of them out"
                break
            way[link] = None
            link = _end(carrier[link], "parent")
        safe |= set(way)


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - 5} more" if len(names) > 5 else ""
    return ", ".join(f"'{name}'" for name in names[:5]) + more


def _end(joint: ElementTree.Element, which: str) -> str:
    element = joint.find(which)
    return "" if element is None else element.get("link", "")
