"""Tolerances of a goal where its task gives none."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fesd_robot.errors import TaskError
from fesd_robot.fesd import Transcription
from fesd_robot.ocp import formulate
from fesd_robot.task import DEFAULT_TOLERANCE, Goal, Task

Load = Callable[[str], Task]

GOAL = "  configuration: {root_x: 1}\n"
"""Of the short task."""

NAMES = ["root_x", "root_z", "root_pitch", "leg"]

FRAMES = """\
  frames:
    foot: {position: {x: 0.5}, velocity: {z: 0}}
    body: {position: {z: 0.9}, tolerance: 0.2}
  center_of_mass: {position: [1, null, null]}
"""


def completed_goal(load: Load, short: str, goal: str) -> Goal:
    """The goal of the short task's problem with another section `goal`."""
    assert short.endswith(GOAL)
    return formulate(load(short.removesuffix(GOAL) + goal)).task.goal


def test_listed_values_and_rest_are_hard(short: str, load: Load) -> None:
    """Listed coordinates and, without a velocity in the goal, all velocities are terminal bounds of the tolerance."""
    motion = formulate(load(short))
    tolerance = motion.task.goal.tolerance
    assert DEFAULT_TOLERANCE == 0.01
    assert tolerance.configuration == {"root_x": 0.01} and tolerance.velocity == dict.fromkeys(NAMES, 0.01)
    width = 0.01 * np.ones(4)
    free = np.full(3, np.inf)
    np.testing.assert_allclose(motion.ocp.terminal_lower[:8], [0.99, *-free, *-width])
    np.testing.assert_allclose(motion.ocp.terminal_upper[:8], [1.01, *free, *width])
    assert np.isinf(motion.ocp.terminal_lower[8:]).all()


def test_a_soft_goal_promises_its_own_tolerances_only(short: str, load: Load) -> None:
    """A soft goal stays as it is written: bounds of the end are the tolerances that it gives."""
    goal = completed_goal(load, short, f"  soft: true\n{GOAL}{FRAMES}  tolerance: {{velocity: {{leg: 0.3}}}}\n")
    assert (goal.tolerance.configuration, goal.tolerance.velocity) == ({}, {"leg": 0.3})
    assert [point.tolerance for point in goal.points] == [None, 0.2, None]
    assert all(point.velocity_tolerance is None for point in goal.points)
    ocp = formulate(load(short + "  soft: true\n")).ocp
    assert np.isinf(ocp.terminal_lower).all() and np.isinf(ocp.terminal_upper).all()


def test_given_tolerances_win(short: str, load: Load) -> None:
    """A tolerance in the task, also of zero, replaces the default one; one of an unlisted coordinate is added."""
    given = "  tolerance: {configuration: {root_x: 0.2, leg: 0}, velocity: {root_z: 0}}\n"
    tolerance = completed_goal(load, short, GOAL + given).tolerance
    assert tolerance.configuration == {"root_x": 0.2, "leg": 0}
    assert tolerance.velocity == {**dict.fromkeys(NAMES, 0.01), "root_z": 0}


def test_a_goal_with_a_velocity_is_no_rest(short: str, load: Load) -> None:
    """Where the goal lists a velocity, also of a frame, the listed ones are hard and the others free."""
    tolerance = completed_goal(load, short, f"{GOAL}  velocity: {{root_x: 0.5}}\n").tolerance
    assert (tolerance.configuration, tolerance.velocity) == ({"root_x": 0.01}, {"root_x": 0.01})
    assert completed_goal(load, short, GOAL + FRAMES).tolerance.velocity == {}


def test_frames_and_the_centre_of_mass_are_hard(short: str, load: Load) -> None:
    """Positions and velocities of points get tolerances where they have none; a point at rest means all at rest."""
    goal = completed_goal(load, short, FRAMES)
    assert [point.tolerance for point in goal.points] == [0.01, 0.2, 0.01]
    assert [point.velocity_tolerance for point in goal.points] == [0.01, None, None]
    assert goal.tolerance.configuration == {}
    resting = completed_goal(load, short, "  frames: {foot: {position: {x: 0.5}}}\n")
    assert resting.tolerance.velocity == dict.fromkeys(NAMES, 0.01)


