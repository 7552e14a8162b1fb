"""Tables in Markdown, and settings in a line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from fesd_robot.printable import visible


def markdown_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table, one line a row, each of as many cells as the header, texts that may have a | or a tag in them."""
    lines = [[_cell(text) for text in line] for line in (header, *rows)]
    lines.insert(1, ["---"] * len(header))
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def _cell(text: str) -> str:
    return visible(text).replace("|", "\\|").replace("<", "&lt;")


def settings_line(settings: Mapping[str, Any]) -> str:
    """Return names and values in a line, empty if there are none."""
    return ", ".join(f"{name} = {value}" for name, value in settings.items())
