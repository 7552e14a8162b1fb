"""Optimal control with switches: closed forms, the same optimum from everywhere, never worse than a homotopy."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from fesd_robot.errors import ModelError, OptionError
from fesd_robot.fesd import FesdOptions, TrajectoryConstraint, Transcription, make_tableau, simulate
from fesd_robot.mpcc import Run, solve
from fesd_robot.optimal_control import EndTime, OptimalControlSettings, OptimalControlSolution, optimize
from fesd_robot.optimal_control.end_time import with_end_time
from tests.fesd.test_sliding_optimum import OPTIMUM
from tests.fesd.test_sliding_optimum import problem as sliding_problem

from .problems import LEAST_TIME, car, walk

RACE = EndTime(shortest=1, longest=100)


def _driven(solution: OptimalControlSolution) -> np.ndarray:
    """Return the end of the motion that a simulation with steps of its own makes of the controls."""
    system, end = solution.problem.system, solution.end_time
    return simulate(system, solution.states[0], (0.0, end), control=solution.controls, rtol=1e-9).states[-1]


@pytest.fixture(scope="module")
def race() -> OptimalControlSolution:
    """The car on 20 control intervals, where a single homotopy ends at 13.3 s."""
    return optimize(car(20), end_time=RACE)


def test_a_free_end_time_is_found_with_the_switches() -> None:
    """The closed form: u = 1 throughout, T = 0.75, the switch at 0.5, a cost of 1.5, all to 1e-7."""
    solution = optimize(walk(), end_time=EndTime(0.1, 10.0, cost=0.0), settings=OptimalControlSettings(starts=1))
    assert solution.solved and solution.exact
    np.testing.assert_allclose(solution.controls, 1.0, atol=1e-5)
    assert [solution.end_time, solution.cost] == pytest.approx([0.75, 1.5], abs=1e-7)
    assert solution.switch_times == pytest.approx([0.5], abs=1e-5)
    assert solution.cost_terms == pytest.approx({"time": 0.75, "effort": 0.75}, abs=1e-5)


def test_the_optimum_with_sliding_modes_is_exact() -> None:
    """The closed form of arXiv 2205.05337, section 5.3 over six intervals, to 1e-9."""
    solution = optimize(sliding_problem("stewart"), FesdOptions(tableau=make_tableau("radau_iia", 3)))
    assert solution.exact and solution.certificate and solution.certificate.b_stationary == "certified"
    assert solution.cost == pytest.approx(OPTIMUM, rel=1e-9)


def test_the_car_is_exact_and_drives(race: OptimalControlSolution) -> None:
    """The controls take a simulation to the goal; two switches; not faster than with free controls."""
    assert race.solved and race.exact and race.certificate and race.certificate.b_stationary == "certified"
    assert _driven(race) == pytest.approx([200.0, 0.0], abs=1e-5)
    assert LEAST_TIME <= race.end_time == race.cost <= 1.002 * LEAST_TIME
    assert [phase.regions for phase in race.phases] == ["normal", "turbo", "normal"]
    assert race.at(race.switch_times)[:, 1] == pytest.approx([10.0, 10.0], abs=1e-9)


@pytest.mark.parametrize(
    ("options", "settings", "moved"),
    [
        (FesdOptions(elements=2), OptimalControlSettings(), 0.0),
        (FesdOptions(elements=4), OptimalControlSettings(), 0.0),
        (FesdOptions(), OptimalControlSettings(linear_solver="mumps"), 0.0),
        (FesdOptions(), OptimalControlSettings(seed=7), 1e-12),
    ],
    ids=["two elements", "four elements", "mumps", "moved"],
)
def test_the_optimum_does_not_depend_on_how_it_is_found(
    race: OptimalControlSolution, options: FesdOptions, settings: OptimalControlSettings, moved: float
) -> None:
    """Other numbers of elements, another linear solver, another seed and start end in the same time, to 1e-7."""
    problem = car(20, control_guess=np.full((1, 20), moved))
    assert optimize(problem, options, settings, end_time=RACE).end_time == pytest.approx(race.end_time, abs=1e-7)


def test_a_homotopy_is_never_better(race: OptimalControlSolution) -> None:
    """No start ended cheaper than the solution, neither here nor in a homotopy of its own; some were 12 % worse."""
    costs = [start.cost for start in race.starts if start.solved]
    assert race.cost <= min(costs) + 1e-6 and max(costs) > 1.12 * race.cost
    transcription = Transcription(with_end_time(car(20), RACE), FesdOptions())
    plain = solve(transcription.problem, Run(OptimalControlSettings().homotopy(polish=False)))
    assert plain.solved and race.cost <= transcription.cost_terms(plain.w)["end time"] + 1e-6


def test_a_finer_grid_is_never_slower() -> None:
    """Twice as many control intervals contain the coarser ones."""
    times = [optimize(car(n), end_time=RACE).end_time for n in (5, 10)]
    assert LEAST_TIME <= times[1] <= times[0]


def test_constraints_hold_with_a_free_end_time() -> None:
    """With u below 0.8 on the path the walk takes 0.75 / 0.8, and what couples start and end still names its states."""
    problem = walk()
    x, u, z = problem.system.state, problem.system.control, problem.system.algebraic
    slow = TrajectoryConstraint(
        "slow", "path", ca.vertcat(x, u, z), range(4), rows=u, lower=np.array([-np.inf]), upper=np.array([0.8]),
        row_names=["u"],
    )  # fmt: skip
    ends = ca.SX.sym("ends", 2)
    one = TrajectoryConstraint(
        "one", "boundary", ends, rows=ends[1] - ends[0], lower=np.ones(1), upper=np.ones(1), row_names=["way"]
    )
    free = replace(problem, constraints=[slow, one], terminal_lower=[-np.inf], terminal_upper=[np.inf])
    solution = optimize(free, end_time=EndTime(0.1, 10.0, 0.0), settings=OptimalControlSettings(starts=1))
    assert solution.solved and solution.end_time == pytest.approx(0.75 / 0.8, abs=1e-6)
    assert solution.controls.max() <= 0.8 + 1e-8


def test_times_outside_the_motion_are_refused(race: OptimalControlSolution) -> None:
    """The message names the time and the end."""
    with pytest.raises(ModelError, match=r"time 12 is outside the motion, 0 to 11\.81"):
        race.at([12.0])


def test_what_cannot_be_is_said_not_solved() -> None:
    """2000 m in at most 10 s: the sentence has the number of starts and the largest violation."""
    problem = car(4, terminal_lower=[2000, 0], terminal_upper=[2000, 0])
    settings = OptimalControlSettings(starts=1, more_starts=1)
    solution = optimize(replace(problem, duration=9), settings=settings, end_time=EndTime(1, 10))
    assert not solution.solved and solution.certificate is None
    assert solution.message.startswith("Not solved from 2 starts: constraints are violated by ")


def test_a_time_limit_ends_the_search() -> None:
    """After the first start the cheapest solution so far is returned."""
    solution = optimize(car(20), settings=OptimalControlSettings(time_limit=1e-3), end_time=RACE)
    assert {start.number for start in solution.starts} == {0} and not solution.solved


@pytest.mark.parametrize("scheme", ["explicit", "switchless"])
def test_what_has_no_room_is_solved_by_the_homotopies(scheme: str) -> None:
    """Without switch detection there are no exact switches, and the sentence says up to what products are zero."""
    options = FesdOptions(switch_detection=False, elements=4)
    if scheme == "explicit":
        options = FesdOptions(tableau=make_tableau("lobatto_iiic", 2), step_freedom=0.5)
    solution = optimize(walk(), options, OptimalControlSettings(starts=1), end_time=EndTime(0.1, 10.0, 0.0))
    assert solution.solved and solution.cost == pytest.approx(1.5, abs=0.1)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: OptimalControlSettings(tolerance=0), "tolerance must be between 0 and 1, found 0"),
        (lambda: OptimalControlSettings(starts=0), "starts must be at least 1 .*, found 0 and 4"),
        (lambda: OptimalControlSettings(time_limit=-1), "time_limit must be positive, found -1"),
        (
            lambda: OptimalControlSettings(velocity_level_ratio=0.5),
            "velocity_level_ratio must be at least 1, found 0.5",
        ),
    ],
)
def test_settings_out_of_range_are_refused(make: object, message: str) -> None:
    """The message names the setting and its range."""
    with pytest.raises(OptionError, match=message):
        make()  # type: ignore[operator]


def test_an_end_time_that_cannot_be_is_refused() -> None:
    """Bounds out of order, and a guess outside of them."""
    with pytest.raises(ModelError, match="need 0 < shortest < longest, both finite, found 3 and 2"):
        EndTime(3, 2)
    with pytest.raises(ModelError, match="duration 20 is its guess, and must lie between 1 and 10"):
        optimize(car(4), end_time=EndTime(1, 10))
