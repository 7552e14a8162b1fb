"""The exact landing of a point mass solves every form of the contact logic, its unphysical relatives none."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fesd_robot.contact import ContactOptions, contact_system
from fesd_robot.fesd import FesdOptions, SimulationSettings, simulate
from fesd_robot.mpcc import HomotopyOptions, Mpcc, Run, solve

from .motions import AUXILIARY_FORCE, FORMS, FRICTION, GRAVITY, RADAU, Motion, landing, point_mass

IMPACT_TIME, IMPACT_SPEED = np.sqrt(0.2), np.sqrt(20)
SLIP_VELOCITY = 4 - FRICTION * np.sqrt(20)

each_form = pytest.mark.parametrize("options", FORMS.values(), ids=FORMS.keys())


@each_form
@pytest.mark.parametrize("mode", ["stage_stage", "lambda_sum", "theta_sum", "sum_sum"])
def test_the_exact_landing_is_a_solution(options: ContactOptions, mode: str) -> None:
    """Flight, impact and sliding stance meet all equations and pairs in every form and aggregation."""
    motion = landing(options)
    residuals = motion.transcription(mode).problem.residuals(motion.vector())
    assert residuals.constraint_violation <= 1e-13, residuals.worst_constraint
    assert residuals.complementarity <= 1e-13, residuals.worst_pair
    clock = IMPACT_TIME + 0.2 * AUXILIARY_FORCE / (AUXILIARY_FORCE + GRAVITY)
    velocity = SLIP_VELOCITY - FRICTION * GRAVITY * (clock - IMPACT_TIME)
    assert motion.state[[1, 2, 3, 4]] == pytest.approx([0, velocity, 0, clock], abs=1e-14)


def _at_the_ground(options: ContactOptions) -> Motion:
    """The flight of the landing, up to the moment of touchdown."""
    motion = landing(options)
    flight = Motion(options, np.array([0, 1, 4, 0, 0], dtype=float))
    flight.add(motion.elements[0].step, settled=True)
    return flight


def _smeared(motion: Motion) -> None:
    motion.add(IMPACT_SPEED / (0.5 * (AUXILIARY_FORCE - GRAVITY)), plus=0.5)


def _falls_through(motion: Motion) -> None:
    motion.add(0.1)


def _half_an_impact(motion: Motion) -> None:
    motion.add(0.5 * IMPACT_SPEED / AUXILIARY_FORCE, plus=1.0)
    motion.add(0.1)


def _bounces(motion: Motion) -> None:
    motion.add(1.5 * IMPACT_SPEED / AUXILIARY_FORCE, plus=1.0)


def _friction_pushes(motion: Motion) -> None:
    motion.add(IMPACT_SPEED / AUXILIARY_FORCE, minus=1.0, settled=True)


def _no_friction(motion: Motion) -> None:
    motion.add(IMPACT_SPEED / AUXILIARY_FORCE, plus=0.5, minus=0.5, settled=True)


def _stance_without_impact(motion: Motion) -> None:
    motion.add(0.1, plus=GRAVITY / (AUXILIARY_FORCE + GRAVITY))


@each_form
@pytest.mark.parametrize(
    "wrong",
    [_smeared, _falls_through, _half_an_impact, _bounces, _friction_pushes, _no_friction, _stance_without_impact],
    ids=lambda function: function.__name__.strip("_"),
)
def test_an_unphysical_landing_is_none(options: ContactOptions, wrong: Callable[[Motion], None]) -> None:
    """What obeys the fields but not the contact logic breaks a pair or leaves the ground's side of the gap."""
    motion = _at_the_ground(options)
    wrong(motion)
    problem = motion.transcription().problem
    residuals = problem.residuals(motion.vector())
    assert max(residuals.complementarity, residuals.constraint_violation) >= 1e-3
    if residuals.constraint_violation > 1e-13:
        worst = residuals.worst_constraint
        assert worst is not None and (worst.kind.startswith("bound of") or worst in problem.pair_labels)


