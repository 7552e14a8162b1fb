"""A plan in words and tables, as Markdown."""

from __future__ import annotations

import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.plans.audit_record import ENTRIES
from fesd_robot.plans.glossary import glossary
from fesd_robot.plans.outcome_report import outcome_section
from fesd_robot.plans.plan import Impulse, LocalSearch, Plan, Statistics, Status
from fesd_robot.plans.sentences import sentences
from fesd_robot.plans.stationarity_words import stationarity_sentence
from fesd_robot.plans.tables import markdown_table, settings_line
from fesd_robot.plans.use_words import use_section
from fesd_robot.plans.verdict import given_limits, near_miss_words
from fesd_robot.plans.weights import weights_of

OF_THE_METHOD = ("regularisation of", "step equilibration")
"""How cost terms begin that no task asks for."""


@checked
def report(plan: Plan, picture: str | None = None) -> str:
    """Return the report: verdict, five sentences, warnings, outcome, contacts, cost, numbers with their words.

    Args:
        plan: what to report.
        picture: the file with the robot at a few moments, from where the report lies; none without it.
    """
    parts = [f"# {plan.name}\n", f"**{plan.status.message}**\n"]
    parts += ["".join(f"- {sentence}\n" for sentence in sentences(plan))]
    parts += [f"![The robot at a few moments]({picture})\n"] if picture else []
    parts += ["## Warnings\n\n" + "".join(f"- {warning}\n" for warning in plan.warnings)] if plan.warnings else []
    parts += [outcome_section(plan.outcome)] if plan.outcome else []
    parts += [section] if (section := use_section(plan)) else []
    parts += [
        _contacts(plan),
        *([_joint_friction(plan)] if plan.joint_friction else []),
        _cost(plan),
        "## Numbers\n\nFor readers who want to judge the method; its words are explained [below](#words).\n",
        _answers(plan),
        _audit(plan),
        _effort(plan),
        f"### Words\n\n{glossary()}",
        _provenance(plan),
    ]
    return "\n".join(parts)


def _answers(plan: Plan) -> str:
    status = plan.status
    asked = plan.task["solver"]["tolerance"]
    rows = [
        ["last NLP", status.nlp],
        ["complementarity, largest G H", f"{status.complementarity:.2e} (asked for {asked:.0e})"],
        ["exact contact sequence", "yes" if status.exact else "no, relaxed to the tolerance"],
        ["natural residual, largest min(G, H)", f"{status.natural_residual:.2e}"],
        ["constraint violation", f"{status.constraint_violation:.2e}"],
        ["kind of stationary point", _stationarity(status)],
        ["physics audit", _passed(plan)],
    ]
    return "### Status\n\n" + markdown_table(["question", "answer"], rows)


def _passed(plan: Plan) -> str:
    if plan.status.audit_passed:
        words = "passed"
    elif plan.audit.near_misses:
        words = f"nearly passed, but for {near_miss_words(plan.audit)}"
    else:
        words = "failed: " + ", ".join(plan.audit.violations)
    given = given_limits(plan.audit)
    return f"{words}; limits of the task: {given}" if given else words


def _stationarity(status: Status) -> str:
    if status.stationarity == "unknown":
        return "unknown"
    pairs = f"{status.biactive} biactive pairs, {status.unresolved} undetermined"
    reason = f"; {status.b_stationary_reason}" if status.b_stationary_reason else ""
    return f"{status.stationarity}; B-stationarity {status.b_stationary} ({pairs}){reason}"


