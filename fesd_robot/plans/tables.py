"""Tables in Markdown, and settings in a line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any


def markdown_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table, one line a row, each of as many cells as the header."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def settings_line(settings: Mapping[str, Any]) -> str:
    """Return names and values in a line, empty if there are none."""
    return ", ".join(f"{name} = {value}" for name, value in settings.items())
