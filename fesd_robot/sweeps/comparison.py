"""Two sweeps with the same rows beside each other."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fesd_robot.errors import SweepError
from fesd_robot.sweeps.order import Verdict

SAME_COST = 1e-6
"""Part of the cost up to which two costs are one."""

_Row = Mapping[str, Any]


@dataclass(frozen=True)
class Comparison:
    """Rows that two sweeps have in common.

    Args:
        pairs: the row of the first and that of the second.
    """

    pairs: Sequence[tuple[_Row, _Row]]

    @property
    def changes(self) -> np.ndarray:
        """Cost of the first over that of the second, less one, of rows that both solve."""
        both = [pair for pair in self.pairs if all(row["verdict"] == Verdict.SOLVED for row in pair)]
        costs = np.array([[own["cost"], other["cost"]] for own, other in both]).reshape(-1, 2)
        return np.asarray((costs[:, 0] - costs[:, 1]) / np.maximum(np.abs(costs[:, 1]), 1e-300))

    def lines(self) -> list[tuple[str, str, str]]:
        """Return what is compared, and both values in words."""
        own, other = zip(*self.pairs, strict=True) if self.pairs else ((), ())
        changes = self.changes
        return [
            ("rows in common", str(len(own)), str(len(other))),
            ("solved", _share(own), _share(other)),
            ("median iterations", _median(own, "iterations"), _median(other, "iterations")),
            ("median seconds", _median(own, "seconds"), _median(other, "seconds")),
            ("total seconds", _sum(own), _sum(other)),
            ("cheaper", str(int((changes < -SAME_COST).sum())), str(int((changes > SAME_COST).sum()))),
            ("median cost above the other's", f"{100 * np.median(changes):.2g} %" if len(changes) else "–", ""),
            ("largest cost above the other's", f"{100 * changes.max():.2g} %" if len(changes) else "–", ""),
        ]


def comparison(rows: Iterable[_Row], others: Iterable[_Row], inputs: Sequence[str]) -> Comparison:
    """Return the rows of two sweeps that have the same values.

    Args:
        rows, others: of both.
        inputs: keys of the values.

    Raises:
        SweepError: they have no row in common.
    """

    def key(row: _Row) -> str:
        if any(name not in row for name in inputs):
            raise SweepError(f"found a sweep of other keys, expected one over {', '.join(inputs)}")
        return json.dumps([row[name] for name in inputs])

    known = {key(row): row for row in others}
    pairs = [(row, known[own]) for row in rows if (own := key(row)) in known]
    if not pairs:
        raise SweepError("found a sweep without a row that has the same values, expected some")
    return Comparison(pairs)


def _share(rows: Sequence[_Row]) -> str:
    solved = sum(row["verdict"] == Verdict.SOLVED for row in rows)
    return f"{solved} ({100 * solved / max(len(rows), 1):.0f} %)"


def _sum(rows: Sequence[_Row]) -> str:
    return f"{sum(row['seconds'] or 0.0 for row in rows):.0f}"


def _median(rows: Sequence[_Row], name: str) -> str:
    values = [row[name] for row in rows if row[name] is not None]
    return f"{np.median(values):.4g}" if values else "–"
