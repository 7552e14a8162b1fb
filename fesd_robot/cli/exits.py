"""Exit statuses of commands, and their meanings."""

from __future__ import annotations

from enum import IntEnum


class ExitCode(IntEnum):
    """The exit statuses of all commands; an unexpected exception ends with 1."""

    SOLVED = 0
    BAD_INPUT = 2
    NOT_SOLVED = 3
    INTERRUPTED = 130
