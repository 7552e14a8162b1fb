"""From one sigma to the next, and the first one chosen from the problem."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from fesd_robot.errors import OptionError
from fesd_robot.mpcc import HomotopyOptions, Run, solve
from fesd_robot.mpcc.schedule import (
    ACTIVE_SET_SETTLED_SIGMA,
    RULES,
    USUAL_ITERATIONS,
    Rule,
    SigmaSchedule,
    chosen_start,
)

from .known import KNOWN, X, Y, mpcc, vanishing

NEAR_MISS = KNOWN[0]


def _schedule(rule: Rule, **changes: Any) -> SigmaSchedule:
    return replace(
        SigmaSchedule(rule, first=1.0, last=1e-8, factor=0.2, power=1.5, velocity_level_ratio=1.0), **changes
    )


def _factor(schedule: SigmaSchedule, sigma: float, iterations: int = USUAL_ITERATIONS) -> float:
    """By what sigma of both levels shrinks."""
    first, second = schedule.after((sigma, sigma), iterations)
    assert first == second
    return first / sigma


def test_linear() -> None:
    """The factor, and its square once sigma has settled; iterations do not matter."""
    schedule = _schedule("linear")
    assert _factor(schedule, 1.0) == _factor(schedule, 1.01 * ACTIVE_SET_SETTLED_SIGMA, 1000) == pytest.approx(0.2)
    assert _factor(schedule, ACTIVE_SET_SETTLED_SIGMA) == pytest.approx(0.04)


def test_superlinear() -> None:
    """min(factor sigma, sigma^power), whichever side of 1 sigma is on."""
    schedule = _schedule("superlinear")
    for sigma in (100.0, 1.0, 0.1, 0.04, 0.01, 1e-4):
        assert schedule.after((sigma, sigma), USUAL_ITERATIONS)[0] == pytest.approx(min(0.2 * sigma, sigma**1.5))


@pytest.mark.parametrize(
    ("iterations", "exponent"), [(0, 2), (1, 2), (25, 2), (40, 1.25), (50, 1), (75, 2 / 3), (100, 0.5), (900, 0.5)]
)
def test_adaptive(iterations: int, exponent: float) -> None:
    """Few iterations make the next factor smaller, many make it gentler, within the factor's square and its root."""
    assert _factor(_schedule("adaptive"), 1.0, iterations) == pytest.approx(0.2**exponent)


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("iterations", [3, 50, 700])
@pytest.mark.parametrize("last", [1e-2, 1e-8, 1.0])
def test_all_end_at_the_last_sigma(rule: Rule, iterations: int, last: float) -> None:
    """Both levels shrink together, keep their ratio until the first has arrived, and end exactly at the last sigma."""
    schedule = _schedule(rule, last=last, velocity_level_ratio=300.0)
    values = [schedule.start()]
    while not schedule.is_last(values[-1]):
        values.append(schedule.after(values[-1], iterations))
    assert values[0] == (1.0, 300.0) and values[-1] == (last, last)
    assert len(values) < 60
    array = np.array(values)
    assert (np.diff(array, axis=0) <= 0).all() and (array[:, 1] >= array[:, 0]).all()
    on_the_way = array[:, 0] > last
    assert array[on_the_way, 1] == pytest.approx(300 * array[on_the_way, 0])


def test_the_adaptive_schedule_sees_the_iterations() -> None:
    """In a homotopy every sigma follows from the iterations of the NLP before."""
    solution = solve(NEAR_MISS.problem, Run(HomotopyOptions(schedule="adaptive", sigma_factor=0.2)))
    schedule = _schedule("adaptive")
    assert solution.solved
    for before, after in zip(solution.reports, solution.reports[1:], strict=False):
        expected = schedule.after((before.sigma, before.velocity_level_sigma), before.iterations)
        assert (after.sigma, after.velocity_level_sigma) == pytest.approx(expected)


@pytest.mark.parametrize("known", [known for known in KNOWN if known.solutions], ids=lambda known: known.name)
@pytest.mark.parametrize("rule", RULES)
def test_every_schedule_solves_the_known_problems(rule: Rule, known: Any) -> None:
    """Whatever the schedule and with a first sigma of the problem's own, the solution is found."""
    options = HomotopyOptions(schedule=rule, sigma_start=None, sigma_factor=0.2, velocity_level_ratio=10.0)
    solution = solve(known.problem, Run(options))
    assert solution.solved
    assert known.error(solution.w) <= known.distance


@pytest.mark.parametrize(
    ("start", "expected"), [([2, 3], 6.0), ([0, 0], 0.1), ([0.1, 0.1], 0.1), ([10, 10], 10.0), ([-2, 3], 0.1)]
)
def test_the_first_sigma_is_the_largest_product(start: list[float], expected: float) -> None:
    """Within 0.1 and 10; a negative side counts as zero."""
    problem = mpcc(X + Y, ca.vertcat(X, 0), ca.vertcat(Y, 1), start)
    assert chosen_start(problem, 1.0) == pytest.approx(expected)
    assert solve(problem, Run(HomotopyOptions(sigma_start=None))).reports[0].sigma == pytest.approx(expected)


def test_products_of_the_velocity_level_count_less() -> None:
    """By the ratio of both sigmas."""
    problem = vanishing(mpcc(X + Y, X, Y, [20, 4]), "velocity")
    assert chosen_start(problem, 40.0) == pytest.approx(2.0)
    assert solve(problem, Run(HomotopyOptions(sigma_start=None, velocity_level_ratio=40.0))).reports[
        0
    ].sigma == pytest.approx(2.0)


def test_the_first_sigma_is_not_below_the_tolerance() -> None:
    """A tolerance above what the problem would choose is the first and the last sigma."""
    solution = solve(mpcc(X + Y, X, Y, [0, 0]), Run(HomotopyOptions(sigma_start=None, tolerance=0.5)))
    assert [report.sigma for report in solution.reports] == [0.5]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"schedule": "superlinar"}, r"unknown schedule 'superlinar' \(did you mean 'superlinear'\?\)"),
        ({"sigma_power": 1.0}, "sigma_power must be greater than 1, found 1"),
        ({"sigma_start": 1e-9}, "need 0 < tolerance <= sigma_start, found 1e-08 and 1e-09"),
        ({"sigma_start": None, "tolerance": 2.0}, "found 2 and chosen"),
    ],
    ids=str,
)
def test_options_outside_their_range(options: dict[str, Any], message: str) -> None:
    """The error says what was found."""
    with pytest.raises(OptionError, match=message):
        HomotopyOptions(**options)
