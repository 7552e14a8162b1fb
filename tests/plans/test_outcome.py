"""The goal beside the end, and what terminal, report and page say about an outcome."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from fesd_robot.cli.summary import summary
from fesd_robot.ocp import MotionProblem
from fesd_robot.ocp.vectors import endpoints_of
from fesd_robot.plans import Plan, read_plan, report, write_plan
from fesd_robot.plans.goal_outcome import goal_entries
from fesd_robot.plans.outcome import ContactOutcome, Flight, GoalEntry, Outcome, Slide
from fesd_robot.plans.outcome_words import contact_words, goal_words, miss_words
from fesd_robot.render.outputs import outcome_facts
from fesd_robot.task import load_task

from .conftest import TASK
from .motions import tumble

Q = np.array([0.3, 1.1, 0.2, 0.4])
V = np.array([1.0, -0.5, 0.25, 2.0])
COORDINATES = ("root_x", "root_z", "root_pitch", "leg")


def entries_of(hopper: MotionProblem, goal: str) -> dict[str, GoalEntry]:
    """Return the entries of a goal for a motion that ends at Q, V, by name."""
    task = load_task(TASK, ["costs={}", "reference={type: line}", f"goal={goal}"])
    motion = tumble()
    motion.configuration[-1], motion.velocity[-1] = Q, V
    ends = endpoints_of(task, hopper.robot)
    entries = goal_entries(task, hopper.robot, motion, (ends.goal_configuration, ends.goal_velocity))
    assert len({entry.name for entry in entries}) == len(entries)
    for entry in entries:
        assert entry.missed_by == abs(entry.end - entry.goal)
        assert (entry.met is None) == (entry.tolerance is None)
    return {entry.name: entry for entry in entries}


def test_coordinates_that_are_listed_and_all_velocities(hopper: MotionProblem) -> None:
    """A goal for one coordinate gives its entry, and all velocities, wanted to be zero; nothing is hard."""
    entries = entries_of(hopper, "{configuration: {root_x: 0.5}}")
    assert list(entries) == ["root_x", *(f"{name} velocity" for name in COORDINATES)]
    assert entries["root_x"].missed_by == pytest.approx(0.2, abs=1e-15)
    assert [entries[f"{name} velocity"].end for name in COORDINATES] == V.tolist()
    assert {entry.goal for name, entry in entries.items() if name != "root_x"} == {0.0}
    assert {entry.met for entry in entries.values()} == {None}
    assert [entries[name].unit for name in ("root_x", "root_x velocity", "root_pitch velocity")] == [
        "m",
        "m/s",
        "rad/s",
    ]


def test_velocities_that_are_listed_alone(hopper: MotionProblem) -> None:
    """Where the goal has a velocity, only those that it lists, or gives a tolerance, are compared."""
    entries = entries_of(hopper, "{velocity: {root_x: 0.8}, tolerance: {velocity: {leg: 0.1}}}")
    assert {name: (entry.goal, entry.met) for name, entry in entries.items()} == {
        "root_x velocity": (0.8, None),
        "leg velocity": (0.0, False),
    }


@pytest.mark.parametrize(("width", "met"), [(0.21, True), (0.19, False)])
def test_a_tolerance_is_kept_or_not(width: float, met: bool, hopper: MotionProblem) -> None:
    """`met` compares the miss, 0.2 m, with the tolerance."""
    goal = f"{{configuration: {{root_x: 0.5}}, tolerance: {{configuration: {{root_x: {width}}}}}}}"
    entry = entries_of(hopper, goal)["root_x"]
    assert (entry.tolerance, entry.met) == (width, met)


def test_frames_and_the_centre_of_mass(hopper: MotionProblem) -> None:
    """The foot is at x + r sin, z - r cos; the centre of mass is the root's; axes of null are left out."""
    foot = "{foot: {position: [0.3, null, 0], tolerance: 0.01, velocity: {x: 1}}}"
    entries = entries_of(hopper, f"{{frames: {foot}, center_of_mass: {{position: {{z: 1}}}}}}")
    x, z, pitch, leg = Q
    closed_form = {
        "frame foot x position": x + leg * np.sin(pitch),
        "frame foot z position": z - leg * np.cos(pitch),
        "frame foot x velocity": V[0] + V[3] * np.sin(pitch) + leg * np.cos(pitch) * V[2],
        "center of mass z position": z,
    }
    assert {name: entry.end for name, entry in entries.items()} == pytest.approx(closed_form, abs=1e-12)
    assert [entry.tolerance for entry in entries.values()] == [0.01, 0.01, None, None]
    assert not entries["frame foot z position"].met


def test_a_period_compares_changes_with_the_stride(hopper: MotionProblem) -> None:
    """Of a periodic motion every change is compared with the stride, with no tolerance but the audit's accuracy."""
    first = tumble()
    entries = entries_of(hopper, "{periodic: {stride: {root_x: 0.2}}}")
    changes = {f"change of {name}": Q[i] - first.configuration[0, i] for i, name in enumerate(COORDINATES)}
    changes |= {f"change of {name} velocity": V[i] - first.velocity[0, i] for i, name in enumerate(COORDINATES)}
    assert {name: entry.end for name, entry in entries.items()} == pytest.approx(changes)
    assert entries["change of root_x"].met and not entries["change of root_z"].met
    assert {entry.tolerance for entry in entries.values()} == {0.0}


