"""A real task that is solved in a second, and its plan."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from fesd_robot.mpcc import NlpReport
from fesd_robot.planning.planner import plan
from fesd_robot.plans import Plan
from fesd_robot.task import Task, load_task

ONE_JUMP = Path(__file__).parents[1] / "tasks" / "published_hopper_one_jump.yaml"
SHORT = (
    "horizon.duration=0.2",
    "horizon.intervals=2",
    "goal.configuration.root_x=0.12",
    "reference={type: line}",
    "costs.slipping={}",
    "solver.tolerance=1e-6",
)
"""Leaning forward for 0.2 s instead of a jump."""


@pytest.fixture
def python_interrupts() -> Iterator[None]:
    """SIGINT has Python's own handler: a shell that starts the tests may have it ignored."""
    inherited = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, inherited)


class Planned(NamedTuple):
    """A plan and what `progress` was called with while it was made."""

    plan: Plan
    reports: list[NlpReport]


@pytest.fixture(scope="session")
def load_short() -> Callable[..., Task]:
    """The short task with further overrides, ``key=value`` each."""
    return lambda *overrides: load_task(ONE_JUMP, [*SHORT, *overrides])


@pytest.fixture(scope="session")
def short_task(load_short: Callable[..., Task]) -> Task:
    """The short task as it is."""
    return load_short()


@pytest.fixture(scope="session")
def short_planned(short_task: Task) -> Planned:
    """The short task, planned once."""
    reports: list[NlpReport] = []
    return Planned(plan(short_task, progress=reports.append), reports)


@pytest.fixture(scope="session")
def short_plan(short_planned: Planned) -> Plan:
    """The plan of the short task."""
    return short_planned.plan
