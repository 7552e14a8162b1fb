"""How far a homotopy is, from what it says about its NLPs."""

from __future__ import annotations

from fesd_robot.exactness import ROUNDED
from fesd_robot.mpcc import HomotopyOptions, NlpReport
from fesd_robot.running import Counted, Reached, Station


class SearchSteps:
    """Says how far a homotopy is: compiling until its first iteration, then searching, polishing on a branch.

    Args:
        options: of the homotopy, whose sigmas are the steps.
        reached: called with the station when it changes.
        counted: called with the steps.
    """

    def __init__(self, options: HomotopyOptions, reached: Reached, counted: Counted) -> None:
        self._reached, self._counted = reached, counted
        self._end = options.polish_at if options.polish else options.tolerance
        # The first sigma at the end or below it is that of the last loose NLP.
        sigmas = [position for position, _ in options.sigmas()]
        loose = [sigma for sigma in sigmas if sigma > self._end]
        self._sigmas = sigmas[: len(loose) + 1]
        self._station = Station.COMPILING
        reached(self._station)

    def iteration(self) -> None:
        """Take note that a solver is running."""
        if self._station is Station.COMPILING:
            self._at(Station.SEARCHING)
            self._counted(0, len(self._sigmas))

    def nlp(self, report: NlpReport) -> None:
        """Take note of the end of an NLP; sigma is zero in those of polishing."""
        if not report.sigma:
            self._at(Station.POLISHING)
        elif report.sigma > self._end:
            self._at(Station.SEARCHING)
            done = sum(sigma >= report.sigma * (1 - ROUNDED) for sigma in self._sigmas)
            self._counted(done, len(self._sigmas))
        else:
            # What follows the last loose NLP is polishing; where that fails, the homotopy goes on to its tolerance.
            self._at(Station.POLISHING if self._station is Station.SEARCHING else Station.SEARCHING)

    def _at(self, station: Station) -> None:
        if station is not self._station:
            self._station = station
            self._reached(station)
