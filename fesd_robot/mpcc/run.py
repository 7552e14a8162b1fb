"""How NLPs are solved, how much may be tried and how long, who may end it, and who hears of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from fesd_robot.arguments import checked
from fesd_robot.mpcc.options import HomotopyOptions
from fesd_robot.mpcc.report import NlpReport
from fesd_robot.running import Deadline, SearchEffort, Stop, stop_requested


@checked
@dataclass(frozen=True)
class Run:
    """What all NLPs of one solve have in common.

    Attributes:
        options: of the homotopy, and of IPOPT in all NLPs.
        deadline: of all NLPs.
        stop: called once an IPOPT iteration with (iteration, objective), and between NLPs with (0, NaN); True ends the
            solve.
        report: called after every NLP.
        effort: how much is tried.
    """

    options: HomotopyOptions = field(default_factory=HomotopyOptions)
    deadline: Deadline = field(default_factory=Deadline)
    stop: Stop | None = None
    report: Callable[[NlpReport], None] | None = None
    effort: SearchEffort = field(default_factory=SearchEffort)

    @property
    def over(self) -> bool:
        """Whether no time is left, or the user wants to stop."""
        return self.deadline.left <= 0 or stop_requested(self.stop)

    def share(self, part: float) -> Run:
        """Return the same with a part of the time that is left."""
        return replace(self, deadline=self.deadline.share(part))

    def within(self, seconds: float) -> Run:
        """Return the same with some of the time that is left, s, or all of it if that is less."""
        return replace(self, deadline=self.deadline.within(seconds))

    def notify(self, nlp: NlpReport) -> None:
        """Report an NLP."""
        if self.report:
            self.report(nlp)

    @property
    def unseen(self) -> Run:
        """The same with nobody who hears of NLPs, or ends them."""
        return replace(self, stop=None, report=None)
