"""Which tests are fast; a real task that is solved in a second, and its plan."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

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

TESTS = Path(__file__).parent
SLOW = {
    "cli",
    "docs",
    "examples",
    "first_task",
    "in_mujoco",
    "optimal_control",
    "phases",
    "planning",
    "refinement",
    "render",
    "replanning",
    "scripts",
    "simulation",
    "starts",
    "sweeps",
    "test_actions.py",
    "test_distance_plan.py",
    "test_mujoco_robots.py",
    "test_no_contact.py",
    "test_orientation_plan.py",
    "test_plan_in_space.py",
    "test_plan_on_hills.py",
}
"""Folders and files that ``--fast`` leaves out, for most of their tests plan or simulate motions, draw or build."""

FAST_SECONDS = 3.0
"""s; a test of the others that takes longer belongs among those marked ``slow``."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that leaves slow tests out."""
    parser.addoption("--fast", action="store_true", help=f"leave out tests marked slow, and {', '.join(sorted(SLOW))}")


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave out slow folders and files, unless they are asked for by name."""
    return True if config.option.fast and collection_path.parent == TESTS and collection_path.name in SLOW else None


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out tests that are marked slow."""
    if config.option.fast:
        slow = [item for item in items if item.get_closest_marker("slow")]
        config.hook.pytest_deselected(items=slow)
        items[:] = [item for item in items if item not in slow]


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """Name what makes the fast tests slow."""
    if not config.option.fast:
        return
    for report in (one for ones in terminalreporter.stats.values() for one in ones):
        if getattr(report, "duration", 0.0) > FAST_SECONDS:
            terminalreporter.write_line(
                f"{report.nodeid}: {report.when} took {report.duration:.1f} s, more than the {FAST_SECONDS:g} s of a "
                "fast test; mark it slow"
            )


@pytest.fixture(scope="session")
def jump() -> Plan:
    """The hopper's jump in the plane: two landings."""
    found = plan(load_task(ONE_JUMP.with_name("hopper_one_jump.yaml"), ["solver.effort=quick", "output.page=false"]))
    assert found.status.solved
    return found


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
