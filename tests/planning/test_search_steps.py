"""A homotopy's steps, as people see them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from fesd_robot.mpcc import HomotopyOptions
from fesd_robot.planning.search_steps import SearchSteps
from fesd_robot.running.activities import Activity


def _report(sigma: float) -> Any:
    return SimpleNamespace(sigma=sigma)


def test_the_sigmas_of_the_schedule_are_the_steps() -> None:
    """Compiling lasts until the first iteration; every loose NLP is a step; after the last one comes polishing."""
    options = HomotopyOptions()
    activities: list[Activity] = []
    counts: list[tuple[int, int | None]] = []
    steps = SearchSteps(options, activities.append, lambda done, of: counts.append((done, of)))
    assert activities == [Activity.COMPILING] and not counts
    loose = [sigma for sigma, _ in options.sigmas() if sigma > options.polish_at]
    for sigma in loose:
        steps.iteration()
        steps.nlp(_report(sigma))
    total = len(loose) + 1
    assert counts == [(done, total) for done in range(total)]
    steps.nlp(_report(options.polish_at))
    assert activities == [Activity.COMPILING, Activity.SEARCHING, Activity.POLISHING]


def test_a_homotopy_that_goes_on_is_a_search_again() -> None:
    """Where polishing finds nothing, NLPs with a smaller sigma follow; shorter steps count no step twice."""
    options = HomotopyOptions()
    activities: list[Activity] = []
    counts: list[int] = []
    steps = SearchSteps(options, activities.append, lambda done, of: counts.append(done))
    first, second = (sigma for sigma, _ in options.sigmas()[:2])
    steps.iteration()
    for sigma in (first, (first * second) ** 0.5, second):
        steps.nlp(_report(sigma))
    assert counts == [0, 1, 1, 2]
    for sigma in (options.polish_at, 0.0, 0.1 * options.polish_at):
        steps.nlp(_report(sigma))
    assert activities[1:] == [Activity.SEARCHING, Activity.POLISHING, Activity.SEARCHING]