def test_contacts_to_stand_on_are_hard(short: str, load: Load) -> None:
    """What `stand_on` finds is as hard as a written value: the height at which the foot touches."""
    goal = completed_goal(load, short, f"{GOAL}  stand_on: [foot]\n")
    assert set(goal.tolerance.configuration) >= {"root_x", "root_z"} and goal.configuration["root_z"] == 0.5


def test_an_empty_goal_promises_nothing(short: str, load: Load) -> None:
    """A task without a goal has no bounds at its end."""
    goal = formulate(load(short.removesuffix(f"goal:\n{GOAL}"))).task.goal
    assert (goal.tolerance.configuration, goal.tolerance.velocity) == ({}, {})


@pytest.mark.parametrize("goal", [GOAL, GOAL + FRAMES, f"{GOAL}  soft: true\n", f"{GOAL}  stand_on: [foot]\n"])
def test_a_completed_task_stays_as_it_is(short: str, load: Load, goal: str) -> None:
    """The task of a problem can be formulated again and has the same tolerances, as that of a plan must."""
    once = formulate(load(short.removesuffix(GOAL) + goal))
    twice = formulate(once.task)
    assert twice.task == once.task
    np.testing.assert_array_equal(twice.ocp.terminal_lower, once.ocp.terminal_lower)


def test_limits_that_exclude_rest(short: str, load: Load) -> None:
    """Rest that a velocity limit forbids is refused in one sentence with the key; another goal velocity is not."""
    moving = short.replace("leg: 0.5}}", "leg: 0.5}, velocity: {root_x: 1}}")
    limits = "limits: {velocity: {root_x: [0.5, 2]}}\n"
    with pytest.raises(TaskError) as caught:
        formulate(load(moving + limits))
    assert caught.value.key == "goal"
    assert caught.value.message == (
        "found no velocity, which means rest, but 'root_x' is limited to [0.5, 2], expected goal.velocity.root_x "
        "within its limits, or goal.soft: true"
    )
    for other in ("  velocity: {root_x: 1}\n", "  soft: true\n"):
        assert formulate(load(moving + other + limits)).limits.lower_velocity[0] == 0.5


def test_a_period_is_neither_soft_nor_hard_twice(short: str, load: Load) -> None:
    """A motion that repeats gets no tolerances, and `soft` beside it is refused."""
    periodic = "  periodic: {stride: {root_x: 1}}\n"
    goal = completed_goal(load, short, periodic)
    assert (goal.tolerance.configuration, goal.tolerance.velocity) == ({}, {})
    with pytest.raises(TaskError) as caught:
        load(short.removesuffix(GOAL) + periodic + "  soft: true\n")
    assert caught.value.key == "goal.soft"
    assert "found true beside 'periodic', which always holds exactly" in caught.value.message


@pytest.mark.parametrize(
    ("goal", "closed"),
    [
        ("  configuration: {root_x: 1}\n  stand_on: [foot]\n", True),
        ("  configuration: {root_x: 1}\n  stand_on: [foot]\n  velocity: {root_x: 0}\n", False),
        ("  configuration: {root_x: 1}\n  stand_on: [foot]\n  soft: true\n", False),
        (GOAL, False),
    ],
)
def test_rest_on_a_contact_is_no_apex(short: str, load: Load, goal: str, closed: bool) -> None:
    """A hard goal at rest that stands on a contact closes its gap in the whole last interval, and only there."""
    assert short.endswith(GOAL)
    motion = formulate(load(short.removesuffix(GOAL) + goal))
    gap = list(motion.ocp.system.state_names).index("foot integrated gap")
    assert (motion.ocp.last_state_upper[gap] == 0.0) == closed and np.isinf(motion.ocp.state_upper[gap])
    transcription = Transcription(motion.ocp, motion.fesd)
    problem, last = transcription.problem, motion.ocp.intervals - 1
    layout = transcription.layouts[transcription.elements[last]]
    for k, expected in ((last, 0.0 if closed else np.inf), (last - 1, np.inf)):
        offset = transcription.indices.offsets[k]
        for n in range(transcription.elements[k]):
            for j in range(layout.stages):
                assert problem.upper[offset + layout.state(n, j).start + gap] == expected
