"""One web page about a sweep, which needs no network: success, cost, and a table that opens every plan."""

from __future__ import annotations

import html
import json
import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from importlib import resources
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from fesd_robot.errors import FesdRobotError
from fesd_robot.sweeps.comparison import Comparison, comparison
from fesd_robot.sweeps.folder import SWEEP_PAGE, SweepFolder, read_sweep
from fesd_robot.sweeps.order import Verdict
from fesd_robot.writing import write_atomically

MOST_ROWS = 20_000
"""Rows on the page; of more, every so manieth."""

_SHOWN = ("verdict", "cost", "work", "time", "flights", "slides", "iterations", "seconds", "memory", "start", "message")
_SCRIPTS = ("cells", "plots", "table", "page")


def write_sweep_page(folder: SweepFolder, against: Path | None = None) -> Path:
    """Write the page of a sweep into its folder.

    Args:
        folder: of the sweep, with its table.
        against: folder of a sweep with the same rows to compare with.

    Raises:
        OSError: it cannot be written.
    """
    record, count = folder.record, _counted(folder)
    every = max(1, math.ceil(sum(count.values()) / MOST_ROWS))
    rows = list(islice(folder.journal.rows(), 0, None, every))
    columns = ["number", *record.columns.inputs, *_SHOWN]
    told = {
        "inputs": list(record.columns.inputs),
        "columns": columns,
        "rows": [[_shown(row[name]) for name in columns] for row in rows],
        "pages": {row["number"]: page for row in rows if row["plan"] and (page := folder.page_of(row["number"]))},
    }
    words = [f"{sum(count.values())} of {record.total} plans", *(f"{number} {what}" for what, number in count.items())]
    page = _fill(
        title=html.escape(record.name),
        summary=html.escape(", ".join(words)),
        sweep=html.escape(json.dumps(record.told, indent=1)),
        comparison=_comparison(folder, rows, against),
        shown=f"<p>Every {every}th row is shown.</p>" if every > 1 else "",
        rows=json.dumps(told, separators=(",", ":"), default=str).replace("<", "\\u003c"),
    )
    return write_atomically(folder.folder / SWEEP_PAGE, page.encode())


def _counted(folder: SweepFolder) -> Counter[str]:
    return Counter(row["verdict"] for row in folder.journal.rows())


def _shown(value: Any) -> Any:
    """Return a value as it is shown: what is no number in JSON as nothing."""
    if isinstance(value, float):
        return float(f"{value:.8g}") if math.isfinite(value) else None
    return value


def _comparison(folder: SweepFolder, rows: Sequence[Mapping[str, Any]], against: Path | None) -> str:
    """Return what is told about rows that begin from others, and about another sweep."""
    parts = []
    if any(row["start"] is not None for row in rows):
        begun = [row for row in rows if row["start"] is not None]
        parts.append(
            f"<p>{len(begun)} of {len(rows)} plans begin from the solved plan of the nearest row: median "
            f"{_median(begun, 'iterations')} iterations and {_median(begun, 'seconds')} s; the others begin from the "
            f"task alone: {_median([row for row in rows if row['start'] is None], 'iterations')} iterations and "
            f"{_median([row for row in rows if row['start'] is None], 'seconds')} s.</p>"
        )
    if against is not None:
        try:
            other = read_sweep(against)
            parts.append(_table(comparison(rows, other.rows(), list(folder.record.columns.inputs)), against))
        except FesdRobotError as error:
            parts.append(f"<p>Not compared: {html.escape(str(error))}</p>")
    return "".join(parts)


def _median(rows: Iterable[Mapping[str, Any]], name: str) -> str:
    values = [row[name] for row in rows if row[name] is not None]
    return f"{np.median(values):.3g}" if values else "–"


def _table(found: Comparison, against: Path) -> str:
    lines = "".join(
        f"<tr><th>{html.escape(what)}</th><td>{html.escape(own)}</td><td>{html.escape(other)}</td></tr>"
        for what, own, other in found.lines()
    )
    head = f"<tr><th></th><th>this sweep</th><th>{html.escape(str(against))}</th></tr>"
    return f'<table id="comparison">{head}{lines}</table>'


def _fill(**values: str) -> str:
    """Return the page with its scripts, style and the given values in place."""
    uplot = resources.files("fesd_robot.render") / "viewer" / "uplot"
    here = resources.files("fesd_robot.sweeps") / "viewer"
    values |= {
        "bundle": (uplot / "uPlot.iife.min.js").read_text(encoding="utf-8").replace("</script", "<\\/script"),
        "licence": "uPlot\n" + (uplot / "LICENSE").read_text(encoding="utf-8").replace("</", "< /"),
        "style": "\n".join(
            file.read_text(encoding="utf-8").strip() for file in (uplot / "uPlot.min.css", here / "page.css")
        ),
        "script": "\n".join((here / f"{name}.js").read_text(encoding="utf-8").strip() for name in _SCRIPTS),
        "verdicts": json.dumps([verdict.value for verdict in Verdict]),
    }
    template = (here / "page.html").read_text(encoding="utf-8")
    return re.sub(r"\{\{(\w+)\}\}", lambda match: values[match.group(1)], template)
