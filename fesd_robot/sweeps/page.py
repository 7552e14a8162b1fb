"""One web page about a sweep, which needs no network: success, cost, and a table that opens every plan."""

from __future__ import annotations

import html
import json
import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping
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

MOST_ROWS = 10_000
"""Rows on the page; of more, every so manieth."""

_SHOWN = ("verdict", "cost", "work", "time", "flights", "slides", "iterations", "seconds", "memory", "start",
          "abandoned", "message")  # fmt: skip
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
    columns = ["number", *record.columns.inputs, *_SHOWN]
    rows, pages = list[list[Any]](), dict[int, str]()
    for row in islice(folder.journal.rows(), 0, None, every):
        rows.append([_shown(row[name]) for name in columns])
        if row["plan"] and (page := folder.page_of(row["number"])):
            pages[row["number"]] = page
    told = {"inputs": list(record.columns.inputs), "columns": columns, "rows": rows, "pages": pages}
    words = [f"{sum(count.values())} of {record.total} plans", *(f"{number} {what}" for what, number in count.items())]
    text = _fill(
        title=html.escape(record.name),
        summary=html.escape(", ".join(words)),
        sweep=html.escape(json.dumps(record.told, indent=1)),
        comparison=_continuation(folder.journal.rows()) + (_compared(folder, against) if against else ""),
        shown=f"<p>Every {every}th row is shown.</p>" if every > 1 else "",
        rows=json.dumps(told, separators=(",", ":"), default=str).replace("<", "\\u003c"),
    )
    return write_atomically(folder.folder / SWEEP_PAGE, text.encode())


def _counted(folder: SweepFolder) -> Counter[str]:
    return Counter(row["verdict"] for row in folder.journal.rows())


def _shown(value: Any) -> Any:
    """Return a value as it is shown: what is no number in JSON as nothing."""
    if isinstance(value, float):
        return float(f"{value:.8g}") if math.isfinite(value) else None
    return value


def _continuation(rows: Iterable[Mapping[str, Any]]) -> str:
    """Return what plans that begin from the nearest row took, those that did so in vain, and the others, if any did."""
    taken: dict[str, list[tuple[int, float]]] = {"start": [], "abandoned": [], "": []}
    for row in rows:
        if row["iterations"] is not None:
            kind = next((name for name in ("start", "abandoned") if row[name] is not None), "")
            taken[kind].append((row["iterations"], row["seconds"]))
    begun, vain, alone = taken["start"], taken["abandoned"], taken[""]
    if not begun and not vain:
        return ""
    return (
        f"<p>{len(begun)} of {len(begun) + len(vain) + len(alone)} plans begin from the solved plan of the nearest "
        f"row: {_median(begun)}; {len(vain)} did so in vain and begin from the task alone, both counted: "
        f"{_median(vain)}; begun from the task alone: {len(alone)}, {_median(alone)}.</p>"
    )


def _median(taken: list[tuple[int, float]]) -> str:
    if not taken:
        return "–"
    iterations, seconds = np.median(taken, axis=0)
    return f"median {iterations:.4g} iterations and {seconds:.3g} s"


def _compared(folder: SweepFolder, against: Path) -> str:
    """Return the table of what two sweeps have in common."""
    try:
        other = read_sweep(against)
        return _table(comparison(folder.journal.rows(), other.rows(), list(folder.record.columns.inputs)), against)
    except FesdRobotError as error:
        return f"<p>Not compared: {html.escape(str(error))}</p>"


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
