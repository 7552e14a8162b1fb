"""The head of the page of a plan: whether it is solved, in one sentence, and the figures beside it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fesd_robot.exactness import ROUNDED
from fesd_robot.plans import goal_words

if TYPE_CHECKING:
    from fesd_robot.ocp import Actuation
    from fesd_robot.plans import Plan


@dataclass(frozen=True)
class Verdict:
    """Whether a plan is solved, why in one sentence, and the words of the badge."""

    solved: bool
    sentence: str
    words: str = ""

    @property
    def badge(self) -> str:
        """The words of the badge."""
        return self.words or ("solved" if self.solved else "not solved")


def verdict_of(plan: Plan) -> Verdict:
    """Return whether a plan is solved, and whether its goal is reached."""
    if plan.simulation is not None:
        return Verdict(plan.status.solved, plan.status.message, "simulated" if plan.status.solved else "not unique")
    if not plan.status.solved:
        return Verdict(False, plan.status.message)
    goal = [] if plan.outcome is None else plan.outcome.goal
    if not goal or plan.outcome is None:
        return Verdict(True, "The motion obeys the laws of contact: the physics audit passed.")
    if any(entry.met is False for entry in goal):
        words = goal_words(plan.outcome)
        return Verdict(True, f"The motion obeys the laws of contact, but misses its goal: {words}.")
    if any(entry.met is None for entry in goal):
        return Verdict(True, f"The motion obeys the laws of contact; its goal is soft: {goal_words(plan.outcome)}.")
    return Verdict(True, "The robot reaches its goal within the tolerance, and the physics audit passed.")


def goal_rows(plan: Plan) -> list[tuple[str, str, str, str]]:
    """Return name, goal, end and miss of every position of the goal, and of the worst velocity of each unit."""
    if plan.outcome is None:
        return []
    positions = [entry for entry in plan.outcome.goal if entry.kind == "position"]
    return [
        (
            f"{entry.name} ({entry.unit})",
            _rounded(entry.goal),
            _rounded(entry.end),
            f"{entry.missed_by if entry.missed_by >= ROUNDED else 0.0:.2g}",
        )
        for entry in [*positions, *plan.outcome.largest_misses("velocity")]
    ]


def effort_facts(plan: Plan, actuation: Actuation) -> list[tuple[str, str]]:
    """Return the cost, and the control that comes nearest to its limit, both in words."""
    facts = [] if plan.simulation is not None else [("cost", f"{plan.statistics.objective:.4g}")]
    peaks = []
    for name, low, high, unit in zip(actuation.names, actuation.lower, actuation.upper, actuation.units, strict=True):
        for value, limit in ((float(np.max(plan.controls[name])), high), (float(np.min(plan.controls[name])), low)):
            if limit * value > 0 and np.isfinite(limit):
                peaks.append((value / limit, f"{name} {value:.3g} of {limit:g} {unit}, {100 * value / limit:.0f} %"))
    return [*facts, ("peak effort", max(peaks)[1])] if peaks else facts


def _rounded(value: float) -> str:
    return f"{round(value, 4) + 0.0:g}"