def test_a_mirrored_coordinate_is_compared_with_its_partner(hopper: MotionProblem) -> None:
    """The end of each is held against the beginning of the other, with its sign; others are compared as before."""
    first = tumble()
    entries = entries_of(hopper, "{periodic: {mirror: {root_x: -root_z}, stride: {leg: -0.1}}}")
    expected = {
        "root_x, mirrored": (-first.configuration[0, 1], Q[0]),
        "root_z, mirrored": (-first.configuration[0, 0], Q[1]),
        "root_x velocity, mirrored": (-first.velocity[0, 1], V[0]),
        "root_z velocity, mirrored": (-first.velocity[0, 0], V[1]),
        "change of leg": (-0.1, Q[3] - first.configuration[0, 3]),
        "change of leg velocity": (0.0, V[3] - first.velocity[0, 3]),
    }
    assert expected.keys() < entries.keys() and len(entries) == 8
    for name, ends in expected.items():
        assert (entries[name].goal, entries[name].end) == pytest.approx(ends), name


def entry(name: str, unit: str, missed_by: float, met: bool | None = None) -> GoalEntry:
    """Return an entry that is missed by so much."""
    kind = "velocity" if unit.endswith("/s") else "position"
    tolerance = None if met is None else 0.01
    return GoalEntry(
        name=name, kind=kind, unit=unit, goal=0, end=missed_by, missed_by=missed_by, tolerance=tolerance, met=met
    )


JUMP = Outcome(
    goal=[
        entry("root_x", "m", 0.0826, met=False),
        entry("leg", "m", 0.03),
        entry("root_pitch", "rad", 0.2),
        entry("root_x velocity", "m/s", 0.5866),
        entry("root_z velocity", "m/s", 0.04),
    ],
    contacts={
        "foot": ContactOutcome(
            flights=[
                Flight(start=0, end=0.25, length=0.353, height=0.2, open_start=True),
                Flight(start=0.5, end=1, length=0.1, height=0.6),
            ],
            slides=[Slide(start=0.25, end=0.3, distance=0.002), Slide(start=0.4, end=0.5, distance=0.602)],
        ),
        "hand": ContactOutcome(),
    },
)


def test_the_words_name_the_largest_miss_of_every_unit() -> None:
    """m and rad, m/s and rad/s are not compared; a tolerance that is not kept is named."""
    assert goal_words(JUMP) == (
        "position missed by 0.0826 m (root_x), 0.2 rad (root_pitch); velocity missed by 0.587 m/s (root_x velocity); "
        "outside the tolerance: root_x"
    )
    assert miss_words(JUMP, "velocity") == "0.587 m/s"
    assert [each.name for each in JUMP.largest_misses("position")] == ["root_x", "root_pitch"]
    unknown = JUMP.model_copy(update={"goal": [JUMP.goal[0], entry("leg", "m", np.nan)]})
    assert [each.name for each in unknown.largest_misses("position")] == ["leg"], "no number is the worst miss"


def test_the_words_count_flights_slides_and_impacts() -> None:
    """Of several flights the longest and the largest gap are said, of slides the distance of all."""
    foot, hand = JUMP.contacts.values()
    assert contact_words(foot) == (
        "2 flights, up to 0.353 m long, gap up to 0.6 m; 2 slides, 0.604 m in all; 0 impacts"
    )
    assert contact_words(hand) == "no flight; no slide; 0 impacts"


def test_terminal_report_and_page_say_the_same(plan: Plan, tmp_path: Path) -> None:
    """The words of goal and contacts stand in the summary after the verdict, and in the page's table."""
    jump = plan.model_copy(update={"outcome": JUMP})
    lines = summary(jump, tmp_path, tmp_path)
    facts = outcome_facts(jump)
    assert lines[1:4] == [f"{name}: {words}" for name, words in facts]
    assert facts[0] == ("goal", goal_words(JUMP))
    section = report(jump).split("## ")[1]
    assert section.startswith("Outcome\n"), "right after the sentences"
    assert "| root_x | 0 m | 0.0826 m | 0.0826 m | 0.01 m | no |" in section
    assert "| root_x velocity | 0 m/s | 0.5866 m/s | 0.587 m/s | none given |  |" in section
    assert "| foot | 2 | 0.353 | 0.6 | 2 | 0.602 | 0.604 | 0 |  |" in section
    assert "| foot | flight, cut by the start of the motion | 0.000000 | 0.250000 | 0.353 | 0.2 |" in section


def test_the_outcome_of_a_plan_is_that_of_its_motion(plan: Plan, tmp_path: Path) -> None:
    """The outcome of the drop is written to plan.json and read back as it was."""
    assert plan.outcome is not None
    again = read_plan(write_plan(plan, tmp_path / "plan"))
    assert again.outcome == plan.outcome
    ends = {each.name: each.end for each in plan.outcome.goal}
    assert ends["root_x"] == plan.trajectory.configuration["root_x"][-1]
    assert ends["leg velocity"] == plan.trajectory.velocity["leg"][-1]
    impacts = [(impact.time, impact.normal_impulse) for impact in plan.outcome.contacts["foot"].impacts]
    assert impacts == [(impulse.time, impulse.normal) for impulse in plan.impulses]


def test_a_plan_without_an_outcome_is_read(plan: Plan, tmp_path: Path) -> None:
    """A plan of an earlier version has no outcome, and neither report, summary nor page say anything about it."""
    file = write_plan(plan, tmp_path / "plan") / "plan.json"
    data = json.loads(file.read_text(encoding="utf-8"))
    del data["outcome"]
    file.write_text(json.dumps(data), encoding="utf-8")
    old = read_plan(file)
    assert old.outcome is None
    assert "## Outcome" not in report(old) and "## Outcome" in report(plan)
    assert outcome_facts(old) == []
    assert not any(line.startswith(("goal:", "foot:")) for line in summary(old, tmp_path, tmp_path))
