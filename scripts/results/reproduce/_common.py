"""What the scripts of this folder share: options, reference values, tables, figures, and the verdict at the end."""

from __future__ import annotations

import argparse
import importlib.metadata
import json
import os
import platform
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before numpy is imported: the problems are small

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

FOLDER = Path(__file__).resolve().parent
DOCS = FOLDER.parents[2] / "docs"
plt.rcParams.update(
    {
        "font.size": 9,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.grid": True,
        "grid.color": "0.9",
        "grid.linewidth": 0.6,
        "legend.frameon": False,
        "lines.linewidth": 1.2,
        "lines.markersize": 4,
        "savefig.dpi": 160,
    }
)


def reference(key: str) -> Any:
    """Return an entry of reference.json, which names its sources."""
    return json.loads((FOLDER / "reference.json").read_text(encoding="utf-8"))[key]


def number(value: float | None, digits: int = 3) -> str:
    """Return a number for a table; a dash for what does not exist."""
    return "–" if value is None or value != value else f"{value:.{digits - 1}e}"


def markdown_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table with aligned columns, the first one to the left; readable as text and as markdown."""
    widths = [max(3, *(len(line[i]) for line in [header, *rows])) for i in range(len(header))]
    rule = ["-" * widths[0], *("-" * (w - 1) + ":" for w in widths[1:])]
    lines = [
        [line[0].ljust(widths[0]), *(cell.rjust(w) for cell, w in zip(line[1:], widths[1:], strict=True))]
        for line in [header, rule, *rows]
    ]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def legend_below(axis: Axes, heading: str, drop: float) -> None:
    """Put the legend of a narrow plot under its axis label, `drop` heights of the plot below it."""
    axis.legend(
        title=heading, loc="upper center", bbox_to_anchor=(0.5, -drop), ncol=2, fontsize=7, title_fontsize=7,
        handlelength=1.5, columnspacing=1.0,
    )  # fmt: skip


@dataclass
class Report:
    """Collects the tables and checks of one script, prints them, and writes them as a page with a figure.

    Args:
        name: of the script without its ending; the files are called reproduce_NAME.
        title: heading of the page.
        description: for ``--help``.
    """

    name: str
    title: str
    description: str
    arguments: argparse.Namespace = field(init=False)
    parts: list[str] = field(default_factory=list)
    checks: list[tuple[str, bool]] = field(default_factory=list)

    def parse(self, *options: tuple[str, str], words: Sequence[str] | None = None) -> argparse.Namespace:
        """Read the command line.

        Args:
            options: further switches and what they do.
            words: the command line, that of the process if omitted.
        """
        self.begin = time.process_time()
        parser = argparse.ArgumentParser(
            description=self.description, formatter_class=argparse.ArgumentDefaultsHelpFormatter
        )
        parser.add_argument("--quick", action="store_true", help="fewer points")
        parser.add_argument("--out", type=Path, default=DOCS, help="folder that gets results/ and images/")
        for option, meaning in options:
            parser.add_argument(option, action="store_true", help=meaning)
        self.arguments = parser.parse_args(words)
        return self.arguments

    def add(self, text: str) -> None:
        """Print a paragraph or a table and keep it for the page."""
        print(text, end="\n\n", flush=True)
        self.parts.append(text)

    def check(self, sentence: str, holds: bool) -> None:
        """Note whether something that a reproduction must show is so."""
        self.checks.append((sentence, bool(holds)))

    def figure(self, figure: Figure, caption: str) -> None:
        """Save the figure and put it on the page."""
        path = self.arguments.out / "images" / f"reproduce_{self.name}.png"
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, bbox_inches="tight")
        plt.close(figure)
        self.parts.append(f"![{caption}](../images/{path.name})\n\n{caption}")

    def close(self) -> None:
        """Write the page and end the program, with exit status 1 if a check failed."""
        seconds = time.process_time() - self.begin
        switches = [f" --{key}" for key, value in vars(self.arguments).items() if value is True]
        packages = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in ("casadi", "numpy"))
        made = (
            f"Made by `python scripts/results/reproduce/{self.name}.py{''.join(switches)}` in {seconds:.0f} s "
            "on one core "
            f"({processor()}), Python {platform.python_version()}, {packages}."
        )
        self.add(markdown_table(["what must hold", "holds"], [[s, "yes" if ok else "NO"] for s, ok in self.checks]))
        path = self.arguments.out / "results" / f"reproduce_{self.name}.md"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("\n\n".join([f"# {self.title}", made, *self.parts]) + "\n", encoding="utf-8")
        print(f"{seconds:.0f} s, {path}")
        missed = [sentence for sentence, ok in self.checks if not ok]
        if missed:
            print(f"Not reproduced: {'; '.join(missed)}.", file=sys.stderr)
            raise SystemExit(1)


def processor() -> str:
    """Return the name of the processor."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
        return next(line.split(":")[1].strip() for line in text.splitlines() if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.machine()
