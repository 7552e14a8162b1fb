"""The code blocks of the documentation, and the program run on them."""

from __future__ import annotations

import logging
import re
import shlex
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]

_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)

SHORT = (
    "horizon.duration=0.2",
    "horizon.intervals=2",
    "reference={type: line}",
    "goal.configuration.root_x=0.1",
    "solver.tolerance=1e-6",
)
"""Standing still for 0.2 s instead of a jump: what the plans of the pages are replaced by."""


class Block(NamedTuple):
    """A block with its language and text."""

    language: str
    text: str


class Command(NamedTuple):
    """A command of a console, and what the page says that it prints."""

    words: list[str]
    shown: str


def blocks(page: Path, *languages: str) -> list[Block]:
    """Return the blocks of a page in some languages, in order."""
    found = [Block(*match.groups()) for match in _BLOCK.finditer(page.read_text(encoding="utf-8"))]
    return [block for block in found if block.language in languages]


def commands(block: Block) -> list[Command]:
    """Return the commands of a console."""
    parts = re.split(r"^\$ ", block.text, flags=re.MULTILINE)[1:]
    return [Command(shlex.split(first), rest) for first, _, rest in (part.partition("\n") for part in parts)]


def run(words: list[str], monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> str:
    """Return what the program prints, in this process, on 80 columns."""
    from fesd_robot.cli.main import main

    logger = logging.getLogger("fesd_robot")
    level, handlers = logger.level, list(logger.handlers)
    with monkeypatch.context() as patched:
        for variable in ("FORCE_COLOR", "TTY_COMPATIBLE"):
            patched.delenv(variable, raising=False)
        patched.setenv("COLUMNS", "80")
        patched.setattr(sys, "argv", words)
        capfd.readouterr()
        with pytest.raises(SystemExit):
            main()
    logger.setLevel(level)
    logger.handlers[:] = handlers
    printed = capfd.readouterr()
    return printed.out + printed.err


def pattern(shown: str) -> str:
    """Return the pattern of what a page shows: ``...`` alone stands for any lines, in a line for any words."""
    lines = []
    for line in shown.rstrip("\n").split("\n"):
        lines.append(
            r"(?:.*\n)*?" if line.strip() == "..." else re.escape(line.rstrip()).replace(r"\.\.\.", ".*") + r"\s*\n"
        )
    return "".join(lines)


def stable(line: str) -> str:
    """Return the beginning of a line that does not depend on how long a plan took, and what came of it."""
    line = re.sub(r"^ *\d+ s  (start \d of \d, )?", "", line)
    return re.split(r"[\d,;]| no ", line)[0].strip()
