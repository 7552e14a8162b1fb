"""How far a homotopy is, from what it says about its NLPs."""

from __future__ import annotations

from fesd_robot.exactness import ROUNDED
from fesd_robot.mpcc import HomotopyOptions, NlpReport
from fesd_robot.running import Activity, ActivityCallback, ProgressCallback


class SearchSteps:
    """Says how far a homotopy is: compiling until its first iteration, then searching, polishing on a branch.

    Args:
        options: of the homotopy, whose sigmas are the steps.
        on_activity: called with the activity when it changes.
        on_progress: called with the steps.
    """

    def __init__(self, options: HomotopyOptions, on_activity: ActivityCallback, on_progress: ProgressCallback) -> None:
        self._on_activity, self._on_progress = on_activity, on_progress
        self._end = options.polish_at if options.polish else options.tolerance
        # The first sigma at the end or below it is that of the last loose NLP.
        sigmas = [position for position, _ in options.sigmas()]
        loose = [sigma for sigma in sigmas if sigma > self._end]
        self._sigmas = sigmas[: len(loose) + 1]
        self._activity = Activity.COMPILING
        on_activity(self._activity)

    def iteration(self) -> None:
        """Take note that a solver is running."""
        if self._activity is Activity.COMPILING:
            self._at(Activity.SEARCHING)
            self._on_progress(0, len(self._sigmas))

    def nlp(self, report: NlpReport) -> None:
        """Take note of the end of an NLP; sigma is zero in those of polishing."""
        if not report.sigma:
            self._at(Activity.POLISHING)
        elif report.sigma > self._end:
            self._at(Activity.SEARCHING)
            done = sum(sigma >= report.sigma * (1 - ROUNDED) for sigma in self._sigmas)
            self._on_progress(done, len(self._sigmas))
        else:
            # What follows the last loose NLP is polishing; where that fails, the homotopy goes on to its tolerance.
            self._at(Activity.POLISHING if self._activity is Activity.SEARCHING else Activity.SEARCHING)

    def _at(self, activity: Activity) -> None:
        if activity is not self._activity:
            self._activity = activity
            self._on_activity(activity)
