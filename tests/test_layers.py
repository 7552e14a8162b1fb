"""The rooms of the package stand on each other in one order."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import fesd_robot

SOURCES = Path(fesd_robot.__file__).parent

BELOW: dict[str, set[str]] = {
    "complementarity": set(),
    "native": set(),
    "robot": set(),
    "examples": set(),
    "task": {"examples"},
    "dcs": {"complementarity"},
    "mpcc": {"complementarity", "native"},
    "fesd": {"complementarity", "dcs", "mpcc"},
    "optimal_control": {"complementarity", "dcs", "fesd", "mpcc"},
    "contact": {"complementarity", "dcs", "robot"},
    "recovery": {"complementarity", "contact", "fesd", "robot"},
    "replay": {"recovery"},
    "plans": {"contact", "mpcc", "recovery", "replay", "robot", "task"},
    "ocp": {"complementarity", "contact", "dcs", "fesd", "plans", "robot", "task"},
    "explanation": {"adapters", "contact", "mpcc", "ocp", "plans", "recovery", "robot", "task"},
    "render": {"contact", "native", "ocp", "plans", "recovery", "robot", "task"},
    "simulation": {"adapters", "contact", "dcs", "fesd", "ocp", "plans", "recovery", "replay", "task"},
    "first_task": {"ocp", "robot", "task"},
    "strategies": {"mpcc", "plans", "task"},
    "phases": {"complementarity", "contact", "fesd", "mpcc", "ocp", "stepping", "strategies"},
}
"""Room -> the rooms it may use, besides `errors`, `lazy` and `orientations`; planner and commands may use all."""


def _imports(tree: ast.AST) -> Iterator[str]:
    """Yield the modules of this package that a file imports, also for types and inside functions."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("fesd_robot."):
            yield node.module
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.startswith("fesd_robot."))


@pytest.mark.parametrize("room", BELOW)
def test_a_room_uses_the_rooms_below_it_only(room: str) -> None:
    """No file of a room imports from a room above or beside it."""
    allowed = BELOW[room] | {room, "errors", "lazy", "orientations"}
    wrong = {
        f"{file.relative_to(SOURCES)}: {module}"
        for file in (SOURCES / room).rglob("*.py")
        for module in _imports(ast.parse(file.read_text(encoding="utf-8")))
        if module.split(".")[1] not in allowed
    }
    assert sorted(wrong) == []


def test_every_room_is_in_the_order() -> None:
    """A new room has to say what it stands on."""
    rooms = {folder.name for folder in SOURCES.iterdir() if (folder / "__init__.py").is_file()}
    assert rooms == {*BELOW, "cli"}


def test_the_table_of_the_architecture_is_this_order() -> None:
    """The documentation's column of what a room uses says what is tested here."""
    text = (SOURCES.parent / "docs" / "architecture.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)/` \|[^|]*\|([^|]*)\|$", text, re.MULTILINE)
    table = {room: set(re.findall(r"\w+", uses)) for room, uses in rows}
    assert table == BELOW
