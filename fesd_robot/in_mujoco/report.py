"""The report of a replay, in Markdown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from fesd_robot.in_mujoco.controllers import RUNS
from fesd_robot.in_mujoco.driving import Push
from fesd_robot.in_mujoco.measures import APART, TURNED, TouchdownError
from fesd_robot.in_mujoco.perturbed import Perturbation
from fesd_robot.in_mujoco.replanned import Replanned
from fesd_robot.in_mujoco.replays import Replay, ReplayRun


def report(replay: Replay, picture: str | None = None) -> str:
    """Return the report of a replay.

    Args:
        replay: of a plan.
        picture: file of the figure, relative to that of the report.
    """
    scene, plan = replay.scene, replay.plan
    step = scene.model.opt.timestep
    lines = [
        f"# {plan.name} in MuJoCo",
        "",
        f"{plan.trajectory.time[-1]:.4g} s of motion in steps of {1e3 * step:g} ms; controls hold for 1 ms.",
        "",
        *table(replay.runs),
        "",
        *_different(replay.runs),
        *([f"![Distance from the plan over time]({picture})", ""] if picture else []),
        *_touchdowns(replay.runs),
        *_perturbed(replay.runs),
        *_replanning(replay.runs),
        *_notes([*replay.left_out, *scene.notes]),
        f"A run has finished if it ends with every body within {100 * APART:g} cm and {TURNED:g} rad of its place in "
        "the plan; of a robot that cannot travel, every joint. Errors of joints are of those behind the bodies' own.",
        "",
        *(f"- {each.controller}: {RUNS[each.controller]}" for each in replay.runs),
    ]
    return "\n".join(lines) + "\n"


def table(runs: Sequence[ReplayRun]) -> list[str]:
    """Return a table with a row for every run."""
    rows = [
        "| controller | finished | bodies RMS / end, mm | turned RMS / end, mrad | hinges, mrad | slides, mm "
        "| touchdowns, ms | slip, mm | effort | saturated |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for each in runs:
        entry = each.entry()
        slip = max(entry["slip"].values(), default=None)
        rows.append(
            f"| {each.controller} | {'yes' if entry['finished'] else '**no**'} "
            f"| {_pair(entry['base_rms'], entry['base_end'])} "
            f"| {_pair(entry['base_angle_rms'], entry['base_angle_end'])} "
            f"| {_thousandths(entry['joint_rms'])} | {_thousandths(entry['slide_rms'])} "
            f"| {landings_in_words(each.deviation.touchdowns)} | {_thousandths(slip)} "
            f"| {100 * entry['effort']:.0f} % | {100 * entry['saturated']:.1f} % |"
        )
    return rows


def landings_in_words(touchdowns: Sequence[TouchdownError]) -> str:
    """Return the range of the errors of touchdowns in ms, and how many did not come."""
    came = [1e3 * each.error for each in touchdowns if each.error is not None]
    missing = len(touchdowns) - len(came)
    words = [f"{min(came):+.1f} … {max(came):+.1f}"] if came else []
    words += [f"{missing} missing"] if missing else []
    return ", ".join(words) or "–"


def pushes_in_words(pushes: Sequence[Push]) -> list[str]:
    """Return every push in words, in the order of time."""
    return [
        f"pushed by {np.linalg.norm(each.velocity):.3g} m/s at {each.time:.4g} s"
        for each in sorted(pushes, key=lambda each: each.time)
    ]


def replanning_in_words(replanned: Replanned) -> str:
    """Return how long updates of a run took, and how many of them became the policy."""
    entry = replanned.entry()
    (feedback, most), (prepare, longest) = (
        [1e3 * entry[key][part] for part in ("median", "percentile_99")]
        for key in ("feedback_seconds", "prepare_seconds")
    )
    return (
        f"{100 * entry['status'].get('kept', 0.0):.3g} % of {entry['updates']} updates kept the sequence, feedback "
        f"{feedback:.2g} ms (99 %: {most:.2g} ms), prepared in {prepare:.2g} ms (99 %: {longest:.2g} ms)"
    )


def _different(runs: Sequence[ReplayRun]) -> list[str]:
    """Return what was different from the plan, as one sentence."""
    given = runs[0].different if runs else Perturbation()
    factors = {"masses": given.mass, "friction": given.friction}
    words = [f"{name} {100 * (factor - 1):+.3g} %" for name, factor in factors.items() if factor != 1.0]
    words += pushes_in_words(given.disturbance.pushes)
    return [f"Different from the plan: {'; '.join(words)}.", ""] if words else []


def _replanning(runs: Sequence[ReplayRun]) -> list[str]:
    lines = []
    for told in (each.replanned for each in runs if each.replanned):
        clock = "a policy counted once the time had passed that it took" if told.real_time else "the simulator waited"
        goals = [f" From {one.time:.4g} s on the goal of {one.name} was {one.value:.4g}." for one in told.goals]
        lines += [
            "## Replanning",
            "",
            f"Every {1e3 * told.period:.3g} ms, {clock}: {replanning_in_words(told)}.{''.join(goals)}",
            "",
        ]
    return lines


def _thousandths(value: float | None) -> str:
    return "–" if value is None else f"{1e3 * value:.3g}" if 1e3 * value < 1e3 else f"{1e3 * value:.0f}"


def _pair(first: float | None, second: float | None) -> str:
    return "–" if first is None else f"{_thousandths(first)} / {_thousandths(second)}"


def _touchdowns(runs: Sequence[ReplayRun]) -> list[str]:
    if not runs or not runs[0].deviation.touchdowns:
        return []
    names = [each.controller for each in runs]
    lines = ["## Touchdowns", "", f"| contact | planned, s | {' | '.join(f'{name}, ms' for name in names)} |"]
    lines.append("|---" * (2 + len(names)) + "|")
    for row in zip(*(each.deviation.touchdowns for each in runs), strict=True):
        errors = ["missing" if each.error is None else f"{1e3 * each.error:+.2f}" for each in row]
        lines.append(f"| {row[0].contact} | {row[0].planned:.4f} | {' | '.join(errors)} |")
    return [*lines, ""]


def _perturbed(runs: Sequence[ReplayRun]) -> list[str]:
    told = [each for each in runs if each.perturbed]
    if not told:
        return []
    kinds = list(Counter(each.what for each in told[0].perturbed))
    lines = ["## Perturbed", "", f"| runs that finished | {' | '.join(each.controller for each in told)} |"]
    lines.append("|---" * (1 + len(told)) + "|")
    for kind in kinds:
        cells = []
        for each in told:
            own = [one.finished for one in each.perturbed if one.what == kind]
            cells.append(f"{sum(own)} of {len(own)}")
        lines.append(f"| {kind} | {' | '.join(cells)} |")
    totals = [f"**{sum(one.finished for one in each.perturbed)} of {len(each.perturbed)}**" for each in told]
    return [*lines, f"| all | {' | '.join(totals)} |", ""]


def _notes(notes: Sequence[str]) -> list[str]:
    return [*(f"- {each}." for each in notes), ""] if notes else []
