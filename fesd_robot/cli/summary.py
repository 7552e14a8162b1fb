"""A plan in a few lines, for the end of a run."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from fesd_robot.plans import Plan
    from fesd_robot.plans.plan import ContactHistory

SHOWN_CONTACTS = 3


def summary(plan: Plan, folder: Path, shown: Path) -> list[str]:
    """Return the verdict, what the contacts did, the effort, and the files.

    Args:
        folder: where the files are.
        shown: the folder as the user wrote it.
    """
    from fesd_robot.plans.files import FILES

    effort = plan.statistics
    names = [name + ("/" if (folder / name).is_dir() else "") for name in FILES if (folder / name).exists()]
    return [
        f"{plan.name}: {plan.status.message}",
        *contact_lines(plan),
        f"{plan.trajectory.time[-1]:.6g} s of motion, cost {effort.objective:.6g}; {effort.variables} variables, "
        f"{effort.pairs} pairs, {effort.iterations} iterations in {effort.solve_seconds:.1f} s",
        *_attempts(plan),
        f"written to {shown}: {', '.join(names)}",
    ]


def _attempts(plan: Plan) -> list[str]:
    """Return which attempt the plan is of, if there were several."""
    attempts, kept = plan.statistics.attempts, plan.statistics.kept_attempt
    if len(attempts) < 2 or kept is None:
        return []
    settings = ", ".join(f"{key} = {value}" for key, value in kept.changes.items()) or "the task as written"
    outcome = f"solved with {settings}" if kept.solved else f"none solved, kept is that with {settings}"
    return [f"{len(attempts)} attempts in {sum(each.seconds for each in attempts):.0f} s: {outcome}"]


def contact_lines(plan: Plan) -> list[str]:
    """Return what each contact did, one line each; of many contacts only the first ones."""
    lines = []
    for name, contact in list(plan.contacts.items())[:SHOWN_CONTACTS]:
        heights = flight_heights(contact)
        impacts = sum(impulse.contact == name for impulse in plan.impulses)
        height = f" up to {max(heights):.3g} m high" if heights else ""
        lines.append(f"{name}: {_count(len(heights), 'flight')}{height}, {_count(impacts, 'impact')}")
    more = len(plan.contacts) - len(lines)
    return [*lines, f"and {_count(more, 'more contact')}, see report.md"] if more else lines


def flight_heights(contact: ContactHistory) -> list[float]:
    """Return the largest gap, m, of every stretch of samples in which a contact is in flight."""
    return [float(np.max(contact.gap[first:end])) for first, end in _stretches([m == "flight" for m in contact.mode])]


def _stretches(flags: Sequence[bool]) -> list[tuple[int, int]]:
    """Return (first, end) of every unbroken row of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], np.asarray(flags, dtype=bool), [False]]).astype(int)))
    return [(int(first), int(end)) for first, end in zip(edges[::2], edges[1::2], strict=True)]


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" + ("" if number == 1 else "s")
