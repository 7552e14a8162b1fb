"""The sentences that open a report are true of the plan they are about."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fesd_robot.planning.planner import plan as planned
from fesd_robot.plans import Plan, report
from fesd_robot.plans.glossary import GLOSSARY
from fesd_robot.plans.outcome import ContactOutcome, Flight, GoalEntry, Outcome, Slide
from fesd_robot.plans.sentences import (
    contact_sentence,
    control_peaks,
    effort_sentence,
    force_sentence,
    goal_sentence,
    limits_of_controls,
    rest_sentence,
    sentences,
)
from fesd_robot.plans.stationarity_words import stationarity_sentence


def entry(met: bool | None, end: float = 0.75, **fields: Any) -> GoalEntry:
    """Return what came of the goal root_x = 1 m."""
    tolerance = None if met is None else 0.3 if met else 0.1
    values = {"name": "root_x", "kind": "position", "unit": "m", "goal": 1.0, "end": end, "missed_by": abs(1.0 - end)}
    return GoalEntry.model_validate({**values, "tolerance": tolerance, "met": met, **fields})


def with_goal(plan: Plan, *entries: GoalEntry, **contacts: ContactOutcome) -> Plan:
    """Return a plan with another outcome, of a motion that breaks nothing."""
    audit = plan.audit.model_copy(update={"violations": []})
    return plan.model_copy(update={"outcome": Outcome(goal=list(entries), contacts=contacts), "audit": audit})


@pytest.mark.parametrize(
    ("entries", "sentence"),
    [
        (
            [entry(True)],
            "one value within tolerance; root_x uses most of it, 0.25 of 0.3 m.",
        ),
        ([entry(False)], "The goal is missed: root_x ends at 0.75 m, 0.25 m from 1 m (0.1 m allowed)."),
        ([entry(None)], "The goal is soft, without a tolerance: the motion ends away from it by 0.25 m (root_x)."),
        ([entry(True, 1.0, tolerance=0.0)], "The goal is reached: of one value none is missed by more than 0."),
        ([], "The task lists no value that its motion should reach."),
        ([entry(False)] * 5, "and 2 more values are missed."),
    ],
)
def test_a_goal_is_reached_missed_or_soft(plan: Plan, entries: list[GoalEntry], sentence: str) -> None:
    """The first sentence says which, with the number that decides it."""
    assert goal_sentence(with_goal(plan, *entries)).endswith(sentence)


def test_a_motion_that_breaks_the_audit_reaches_nothing(plan: Plan) -> None:
    """Where it ends is no success if it gets there against the laws of physics."""
    good = with_goal(plan, entry(True))
    broken = good.model_copy(
        update={"audit": good.audit.model_copy(update={"violations": ["max_dynamics_error", "max_goal_violation"]})}
    )
    assert goal_sentence(broken) == (
        "No valid motion was found: this one ends at its goal, but breaks limits of the audit (max_dynamics_error)."
    )


def test_flights_and_slides_have_times_and_distances(plan: Plan) -> None:
    """Of each contact; many of them are counted, and a gap of micrometres is no flight."""
    jump, hover = Flight(start=0.1, end=0.3, length=0.5, height=0.2), Flight(start=0.0, end=0.1, length=0, height=2e-5)
    slide = Slide(start=0.3, end=0.4, distance=0.03)
    contacts = {
        "a": ContactOutcome(flights=[hover, jump], slides=[slide]),
        "b": ContactOutcome(),
        "c": ContactOutcome(slides=[slide] * 4),
    }
    sentence = contact_sentence(with_goal(plan, **contacts))
    assert "a flies from 0.1 to 0.3 s over 0.5 m (gap up to 0.2 m)" in sentence
    assert "is unloaded just above its surface from 0 to 0.1 s" in sentence
    assert "slides from 0.3 to 0.4 s over 0.03 m" in sentence
    assert "b never leaves its surface, and does not slide" in sentence
    assert "slides 4 times, 0.12 m in all and 0.03 m at most" in sentence


def test_the_hardest_control_is_named(plan: Plan) -> None:
    """That with the largest share of the limit on its side, and when; a limit of zero is no measure."""
    controls = {"time": np.array([0.0, 0.1]), "a": np.array([-3.0, 4.0]), "b": np.array([8.0, 1.0])}
    units = plan.units.model_copy(update={"controls": {"a": "N m", "b": "N"}})
    limits = {"a": (-4.0, 10.0), "b": (0.0, 16.0)}
    busy = plan.model_copy(update={"controls": controls, "units": units, "control_limits": limits})
    assert effort_sentence(busy) == "a works hardest: -3 N m from 0 to 0.1 s, 75 % of its limit."
    full = busy.model_copy(update={"control_limits": {"a": (-3.0, 4.0), "b": (0.0, 8.0)}})
    assert effort_sentence(full).endswith("all of its limit; b reaches its limit, too.")
    assert [each.share for each in control_peaks(full)] == [1.0, 1.0]


def test_limits_of_earlier_plans_are_those_of_their_task(plan: Plan) -> None:
    """A plan that does not record its limits has those that its task gives; without any it says so."""
    old = plan.model_copy(update={"control_limits": None})
    name = next(name for name in old.controls if name != "time")
    bare = {
        **old.task,
        "limits": {**old.task["limits"], "effort": {}},
        "robot": {**old.task["robot"], "actuators": None},
    }
    assert "this plan does not record the limits" in effort_sentence(old.model_copy(update={"task": bare}))
    given = {**bare, "limits": {**bare["limits"], "effort": {name: [-2.0, 3.0]}}}
    assert limits_of_controls(old.model_copy(update={"task": given})) == {name: (-2.0, 3.0)}


def test_the_largest_force_is_that_of_the_samples(plan: Plan) -> None:
    """Its size, place and time are those of the largest sample; without forces the sentence says so."""
    (name, contact), *_ = plan.contacts.items()
    sizes = np.hypot(contact.normal_force, contact.tangential_force)
    peak = int(np.argmax(sizes))
    assert f"{sizes[peak]:.3g} N" in force_sentence(plan) and f"on {name} at {plan.trajectory.time[peak]:.3g} s" in (
        force_sentence(plan)
    )
    none = contact.model_copy(update={"normal_force": 0 * sizes, "tangential_force": 0 * sizes})
    quiet = plan.model_copy(update={"contacts": {name: none}, "impulses": []})
    assert force_sentence(quiet) == "No contact carries a force; there is no impact."


def test_rest_is_that_of_every_coordinate(plan: Plan) -> None:
    """One coordinate faster than 0.01 at the end is enough to be in motion."""
    still = {name: 0 * values for name, values in plan.trajectory.velocity.items()}
    last = list(still)[-1]
    moving = {**still, last: np.append(still[last][:-1], -0.02)}
    for velocity, words in ((still, "It ends at rest"), (moving, "It does not end at rest")):
        changed = plan.trajectory.model_copy(update={"velocity": velocity})
        sentence = rest_sentence(plan.model_copy(update={"trajectory": changed}))
        assert sentence.startswith(words)
    assert f"({last})" in sentence and "0.02" in sentence


def test_cheaper_motions_are_said_in_words(plan: Plan) -> None:
    """Certified, refuted with its reason, or not known and why."""
    status = plan.status
    certified = status.model_copy(update={"b_stationary": "certified", "stationarity": "S"})
    refuted = status.model_copy(update={"b_stationary": "refuted", "b_stationary_reason": "because"})
    unknown = status.model_copy(update={"b_stationary": "unknown", "stationarity": "unknown", "solved": False})
    timed_out = status.model_copy(update={"b_stationary": "unknown", "stationarity": "C", "unresolved": 3})
    assert stationarity_sentence(certified).startswith("There is no cheaper motion nearby")
    assert stationarity_sentence(refuted) == "A cheaper motion may be nearby: because."
    assert "is not known: it is asked of solved problems only" in stationarity_sentence(unknown)
    assert "came to no answer in its time; of 3 pairs" in stationarity_sentence(timed_out)


def test_a_soft_goal_is_a_wish(short_plan: Plan) -> None:
    """A real plan of a soft goal: solved, its limits recorded, five sentences before the tables."""
    assert short_plan.status.solved and short_plan.control_limits is not None
    assert goal_sentence(short_plan).startswith("The goal is soft")
    assert "of its limit" in effort_sentence(short_plan)
    first = report(short_plan).split("## ")[0]
    assert all(f"- {sentence}\n" in first for sentence in sentences(short_plan)) and len(sentences(short_plan)) == 5


def test_what_was_interrupted_claims_nothing(load_short: Any) -> None:
    """A real iterate of an interrupted solve is no valid motion, and nothing is known about cheaper ones."""
    calls = iter(range(1000))
    iterate = planned(load_short(), stop=lambda *_: next(calls) > 20)
    assert not iterate.status.solved
    assert goal_sentence(iterate).startswith("No valid motion was found")
    assert "not known" in stationarity_sentence(iterate.status)
    assert len(sentences(iterate)) == 5


def test_the_words_of_the_numbers_are_explained(short_plan: Plan) -> None:
    """The glossary of a report is in the order of the alphabet and has the words of its tables."""
    assert list(GLOSSARY) == sorted(GLOSSARY, key=str.lower)
    text = report(short_plan)
    assert all(f"| {word} | {meaning} |" in text for word, meaning in GLOSSARY.items())
    for word in ("biactive pair", "complementarity", "natural residual", "NLP", "sigma"):
        assert word in GLOSSARY and word in text.split("### Words")[0]
