"""Rows of text with aligned columns."""

from __future__ import annotations

from collections.abc import Sequence


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the rows with their columns aligned to the left, two blanks apart."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(f"{entry:<{width}}" for entry, width in zip(row, widths, strict=True)).rstrip() for row in rows]


def indented(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the rows with their columns aligned, indented by two."""
    return ["  " + row for row in aligned(rows)]
