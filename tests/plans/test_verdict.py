"""The sentence that sums up a solve."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fesd_robot.complementarity import Label, Place
from fesd_robot.mpcc import Certificate, MpccSolution, NlpReport, NlpStatus
from fesd_robot.mpcc.problem import Residuals
from fesd_robot.plans import Plan
from fesd_robot.plans.audit_record import ENTRIES, AuditScales, Finding
from fesd_robot.plans.outcome import ContactOutcome, Flight, GoalEntry, Outcome
from fesd_robot.plans.plan import Audit
from fesd_robot.plans.stationarity_words import stationarity_sentence
from fesd_robot.plans.verdict import status_of

REACHED = Outcome(goal=[], contacts={})
"""Of a motion that misses nothing."""


def solution(words: str, *, solved: bool = False, violation: float = 0.0, steps: int = 1) -> MpccSolution:
    status = NlpStatus(words)
    row, pair = (Label(kind, place=Place(interval=k)) for kind, k in (("clock", 7), ("gap", 3)))
    residuals = Residuals(2.0, violation, 3e-9 if solved else 2e-3, 4e-5, row, pair)
    report = NlpReport(
        sigma=1e-2, velocity_level_sigma=10.0, status=status, iterations=5, seconds=0.1, residuals=residuals
    )
    return MpccSolution(
        w=np.zeros(0),
        residuals=residuals,
        feasible=solved,
        solved=solved,
        branch=None,
        status=status,
        reports=[report] * steps,
        build_seconds=0.1,
        solve_seconds=0.2,
    )


@pytest.fixture
def clean(plan: Plan) -> Audit:
    return plan.audit


@pytest.fixture
def dirty(clean: Audit) -> Audit:
    return clean.model_copy(update={"max_energy_error": 0.25, "min_gap": -0.02, "violations": ["min_gap"]})


def test_solved_and_audited(clean: Audit) -> None:
    """Solved means converged and audited; the sentence tells the complementarity reached."""
    status = status_of(solution("converged", solved=True), clean, REACHED, 1e-8)
    assert status.solved and status.audit_passed and status.nlp == "converged"
    assert status.message == "Solved to complementarity 3.0e-09; the physics audit passed."


def test_residuals_are_passed_on(clean: Audit) -> None:
    """The numbers beside the verdict are the solution's residuals."""
    status = status_of(solution("infeasible", violation=0.5), clean, REACHED, 1e-8)
    assert (status.complementarity, status.natural_residual, status.constraint_violation) == (2e-3, 4e-5, 0.5)


def test_converged_but_not_physical(dirty: Audit) -> None:
    """A converged solve whose audit failed is not solved; entries beyond their limit are named with value and unit."""
    status = status_of(solution("converged", solved=True), dirty, REACHED, 1e-8)
    assert not status.solved and not status.audit_passed
    assert status.message.startswith("Not solved: the numbers converged but the physics audit failed")
    assert "(min_gap = -2.00e-02 m)" in status.message and "max_energy_error" not in status.message
    assert "method.stages" in status.message


def test_the_worst_finding_is_the_message(dirty: Audit) -> None:
    """Where the audit has a finding about a violated entry, its sentence says what is wrong; notes alone do not."""
    note, pull, gap = (
        Finding(entry=entry, sentence=f"At t = 1 s {entry} is wrong.") for entry in ("replay", "pull", "min_gap")
    )
    found = dirty.model_copy(update={"findings": [note, gap, pull], "violations": ["pull", "min_gap"]})
    message = status_of(solution("converged", solved=True), found, REACHED, 1e-8).message
    assert message == (
        "Not solved: the numbers converged but the physics audit failed in 2 entries. At t = 1 s min_gap is wrong."
    )
    noted = dirty.model_copy(update={"findings": [note]})
    assert "(min_gap = -2.00e-02 m)" in status_of(solution("converged", solved=True), noted, REACHED, 1e-8).message