def _contacts(plan: Plan) -> str:
    if not plan.contacts:
        return ""
    text = "## Contact\n\n"
    text += markdown_table(
        ["time [s]", "contact", "event"], [[f"{s.time:.6f}", s.contact, s.kind] for s in plan.switches]
    )
    if plan.impulses:
        rows = [[f"{i.time:.6f}", i.contact, f"{i.normal:.4f}", _tangential(i)] for i in plan.impulses]
        text += "\n" + markdown_table(["time [s]", "contact", "normal impulse [N s]", "tangential impulse [N s]"], rows)
    text += "".join(f"\n{one.sentence}\n" for one in plan.landing_orders)
    highest = [
        [name, f"{float(np.max(contact.gap)):.4f}", f"{float(np.max(contact.normal_force)):.2f}"]
        for name, contact in plan.contacts.items()
    ]
    text += "\n" + markdown_table(["contact", "highest clearance [m]", "largest normal force [N]"], highest)
    laws = ["the integrated one (friction acts along the impact)", "Newton's with an impulse cone"]
    if plan.task["method"].get("contact") == "impulses":
        laws.reverse()
    return text + (
        "\nImpacts are inelastic, or bounce with the coefficient of restitution that the task gives. Where normal and "
        f"tangential directions couple through the mass matrix, the impact law is {laws[0]}, not {laws[1]}.\n"
    )


def _joint_friction(plan: Plan) -> str:
    rows = [
        [
            name,
            f"{joint.limit:g} {joint.unit}",
            f"{float(np.max(np.abs(joint.force))):.4g} {joint.unit}",
            f"{joint.work:.4g}",
        ]
        for name, joint in plan.joint_friction.items()
    ]
    text = "## Dry friction of joints\n\n"
    text += markdown_table(["joint", "limit", "largest friction", "its work [J]"], rows)
    events = [[f"{s.time:.6f}", s.joint, s.in_words] for s in plan.joint_switches]
    return text + ("\n" + markdown_table(["time [s]", "joint", "event"], events) if events else "")


def _audit(plan: Plan) -> str:
    rows = []
    for name, entry in ENTRIES.items():
        value, limit = getattr(plan.audit, name), plan.audit.tolerances.get(name, np.nan)
        if value is None:
            rows.append([name, "not checked", "", entry.unit, "", ""])
            continue
        passed = "yes"
        if name in plan.audit.violations:
            passed = "nearly" if plan.audit.nearly(name) else "no"
        own = f" (the task's; default {plan.audit.defaults[name]:g})" if name in plan.audit.defaults else ""
        part = f"{max(plan.audit.ratio(name), 0.0):.2g}"
        rows.append([name, f"{value:.3e}", entry.bound(limit) + own, entry.unit, part, passed])
    text = "### Audit\n\nRecomputed from the trajectory with Pinocchio's numeric algorithms.\n\n"
    text += markdown_table(["entry", "value", "limit", "unit", "part of it", "passed"], rows)
    failed = [f"- `{name}` is {ENTRIES[name].meaning}.\n" for name in plan.audit.violations]
    text += "".join(["\n", *failed] if failed else [])
    found = [f"- {finding.sentence}\n" for finding in plan.audit.findings]
    return text + "".join(["\n#### Findings\n\n", *found] if found else [])


def _cost(plan: Plan) -> str:
    terms = plan.statistics.cost_terms
    total = sum(terms.values()) or 1.0
    weights = weights_of(plan)
    rows = [
        [name, f"{value:.6g}", f"{100 * value / total:.1f} %", weights.get(name, "")] for name, value in terms.items()
    ]
    text = "## Cost\n\n" + markdown_table(
        ["term", "value", "share", "weights"], [*rows, ["total", f"{plan.statistics.objective:.6g}", "", ""]]
    )
    text += f"\n{stationarity_sentence(plan.status)}\n"
    own = [name for name in terms if name.startswith(OF_THE_METHOD)]
    return text + (f"\nOf the method, not of the task: {', '.join(own)}.\n" if own else "")


def _effort(plan: Plan) -> str:
    s = plan.statistics
    rows = [
        [
            f"{step.sigma:.0e}" if step.sigma else "exact",
            f"{step.velocity_level_sigma:.0e}" if step.velocity_level_sigma else "exact",
            step.status,
            str(step.iterations),
            f"{step.objective:.6g}",
            f"{step.complementarity:.1e}",
            f"{step.constraint_violation:.1e}",
            f"{step.seconds:.1f}",
        ]
        for step in s.homotopy
    ]
    header = ["sigma", "velocity level", "status", "iterations", "cost", "complementarity", "violation", "seconds"]
    return (
        f"### Effort\n\n{s.variables} variables, {s.constraints} constraints, {s.pairs} complementarity pairs"
        f"{_stages(s)}; built in {s.build_seconds:.2f} s, solved in {s.solve_seconds:.1f} s, {s.iterations} "
        f"iterations.{_search(s)}\n\n" + markdown_table(header, rows) + _attempts(plan)
    )


