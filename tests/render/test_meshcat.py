"""The parts of Meshcat that lie in this package: alone, and with their licences."""

from __future__ import annotations

import ast
from pathlib import Path

import fesd_robot
from fesd_robot.render import page

SOURCES = Path(fesd_robot.__file__).parent


def test_the_package_of_meshcat_is_not_needed() -> None:
    """No file imports `meshcat`, which would bring a server with it; its parts are in `fesd_robot.render.meshcat`."""
    for file in SOURCES.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) and not node.level else []
            names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            assert not any(name.split(".")[0] == "meshcat" for name in names), file


def test_licences_are_with_it_and_in_pages() -> None:
    """Those of the Python parts and of the viewer, with what that contains."""
    assert "MIT License" in (page.VIEWER.parent / "LICENSE.txt").read_text(encoding="utf-8")
    names = {file.name for file in page.VIEWER.glob("*LICENSE*")}
    assert names == {"LICENSE", "main.min.js.LICENSE.txt", "main.min.js.THIRD_PARTY_LICENSES.json"}