@pytest.mark.parametrize(("height", "solved"), [(5e-4, False), (0.1, True)])
def test_jumps_that_do_not_leave_the_ground(clean: Audit, height: float, solved: bool) -> None:
    """A motion that should jump and only glides is not solved, and is told so; without jumps it is."""
    flight = Flight(start=0.0, end=0.1, length=0.2, height=height)
    outcome = Outcome(goal=[], contacts={"foot": ContactOutcome(flights=[flight]), "hand": ContactOutcome()})
    found = status_of(solution("converged", solved=True), clean, outcome, 1e-8, jumps=True)
    assert found.solved == solved and found.audit_passed
    assert found.message.startswith("Solved" if solved else "Not solved: the reference asks for jumps, but no contact")
    assert status_of(solution("converged", solved=True), clean, outcome, 1e-8).solved


def missed(name: str, unit: str, by: float, tolerance: float | None = 0.01) -> GoalEntry:
    """An entry of a goal of zero that is missed by so much."""
    met = None if tolerance is None else by <= tolerance
    kind = "velocity" if unit.endswith("/s") else "position"
    return GoalEntry(name=name, kind=kind, unit=unit, goal=0.0, end=by, missed_by=by, tolerance=tolerance, met=met)


def test_a_missed_goal_is_named(clean: Audit) -> None:
    """If the goal alone is missed, what ends where is said, three at most, farthest in units of its tolerance first."""
    late = clean.model_copy(update={"max_goal_violation": 0.3, "violations": ["max_goal_violation"]})
    entries = [
        missed("root_z", "m", 0.02),
        missed("root_x", "m", 0.3125),
        missed("leg", "m", 0.25, tolerance=None),
        missed("root_pitch", "rad", 0.4, tolerance=0.2),
        missed("root_x velocity", "m/s", 0.005),
        missed("leg velocity", "m/s", 5.0, tolerance=0.0),
    ]
    status = status_of(solution("converged", solved=True), late, Outcome(goal=entries, contacts={}), 1e-8)
    assert not status.solved and not status.audit_passed
    assert status.message.startswith(
        "Not solved: the goal is missed, leg velocity ends at 5 m/s, 5 from 0 (0 allowed), "
    )
    assert "root_x ends at 0.3125 m, 0.312 from 0 (0.01 allowed)" in status.message
    assert "and 1 more; try" in status.message and "goal.tolerance" in status.message
    also = late.model_copy(update={"min_gap": -0.02, "violations": ["min_gap", "max_goal_violation"]})
    both = status_of(solution("converged", solved=True), also, Outcome(goal=entries, contacts={}), 1e-8)
    assert "physics audit failed (min_gap = -2.00e-02 m, max_goal_violation = 3.00e-01" in both.message


@pytest.mark.parametrize(
    ("nlp", "advice"),
    [
        ("iteration limit", "solver.max_iterations"),
        ("time limit", "solver.time_limit"),
        ("infeasible", "horizon.duration"),
        ("interrupted", "best iterate so far"),
        ("failed: a value or derivative is not a number", "solver.sigma_start"),
    ],
)
def test_not_converged(nlp: str, advice: str, clean: Audit) -> None:
    """Every way to fail is named, with where it failed, what is wrong there and a key to change."""
    status = status_of(solution(nlp, violation=0.5), clean, REACHED, 1e-8)
    assert not status.solved and status.audit_passed and status.nlp == nlp
    assert status.message.startswith(f"Not solved: {nlp} at sigma = 1e-02; ")
    assert "largest constraint violation 5.0e-01 at clock, interval 7" in status.message
    assert advice in status.message


def test_feasible_but_not_complementary(clean: Audit) -> None:
    """If only complementarity is missing, the worst pair and the tolerance are reported."""
    message = status_of(solution("iteration limit"), clean, REACHED, 1e-8).message
    assert "complementarity is 2.0e-03 (asked for 1e-08), worst at gap, interval 3" in message


def test_an_interval_that_ran_out_of_elements(clean: Audit) -> None:
    """If the worst place lies in an interval without an element to spare, that is said; in another one it is not."""
    there, elsewhere = (
        status_of(solution("infeasible", violation=0.5), clean, REACHED, 1e-8, None, [k]) for k in (7, 3)
    )
    assert "interval 7 ran out of finite elements" in there.message and "method.elements" in there.message
    assert "ran out" not in elsewhere.message


def test_no_nlp_was_run(clean: Audit) -> None:
    """A time limit that leaves no time for a single NLP is a status too."""
    status = status_of(solution("time limit", steps=0), clean, REACHED, 1e-8)
    assert not status.solved and "time limit" in status.message


