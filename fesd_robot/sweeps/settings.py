"""How a sweep is run."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from fesd_robot.arguments import checked
from fesd_robot.errors import OptionError

Keep = Literal["all", "solved", "best", "none"]
"""Which plans are kept."""

MOST_ROWS = 1_000_000
"""Of a sweep that nobody has agreed to."""


@checked
@dataclass(frozen=True)
class SweepSettings:
    """How a sweep is run; nothing of it changes a plan that ends in time.

    Args:
        jobs: plans that are made at once, one a core; default: the cores that this process may use.
        scheduler: address of a Dask scheduler, ``tcp://HOST:PORT``, or ``local`` for a cluster on this machine;
            default: processes of this machine.
        timeout: seconds for a plan, after which it ends with its best iterate, or is ended.
        memory: MB that the process of a plan may have; default: on this machine an equal part of nine tenths of its
            memory, on a cluster no limit.
        keep: which plans are kept, each in a folder of its own.
        resume: whether a sweep that is there already goes on; rows that were interrupted are planned again.
        retry_failed: whether rows that failed are planned again then.
        against: folder of a sweep with the same rows, which the page compares with.
        yes: whether more than a million rows are meant.
    """

    jobs: int | None = None
    scheduler: str | None = None
    timeout: float | None = None
    memory: float | None = None
    keep: str = "solved"
    resume: bool = False
    retry_failed: bool = False
    yes: bool = False
    against: Path | None = None

    def __post_init__(self) -> None:
        for name in ("jobs", "timeout", "memory"):
            value = getattr(self, name)
            if value is not None and not 0 < value < float("inf"):
                raise OptionError(f"{name}: found {value:g}, expected a number greater than 0")
        if self.keep not in get_args(Keep):
            raise OptionError(f"keep: found '{self.keep}', expected {' or '.join(get_args(Keep))}")