def _search(statistics: Statistics) -> str:
    search = statistics.search
    if search is None:
        return ""
    if search.sequences is not None:
        return _sequences(search)
    text = (
        f" The search tried {search.trials} neighbours in {search.seconds:.1f} s and {search.iterations} "
        f"iterations; the cost before it was {search.cost_before:.6g}."
    )
    moves = "".join(f"\n- {move}" for move in search.moves)
    return f"{text} What it changed, and the cost before refinement:\n{moves}" if moves else text


BEST_SEQUENCES = 3
"""Of the sequences of phases that were tried, named with their costs."""


def _sequences(search: LocalSearch) -> str:
    """Return which sequences of phases were solved, and the cheapest of them."""
    tried = search.sequences or []
    costs = {
        one.sequence: one.cost for one in sorted(tried, key=lambda one: -(one.cost or 0.0)) if one.cost is not None
    }
    best = sorted(costs.items(), key=lambda one: one[1])[:BEST_SEQUENCES]
    listed = ", ".join(f"`{sequence}` at {cost:.6g}" for sequence, cost in best)
    kept = "".join(
        f"\n- after {one.seconds:.1f} s, {one.what}: `{one.sequence}`, {one.cost:.6g}" for one in tried if one.kept
    )
    return (
        f" {len(tried)} sequences of phases were tried in {search.seconds:.1f} s, of which {search.iterations} "
        f"iterations with neighbours of the cheapest; the best were {listed}. A letter a contact, a word a phase: F "
        "flies, S sticks, + and - slip along and against the tangent, L slips; with ! an impact comes first. What was "
        f"kept, one after the other, and the cost before refinement:\n{kept}"
    )


def _stages(statistics: Statistics) -> str:
    if statistics.stages is None:
        return ""
    words = f", {statistics.stages} stages an element"
    if statistics.refinement is None:
        return words
    refinement = statistics.refinement
    return (
        f"{words}, {refinement.elements} elements of which none makes an error above "
        f"{refinement.largest_local_error:.1e} after {refinement.rounds} rounds of refinement in "
        f"{refinement.seconds:.1f} s"
    )


def _attempts(plan: Plan) -> str:
    if len(plan.statistics.attempts) < 2:
        return ""
    attempts, kept = plan.statistics.attempts, plan.statistics.kept_attempt
    rows = [
        [
            settings_line(each.changes) or "as written",
            "yes" if each.solved else "no",
            "yes" if each is kept else "no",
            f"{each.objective:.6g}",
            str(each.iterations),
            f"{each.seconds:.1f}",
            each.message,
        ]
        for each in attempts
    ]
    header = ["settings", "solved", "kept", "cost", "iterations", "seconds", "outcome"]
    costs = [each.objective for each in attempts if each.solved]
    spread = (
        f" Costs of the {len(costs)} solved: {min(costs):.6g} to {max(costs):.6g}, median {np.median(costs):.6g}."
        if len(costs) > 1
        else ""
    )
    return (
        "\n#### Attempts\n\nThe cheapest that was solved is kept, else one that only misses the goal, else the first."
        f"{spread}\n\n" + markdown_table(header, rows)
    )


def _provenance(plan: Plan) -> str:
    versions = ", ".join(f"{name} {version}" for name, version in plan.provenance.versions.items())
    return f"## Provenance\n\n{versions}; git {plan.provenance.git}; {plan.provenance.created}\n"


def _tangential(impulse: Impulse) -> str:
    """Return both tangential parts of an impulse in space, else the only one."""
    return ", ".join(f"{part:.4f}" for part in (impulse.tangential, impulse.lateral) if part is not None)