def test_the_kind_of_point_stands_beside_the_verdict(clean: Audit) -> None:
    """A certificate is reported as it is, and does not decide whether a plan is solved."""
    certificate = Certificate(kind="M", b_stationary="refuted", biactive=7, unresolved=2, residual=1e-7)
    status = status_of(solution("converged", solved=True), clean, REACHED, 1e-8, certificate)
    assert status.solved
    assert (status.stationarity, status.b_stationary, status.biactive, status.unresolved) == ("M", "refuted", 7, 2)
    unknown = status_of(solution("time limit"), clean, REACHED, 1e-8)
    assert (unknown.stationarity, unknown.b_stationary) == ("unknown", "unknown")


def test_a_refuted_certificate_has_its_reason(clean: Audit) -> None:
    """The reason names the contact and the intervals that a direction changes, and how often it was followed."""
    leaving = tuple(Label("gap", contact="foot", place=Place(interval=k)) for k in (3, 4, 7))
    refuted = Certificate("M", "refuted", 3, 0, 0.0, slope=-2e-6, leaving=leaving, followed=2)
    status = status_of(solution("converged", solved=True), clean, REACHED, 1e-8, refuted)
    assert status.solved and status.b_stationary_reason == (
        "the linearised cost falls (slope -2.0e-06) by changing contact 'foot' in intervals 3 to 4 and 7; "
        "2 branches there gain nothing"
    )
    certified = status_of(
        solution("converged", solved=True), clean, REACHED, 1e-8, replace(refuted, b_stationary="certified")
    )
    assert certified.b_stationary_reason == ""


def test_without_an_answer_there_is_a_bound(clean: Audit) -> None:
    """Where the search over branches came to no answer, it is said by how much the linearised cost falls at most."""
    for bound, words in (
        (-9.4e-4, "on no branch does the linearised cost fall by more than a slope of -9.4e-04"),
        (-np.inf, ""),
    ):
        unknown = Certificate("W", "unknown", 3, 0, 0.0, bound=bound)
        status = status_of(solution("converged", solved=True), clean, REACHED, 1e-8, unknown)
        assert status.b_stationary_reason == words and words in stationarity_sentence(status)


def audit_of(**values: float) -> Audit:
    """An audit of these values and zeros."""
    return Audit.of({**dict.fromkeys(ENTRIES, 0.0), **values}, AuditScales(weight=10.0, turnover=10.0))


def test_a_near_miss_says_by_how_much() -> None:
    """Entries beyond their limits by a few per cent are a near miss, with value, limit and percentage."""
    found = audit_of(max_energy_error=2.06e-2, min_gap=-1.05e-3)
    status = status_of(solution("converged", solved=True), found, REACHED, 1e-8)
    assert not status.solved and not status.audit_passed and status.near_miss
    assert status.message == (
        "Not solved, but nearly: of the physics audit all but min_gap (-0.00105 of -0.001 m, 5 % more), "
        "max_energy_error (0.0206 of 0.02 J, 3 % more) passed."
    )


@pytest.mark.parametrize("energy", [2.4e-2, np.nan])
def test_a_miss_that_is_not_near(energy: float) -> None:
    """One entry that is far beyond its limit, or no number, makes the whole plan no near miss."""
    found = audit_of(max_energy_error=energy, min_gap=-1.05e-3)
    status = status_of(solution("converged", solved=True), found, REACHED, 1e-8)
    assert not status.near_miss and status.message.startswith("Not solved: the numbers converged but the physics audit")


def test_a_solve_that_has_not_converged_is_no_near_miss() -> None:
    """What is near is the motion, not the audit alone."""
    status = status_of(solution("infeasible"), audit_of(max_energy_error=2.06e-2), REACHED, 1e-8)
    assert not status.near_miss and "nearly" not in status.message


def test_limits_of_the_task_are_named() -> None:
    """A plan that passes an audit with limits of its task says which, and what the defaults are."""
    values = {**dict.fromkeys(ENTRIES, 0.0), "max_energy_error": 0.04}
    found = Audit.of(values, AuditScales(weight=10.0, turnover=10.0), {"max_energy_error": 0.05})
    status = status_of(solution("converged", solved=True), found, REACHED, 1e-8)
    assert status.solved and status.message.endswith(
        "the physics audit passed with limits of the task (max_energy_error 0.05 J, default 0.02 J)."
    )
