"""Inputs that are nearly right: the program refuses them in one sentence, or does what it is asked to."""

from __future__ import annotations

from collections import Counter

import pytest

from scripts.tools.mutated_inputs import KINDS, mutated_inputs
from scripts.tools.run_mutated import Ended, Tally, all_ended, page, warm_up

COUNT = 500


def test_the_same_seed_gives_the_same_inputs() -> None:
    """Inputs are reproducible one by one, and of every kind there are as many."""
    first, again = list(mutated_inputs(7, 80)), list(mutated_inputs(7, 40))
    assert first[:40] == again
    assert set(Counter(one.kind for one in first).values()) == {80 // len(KINDS)}


@pytest.mark.slow
def test_inputs_that_are_nearly_right_end_in_a_sentence() -> None:
    """500 of them: status 0, 2 or 3, no traceback, no words of C++, a place in the message, 5 s and 1 GB at most."""
    warm_up()
    found = list(all_ended(2026, COUNT))
    assert [(one.given.kind, one.given.command, one.faults, one.said) for one in found if one.faults] == []
    accepted = sum(one.code in (0, 3) for one in found)
    assert 0.05 * COUNT < accepted < 0.6 * COUNT, "most inputs are wrong, and some are right"


def test_faults_are_counted_by_kind() -> None:
    """A traceback, a refusal without a place and a signal are faults; the page counts them."""
    given = next(mutated_inputs(0, 1))
    ends = [
        Ended(given, 2, f"error: {given.changed}:3: found nothing", 0.1, 1e8, (), False),
        Ended(given, 2, "error: found nothing\n", 0.1, 1e8, ("out",), False),
        Ended(given, 1, "Traceback (most recent call last):\nKeyError: 'x'\n", 0.1, 1e8, (), False),
        Ended(given, -11, "", 9.0, 2e9, (), False),
    ]
    assert [one.faults for one in ends] == [
        [],
        ["no place", "files left"],
        ["traceback"],
        ["crash", "slow", "large"],
    ]
    tally = Tally()
    for one in ends:
        tally.add(one)
    assert "| 4 | 0 | 4 | 1 crash, 1 files left, 1 large, 1 no place, 1 slow, 1 traceback | 9.0 | 2000 |" in page(
        {given.kind: tally}, "hand"
    )
