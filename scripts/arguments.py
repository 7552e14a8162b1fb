"""The arguments that scripts share which plan many tasks and write a page."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def task_parser(description: str, page: Path) -> argparse.ArgumentParser:
    """Return a parser of names of tasks, a number of processes, and where the page goes.

    Args:
        description: the first line of it is shown.
        page: where the page goes unless said otherwise.
    """
    parser = argparse.ArgumentParser(description=description.splitlines()[0])
    every = sorted(file.stem for file in (ROOT / "tasks").glob("*.yaml"))
    parser.add_argument("tasks", nargs="*", default=every, help="names of tasks; default: all")
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--page", type=Path, default=page)
    return parser