@each_form
def test_a_force_at_a_distance_is_none(options: ContactOptions) -> None:
    """No auxiliary field may have a multiplier above the ground."""
    motion = Motion(options, np.array([0, 1, 4, 0, 0], dtype=float))
    motion.add(0.1, plus=0.05)
    residuals = motion.transcription().problem.residuals(motion.vector())
    assert residuals.complementarity + residuals.constraint_violation >= 1e-3


@each_form
@pytest.mark.parametrize("sigma", [1e-2, 1e-6])
def test_the_solver_returns_to_the_landing(options: ContactOptions, sigma: float) -> None:
    """From a point a centimetre beside the landing the homotopy finds touchdown, impulse and slowed clock again."""
    motion = landing(options, stance=0.05)
    transcription = motion.transcription()
    problem, exact = transcription.problem, motion.vector()
    beside = exact + 1e-2 * np.random.default_rng(0).normal(size=exact.size)
    moved = Mpcc(problem.lower, problem.upper, np.clip(beside, problem.lower, problem.upper), problem.blocks)
    solution = solve(
        moved, Run(HomotopyOptions(tolerance=1e-10, sigma_start=sigma, sigma_factor=0.1, velocity_level_ratio=1.0))
    )
    assert solution.solved
    flight, impact, stance = transcription.unpack(solution.w)
    # Ungated, the end of a flight is a product of two velocities: a tolerance of 1e-10 determines it to its root.
    accuracy = 1e-8 if options.steps.gate else 1e-5
    assert flight.step == pytest.approx(IMPACT_TIME, abs=accuracy)
    assert impact.step == pytest.approx(IMPACT_SPEED / AUXILIARY_FORCE, abs=accuracy)
    assert flight.x[-1][:5] == pytest.approx([4 * IMPACT_TIME, 0, 4, -IMPACT_SPEED, IMPACT_TIME], abs=3 * accuracy)
    assert impact.x[-1][:5] == pytest.approx([4 * IMPACT_TIME, 0, SLIP_VELOCITY, 0, IMPACT_TIME], abs=3 * accuracy)
    clock = stance.step * AUXILIARY_FORCE / (AUXILIARY_FORCE + GRAVITY)
    assert stance.x[-1][4] - stance.x_left[4] == pytest.approx(clock, abs=3 * accuracy)
    assert stance.x[-1] == pytest.approx(motion.elements[-1].x[-1], abs=1e-4)


@pytest.mark.parametrize("name", ["multipliers", "steps"])
def test_sliding_stops_by_itself(name: str) -> None:
    """After the impact the point slows down by μ g, sticks at t = 4/3, at x = 89/30, and stays there."""
    options = FORMS[name]
    dynamics, contacts = point_mass()
    system = contact_system(dynamics, contacts, options)
    initial = np.array([4 * IMPACT_TIME, 0, SLIP_VELOCITY, 0, IMPACT_TIME, 0])
    lower = np.full(6, -np.inf)
    lower[-1] = system.gap_lower
    simulation = simulate(
        system.system,
        initial,
        np.ones((1, 4)),
        1.2,
        options=FesdOptions(tableau=RADAU, elements=2),
        settings=SimulationSettings(
            homotopy=HomotopyOptions(tolerance=1e-10, sigma_factor=0.1, velocity_level_ratio=1.0), state_lower=lower
        ),
    )
    clock = IMPACT_TIME + 1.2 * AUXILIARY_FORCE / (AUXILIARY_FORCE + GRAVITY)
    assert simulation.states[-1][:5] == pytest.approx([89 / 30, 0, 0, 0, clock], abs=1e-8)
    boundaries = np.array([element.x_left for element in simulation.elements])
    stop = boundaries[np.argmin(np.abs(boundaries[:, 4] - 4 / 3))]
    assert stop[[0, 2, 4]] == pytest.approx([89 / 30, 0, 4 / 3], abs=1e-7)
