"""A plan in a few lines, for the end of a run."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fesd_robot.plans import Outcome, Plan

SHOWN_CONTACTS, SHOWN_WARNINGS = 3, 3


def summary(plan: Plan, folder: Path, shown: Path) -> list[str]:
    """Return verdict, warnings, notes of the audit, misses of the goal, contact events, the effort, and the files.

    Args:
        folder: where the files are.
        shown: the folder as the user wrote it.
    """
    from fesd_robot.plans import FILES

    names = [name + ("/" if (folder / name).is_dir() else "") for name in FILES if (folder / name).exists()]
    return [
        f"{plan.name}: {plan.status.message}",
        *warning_lines(plan.warnings),
        *_notes(plan),
        *(outcome_lines(plan.outcome) if plan.outcome else []),
        f"{plan.trajectory.time[-1]:.6g} s of motion, {_effort(plan)} in {plan.statistics.solve_seconds:.1f} s",
        *_attempts(plan),
        f"written to {shown}: {', '.join(names)}",
    ]


def _effort(plan: Plan) -> str:
    effort, simulated = plan.statistics, plan.simulation
    if simulated:
        from fesd_robot.plans import count

        events = f"{count(simulated.events, 'contact event')}, {count(simulated.impacts, 'impact')}"
        return f"{events}; {count(simulated.steps, 'step')}"
    sizes = f"{effort.variables} variables, {effort.pairs} pairs"
    return f"cost {effort.objective:.6g}; {sizes}, {effort.iterations} iterations"


def _notes(plan: Plan) -> list[str]:
    """Return the notes of a solved plan's replay, such as contacts that hit at once and do so in turn."""
    from fesd_robot.plans import REPLAY

    findings = plan.audit.findings if plan.status.solved and plan.audit else []
    return [f"note: {finding.sentence}" for finding in findings if finding.entry == REPLAY]


def warning_lines(warnings: Sequence[str]) -> list[str]:
    """Return the first warnings, and how many more there are."""
    from fesd_robot.plans import count

    more = len(warnings) - SHOWN_WARNINGS
    lines = [f"warning: {warning}" for warning in warnings[:SHOWN_WARNINGS]]
    return [*lines, f"and {count(more, 'more warning')}, see report.md"] if more > 0 else lines


def _attempts(plan: Plan) -> list[str]:
    """Return which attempt the plan is of, if there were several."""
    from fesd_robot.plans import settings_line

    attempts, kept = plan.statistics.attempts, plan.statistics.kept_attempt
    if len(attempts) < 2 or kept is None:
        return []
    settings = settings_line(kept.changes) or "the task as written"
    seconds = sum(each.seconds for each in attempts)
    outcome = f"solved with {settings}" if kept.solved else f"none solved, kept is that with {settings}"
    return [f"{len(attempts)} attempts in {seconds:.0f} s: {outcome}"]


def outcome_lines(outcome: Outcome) -> list[str]:
    """Return the misses of the goal, and the events of each contact; of many contacts only the first ones."""
    from fesd_robot.plans import contact_words, count, goal_words

    shown = list(outcome.contacts.items())[:SHOWN_CONTACTS]
    lines = [f"goal: {goal_words(outcome)}", *(f"{name}: {contact_words(contact)}" for name, contact in shown)]
    more = len(outcome.contacts) - len(shown)
    return [*lines, f"and {count(more, 'more contact')}, see report.md"] if more else lines
