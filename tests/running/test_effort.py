"""How much is tried: what the levels of a task name, and which numbers there are."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import get_args

import pytest

from fesd_robot.errors import OptionError
from fesd_robot.running import EffortLevel, SearchEffort
from fesd_robot.task.method import Solver


def test_the_levels_are_those_of_a_task() -> None:
    """A task names every level, and no other; more effort never has less of anything."""
    assert get_args(Solver.model_fields["effort"].annotation) == get_args(EffortLevel)
    quick, balanced, best = (SearchEffort.of(level) for level in get_args(EffortLevel))
    assert balanced == SearchEffort()
    for less, more in ((quick, balanced), (balanced, best)):
        assert all(value <= getattr(more, name) for name, value in vars(less).items()) and less != more


def test_quick_changes_no_contacts() -> None:
    """Neither a search over sequences begins, nor is a direction of descent followed; all else stays."""
    assert SearchEffort.of("quick") == replace(SearchEffort(), search_starts=0, descents=0)


@pytest.mark.parametrize("value", [-1, math.nan])
def test_what_is_no_effort_is_refused(value: float) -> None:
    """The message names the number."""
    with pytest.raises(OptionError, match="most_work must not be negative, found"):
        SearchEffort(most_work=value)
