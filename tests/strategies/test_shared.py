"""A start gives up where another has solved a motion that costs much less, and only there."""

from __future__ import annotations

import math
import multiprocessing
from collections.abc import Callable
from typing import Any

import pytest

from fesd_robot.planner import attempt
from fesd_robot.plans import Plan
from fesd_robot.strategies.shared import DEARER, LeastCost
from fesd_robot.strategies.stations import Station
from fesd_robot.task import Task

Load = Callable[..., Task]


def test_the_least_cost_is_shared_with_forked_processes() -> None:
    """The smallest cost that any process has noted is the least everywhere; before there is one nothing is too dear."""
    least = LeastCost()
    assert not least.beats(math.inf)
    for cost in (3.0, 2.0, 4.0):
        process = multiprocessing.get_context("fork").Process(target=least.note, args=(cost,))
        process.start()
        process.join()
    assert least.value == 2.0


@pytest.mark.parametrize("cost", [2.0, -2.0])
def test_a_little_dearer_is_not_too_dear(cost: float) -> None:
    """What costs less than a part more is gone on with, whatever the sign of the cost."""
    least = LeastCost()
    least.note(cost)
    assert not least.beats(cost - 1.0) and not least.beats(cost + 1.9 * DEARER)
    assert least.beats(cost + 2.1 * DEARER)


def _least(cost: float) -> LeastCost:
    least = LeastCost()
    least.note(cost)
    return least


def test_a_motion_that_is_much_dearer_is_neither_refined_nor_certified(load_short: Load, short_plan: Plan) -> None:
    """It says what it costs and what the other costs, and is not solved; its cost is not noted."""
    cost = short_plan.statistics.objective
    least, stations = _least(cost - 2 * DEARER * abs(cost)), list[Station]()
    given_up = attempt(load_short(), least=least, station=stations.append)
    refinement = given_up.statistics.refinement
    assert refinement and refinement.rounds == 0
    assert Station.REFINING not in stations and Station.CERTIFYING not in stations
    assert given_up.status.given_up and not given_up.status.solved and given_up.status.b_stationary == "unknown"
    assert "given up at a cost of" in given_up.status.message and f"{least.value:.6g}" in given_up.status.message
    assert least.value < cost


def test_refinement_ends_once_another_start_is_much_cheaper(load_short: Load, short_plan: Plan) -> None:
    """A cost that another process notes while a motion is refined ends its refinement."""
    cost, least = short_plan.statistics.objective, LeastCost()

    def station(reached: Station) -> None:
        if reached is Station.REFINING:
            least.note(cost - 2 * DEARER * abs(cost))

    given_up = attempt(load_short(), least=least, station=station)
    assert short_plan.statistics.refinement and given_up.statistics.refinement
    assert given_up.statistics.refinement.rounds < short_plan.statistics.refinement.rounds
    assert "given up" in given_up.status.message


def test_a_solved_motion_is_noted_before_its_certificate(load_short: Load, short_plan: Plan) -> None:
    """Others know its cost when it is certified: a certificate may take a minute."""
    least, known = LeastCost(), list[float]()

    def station(reached: Station) -> None:
        if reached is Station.CERTIFYING:
            known.append(least.value)

    attempt(load_short(), least=least, station=station)
    assert known[0] == pytest.approx(short_plan.statistics.objective, rel=1e-6)


@pytest.mark.parametrize("cheaper", [-0.2, 0.01])
def test_a_motion_that_is_hardly_dearer_is_gone_on_with(load_short: Load, short_plan: Plan, cheaper: float) -> None:
    """It is the same motion as that of a start alone, and its cost is noted where it is the least."""
    cost = short_plan.statistics.objective
    least = _least(cost - cheaper * abs(cost))
    before = least.value
    found = attempt(load_short(), least=least)
    assert _numbers(found) == _numbers(short_plan)
    assert least.value == min(before, cost)


def _numbers(plan: Plan) -> dict[str, Any]:
    return {"objective": plan.statistics.objective, "status": plan.status}
