"""An export format: its name, its files, and the functions that write them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.util import find_spec

from fesd_robot.errors import PlanFileError

Writer = Callable[..., bytes]
"""(plan) -> content of a file; of a format with joints (plan, joints, effort), where joints may be None and effort
says whether efforts are written, and of one with a model (plan, motion), the plan's `ModelMotion`; of one with gains
(gains)."""


@dataclass(frozen=True)
class ExportFormat:
    """A format in which the trajectory of a plan can be written.

    Attributes:
        name: what the user asks for.
        stem: usual name of the file, without suffix.
        content: what the file holds, for the help, in words that follow the format's name.
        writers: suffix of a file -> what writes it; the first is taken where the suffix is none of them.
        joints: whether the joints can be chosen, and their efforts be written or left out.
        model: whether it holds the motion of the model of the robot's file, which is read for it.
        gains: whether it holds the feedback gains of the plan instead of its samples; its writers take `TrackingGains`.
        with_plan: whether every run of the planner leaves such a file beside its plan.
        extra: what `pip install "fesd-robot[extra]"` adds for it; empty if it needs nothing more.
        packages: names of the modules that the extra brings.
    """

    name: str
    stem: str
    content: str
    writers: Mapping[str, Writer]
    joints: bool = False
    model: bool = False
    gains: bool = False
    with_plan: bool = False
    extra: str = ""
    packages: tuple[str, ...] = ()

    @property
    def file(self) -> str:
        """Usual name of the file."""
        return self.stem + next(iter(self.writers))

    def writer(self, suffix: str) -> Writer:
        """Return the writer of files with this suffix."""
        return self.writers.get(suffix) or next(iter(self.writers.values()))

    def refuse_missing(self) -> None:
        """Raise if a package that the format needs is not installed.

        Raises:
            PlanFileError: one is not; the message is the command that installs it.
        """
        missing = [name for name in self.packages if find_spec(name) is None]
        if missing:
            raise PlanFileError(
                f"the format '{self.name}' needs {' and '.join(missing)}, which is not installed; "
                f'pip install "fesd-robot[{self.extra}]" adds it'
            )
