"""Conflicting constraints, in the words of the task."""

from __future__ import annotations

from pathlib import Path

from fesd_robot.complementarity import Label, Place
from fesd_robot.fesd import Transcription
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.mpcc import Conflict, Demand
from fesd_robot.ocp import formulate
from fesd_robot.ocp.judged import conflict_of
from fesd_robot.plans.conflict_words import conflict_words
from fesd_robot.plans.measured import Names
from fesd_robot.task import load_task

TASKS = Path(__file__).parents[2] / "tasks"
NAMES = Names(["foot"], {"root_x": "m", "leg": "m"}, {"root_x": "m/s"}, {"push": "N"})


def _demand(kind: str, subject: str, interval: int | None, price: float, bound: float = 1.0) -> Demand:
    return Demand(Label(kind, subject, place=Place(interval=interval)), bound, True, price)


def test_limits_goals_and_contacts_are_named_with_their_intervals() -> None:
    """The largest price first, neighbouring intervals as ranges, contacts last; the method's own variables are not."""
    conflict = Conflict(
        1.0,
        (
            _demand("state", "foot integrated gap", 2, 9.0, 0.0),
            _demand("algebraic variable", "theta_+[foot]", 2, 8.0),
            _demand("control", "push", 3, 3.0, 40.0),
            _demand("control", "push", 4, 3.0, 40.0),
            _demand("control", "push", 7, 1.0, 40.0),
            _demand("state", "root_x", 9, 5.0, 2.0),
            _demand("state", "root_x velocity", 1, 0.1),
            _demand("state", "leg", None, 7.0),
        ),
    )
    assert conflict_words(conflict, NAMES, intervals=10) == (
        "push at most 40 N in intervals 3 to 4 and 7, the goal root_x at most 2 m, "
        "contact 'foot' on the ground in interval 2"
    )


def test_a_control_with_the_name_of_a_contact_is_a_control() -> None:
    """Only a gap makes a contact."""
    conflict = Conflict(1.0, (_demand("control", "foot", 2, 1.0, 40.0),))
    assert conflict_words(conflict, Names(["foot"], {}, {}, {"foot": "N"}), 10) == "foot at most 40 N in interval 2"


def test_without_a_limit_there_is_nothing_to_say() -> None:
    """Contacts alone are no demand of the task."""
    assert conflict_words(Conflict(1.0, (_demand("state", "foot integrated gap", 2, 9.0),)), NAMES, 10) == ""


def test_a_jump_without_time_names_its_goal() -> None:
    """0.9 m in a tenth of a second: at the reference the goal stands against the limits."""
    motion = formulate(
        load_task(
            TASKS / "hopper_one_jump.yaml", ["method.grid=uniform", "horizon.duration=0.1", "horizon.intervals=4"]
        )
    )
    transcription = Transcription(motion.ocp, motion.fesd)
    words = conflict_of(motion, BranchTranscription(transcription), transcription.problem.start, 20.0)
    assert "the goal root_x at least 0.99 m" in words
    assert conflict_of(motion, BranchTranscription(transcription), transcription.problem.start, 0.0) == ""
