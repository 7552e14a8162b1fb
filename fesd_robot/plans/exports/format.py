"""What an export format is: a name to ask for it by, the files it makes, and who writes them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

Writer = Callable[..., bytes]
"""(plan) -> content of a file; of a format with joints (plan, joints), where joints may be None."""


@dataclass(frozen=True)
class ExportFormat:
    """A format in which the trajectory of a plan can be written.

    Attributes:
        name: what the user asks for.
        stem: usual name of the file, without suffix.
        content: what the file holds, for the help, in words that follow the format's name.
        writers: suffix of a file -> what writes it; the first is taken where the suffix is none of them.
        joints: whether the joints can be chosen.
        with_plan: whether every run of the planner leaves such a file beside its plan.
    """

    name: str
    stem: str
    content: str
    writers: Mapping[str, Writer]
    joints: bool = False
    with_plan: bool = False

    @property
    def file(self) -> str:
        """Usual name of the file."""
        return self.stem + next(iter(self.writers))

    def writer(self, suffix: str) -> Writer:
        """Return what writes a file with this suffix."""
        return self.writers.get(suffix) or next(iter(self.writers.values()))
