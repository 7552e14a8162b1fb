"""The four answers of a plan's status, and the sentence that sums them up."""

from __future__ import annotations

from collections.abc import Sequence

from fesd_robot.exactness import FEASIBLE, ROUNDED
from fesd_robot.mpcc import Certificate, MpccSolution, Residuals
from fesd_robot.plans.audit_record import ENTRIES, Audit, Finding
from fesd_robot.plans.descent_words import descent_words
from fesd_robot.plans.outcome import Outcome
from fesd_robot.plans.plan import Status
from fesd_robot.plans.sentences import NAMED_MISSES


def status_of(
    solution: MpccSolution,
    audit: Audit,
    outcome: Outcome,
    tolerance: float,
    certificate: Certificate | None = None,
    out_of_elements: Sequence[int] = (),
    jumps: bool = False,
    in_the_way: str = "",
) -> Status:
    """Return the status of a solved MPCC and its audit; solved only if every answer is good.

    The kind of stationary point stands beside them: whether another motion nearby is cheaper does not make this one
    wrong.

    Args:
        solution: of the solver.
        audit: of the returned trajectory.
        outcome: of the returned trajectory, for the message.
        tolerance: complementarity asked for.
        certificate: what kind of point it is, if that was computed.
        out_of_elements: intervals without an element to spare, for the message.
        jumps: whether the task asks for jumps, so that a motion that never leaves the ground does not solve it.
        in_the_way: the conflicting demands, for the message.
    """
    residuals = solution.residuals
    audit_passed = not audit.violations
    grounded = jumps and not outcome.leaves_the_ground
    if solution.solved and audit_passed and grounded:
        message = (
            "Not solved: the reference asks for jumps, but no contact leaves the ground; try larger weights in "
            "costs.configuration, or larger limits of the controls."
        )
    elif solution.solved and audit_passed:
        limits = f" with limits of the task ({given})" if (given := given_limits(audit)) else ""
        message = f"Solved to complementarity {residuals.complementarity:.1e}; the physics audit passed{limits}."
    elif solution.solved and audit.near_misses:
        finding = _worst_finding(audit)
        message = (
            f"Not solved, but nearly: of the physics audit all but {near_miss_words(audit)} passed."
            f"{f' {finding.sentence}' if finding else ''}"
        )
    elif solution.solved and audit.violations == ["max_goal_violation"] and (missed := _missed(outcome)):
        message = (
            f"Not solved: the goal is missed, {missed}; try more time or higher limits, a larger goal.tolerance, or "
            "goal.soft: true if it need not be reached."
        )
    elif solution.solved and (finding := _worst_finding(audit)):
        several = f" in {len(audit.violations)} entries" if len(audit.violations) > 1 else ""
        message = f"Not solved: the numbers converged but the physics audit failed{several}. {finding.sentence}"
    elif solution.solved:
        worst = ", ".join(_measured(audit, name) for name in audit.violations)
        message = (
            f"Not solved: the numbers converged but the physics audit failed ({worst}); "
            "try more method.stages, horizon.intervals or method.elements."
        )
    else:
        sigma = solution.reports[-1].sigma if solution.reports else float("nan")
        where = (
            f"largest constraint violation {residuals.constraint_violation:.1e} at {residuals.worst_constraint}"
            if residuals.constraint_violation > FEASIBLE
            else f"complementarity is {residuals.complementarity:.1e} (asked for {tolerance:.0e}), "
            f"worst at {residuals.worst_pair}"
        )
        at = f"sigma = {sigma:.0e}" if sigma else "the exact problem"
        hint = _elements(residuals, out_of_elements)
        against = f"conflicting constraints: {in_the_way}; " if in_the_way else ""
        message = f"Not solved: {solution.status} at {at}; {where}; {against}{hint}{solution.status.advice}."
    return Status(
        solved=solution.solved and audit_passed and not grounded,
        nlp=solution.status.value,
        complementarity=residuals.complementarity,
        exact=solution.exact,
        natural_residual=residuals.natural_residual,
        constraint_violation=residuals.constraint_violation,
        stationarity=certificate.kind if certificate else "unknown",
        b_stationary=certificate.b_stationary if certificate else "unknown",
        b_stationary_reason=descent_words(certificate),
        biactive=certificate.biactive if certificate else 0,
        unresolved=certificate.unresolved if certificate else 0,
        audit_passed=audit_passed,
        near_miss=solution.solved and bool(audit.near_misses),
        message=message,
    )


def _worst_finding(audit: Audit) -> Finding | None:
    """Return the first finding about a violated entry, None if there is none."""
    return next((finding for finding in audit.findings if finding.entry in audit.violations), None)


def near_miss_words(audit: Audit) -> str:
    """Return by how much entries miss their limits, e.g. ``max_energy_error (1.03e-03 of 1.00e-03 J, 3 % more)``."""
    return ", ".join(
        f"{name} ({getattr(audit, name):.3g} of {_bound(audit, name)}, {100 * (audit.ratio(name) - 1):.2g} % more)"
        for name in audit.near_misses
    )


def given_limits(audit: Audit) -> str:
    """Return the limits that the task gives with their defaults, e.g. ``max_energy_error 0.01 J, default 0.002 J``."""
    return ", ".join(
        f"{name} {_bound(audit, name)}, default {default:.3g} {ENTRIES[name].unit}".rstrip()
        for name, default in audit.defaults.items()
    )


def _bound(audit: Audit, name: str) -> str:
    """Return the limit of an entry with its sign and unit."""
    sign = "-" if ENTRIES[name].smallest else ""
    return f"{sign}{audit.tolerances[name]:.3g} {ENTRIES[name].unit}".rstrip()


def _measured(audit: Audit, name: str) -> str:
    """Return an entry of the audit with its value and unit."""
    return f"{name} = {getattr(audit, name):.2e} {ENTRIES[name].unit}".rstrip()


def _missed(outcome: Outcome) -> str:
    """Return the misses of the goal, largest in units of the tolerance first, three at most."""
    missed = [entry for entry in outcome.goal if entry.met is False]
    missed.sort(key=lambda entry: -entry.missed_by / max(entry.tolerance or 0.0, ROUNDED))
    parts = [
        f"{one.name} ends at {one.end:.4g} {one.unit}, {one.missed_by:.3g} from {one.goal:.4g} "
        f"({one.tolerance:g} allowed)"
        for one in missed[:NAMED_MISSES]
    ]
    return ", ".join([*parts, *([f"and {len(missed) - NAMED_MISSES} more"] if len(missed) > NAMED_MISSES else [])])


def _elements(residuals: Residuals, out_of_elements: Sequence[int]) -> str:
    """Say that an interval ran out of elements, if the worst place is in one of them."""
    worst = residuals.worst_constraint if residuals.constraint_violation > FEASIBLE else residuals.worst_pair
    interval = worst.place.interval if worst else None
    if interval is None or interval not in out_of_elements:
        return ""
    return f"interval {interval} ran out of finite elements, all lie between two switches: more method.elements; "
