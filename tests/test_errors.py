"""Errors are part of the interface: what goes wrong is said by an exception of this package."""

from __future__ import annotations

import ast
import builtins
from collections.abc import Iterator
from pathlib import Path

import fesd_robot

SOURCES = Path(fesd_robot.__file__).parent

ALLOWED = {
    ("cli/interrupts.py", "KeyboardInterrupt"): "what Ctrl-C is",
    ("dcs/checks.py", "TypeError"): "caught by the function that raises it",
    ("lazy.py", "AttributeError"): "asked for by PEP 562",
    ("plans/record.py", "ValueError"): "asked for by pydantic, becomes a PlanFileError with file and key",
    (
        "plans/results_folder.py",
        "NotADirectoryError",
    ): "caught as what cannot be written by the function that raises it",
    ("render/window.py", "NotImplementedError"): "a method of Meshcat's window that a page cannot have",
    ("writing.py", "FileNotFoundError"): "that of the operating system, for a folder that is gone",
}
"""(file, exception) -> why it may be raised although it is none of this package's."""

OTHERS = SOURCES / "render/meshcat"
"""Meshcat's own code, unchanged."""


def _raised(tree: ast.AST) -> Iterator[str]:
    """Yield the names of the built-in exceptions that are raised."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Raise) and node.exc is not None:
            error = node.exc.func if isinstance(node.exc, ast.Call) else node.exc
            if isinstance(error, ast.Name) and hasattr(builtins, error.id):
                yield error.id


def test_only_errors_of_this_package_are_raised() -> None:
    """Built-in exceptions are raised in the places listed above with a reason, and nowhere else."""
    raised = {
        (file.relative_to(SOURCES).as_posix(), name)
        for file in SOURCES.rglob("*.py")
        if OTHERS not in file.parents
        for name in _raised(ast.parse(file.read_text(encoding="utf-8")))
    }
    assert sorted(raised) == sorted(ALLOWED)
