"""The page docs/results/compare_realtime.md."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from scripts.benchmarks.bench_step_nosnoc import markdown
from scripts.benchmarks.compare.cart_transport.answers import WARM, Answer
from scripts.benchmarks.compare.cart_transport.law import ARRIVED
from scripts.benchmarks.compare.cart_transport.loop import EVERY, LARGEST, PERIOD, PUSHES

TABLE = "2605.09127, table I, as a reader's notes give it"
PUBLISHED = [
    ["IMPACT", "cart transport, 300 steps, 3 pairs a step", "0.08 ± 0.01 s", "mean over starts, anew, to 1e-5", TABLE],
    ["IMPACT", "push box, 50 steps, 10 pairs a step", "0.15 ± 0.03 s", "the same, quasi-static", TABLE],
    ["IMPACT", "push T, 50 steps, 43 pairs a step", "1.03 ± 0.44 s", "the same, quasi-static", TABLE],
    ["IDTO", "two arms and a box, 20 degrees of freedom", "over 100 Hz", "compliant contact", "2309.01813, abstract"],
    ["nosnoc (MATLAB)", "manipulation", "no table found", "a sample is a QP with complementarity", "2604.18432"],
]


def _times(seconds: Sequence[float]) -> list[str]:
    return [f"{1e3 * np.median(seconds):.2f}", f"{1e3 * np.percentile(seconds, 99):.2f}"]


def start_table(found: dict[str, Any]) -> str:
    """Return the table of disturbed starts."""
    header = ["tool", "solved", "before: median [ms]", "99 % [ms]", "answer: median [ms]", "99 % [ms]"]
    header += ["goal missed by [m]", "[m/s]", "cost"]
    rows = []
    for one in found["starts"]:
        answers = [Answer(**answer) for answer in one["answers"]]
        before = [answer.before for answer in answers]
        rows.append(
            [
                one["tool"],
                f"{sum(answer.solved for answer in answers)} of {len(answers)}",
                *(_times(before) if any(before) else ["", ""]),
                *_times([answer.seconds for answer in answers]),
                f"{np.median([answer.position for answer in answers]):.1e}",
                f"{np.median([answer.velocity for answer in answers]):.1e}",
                f"{np.median([answer.cost for answer in answers]):.3f}",
            ]
        )
    return markdown(header, rows)


def loop_table(found: dict[str, Any]) -> str:
    """Return the table of rides in closed loop."""
    header = ["tool", "arrived", "prepare: median [ms]", "99 % [ms]", "feedback: median [ms]", "99 % [ms]"]
    header += ["both: longest [ms]", "updates kept", "goal missed by [m]", "[m/s]", "cargo off the middle [m]"]
    rows = []
    for one in found["loops"]:
        errors, both = np.array(one["errors"]), np.add(one["prepare"], one["feedback"])
        rows.append(
            [
                one["tool"] + ("" if one["repeatable"] else ", not repeatable"),
                f"{one['arrived']} of {len(errors)}",
                *_times(one["prepare"]),
                *_times(one["feedback"]),
                f"{1e3 * both.max():.1f}",
                f"{one['kept']} of {len(both)}",
                *(f"{error:.1e}" for error in errors.max(axis=0)),
                f"{max(one['farthest']):.4f}",
            ]
        )
    return markdown(header, rows)


def way_text(found: dict[str, Any]) -> str:
    """Return what IMPACT took from states of the closed loop."""
    answers = [Answer(**answer) for one in found["loops"] for answer in one["impact"]]
    if not answers:
        return ""
    median, late = _times([answer.seconds for answer in answers])
    return (
        f"Given {len(answers)} of the states of the first row's rides, one of every {EVERY}, IMPACT converged from "
        f"{sum(answer.solved for answer in answers)},\nin {median} ms (median) and {late} ms (99th percentile), "
        "always for the next 6 s: its program has no other horizon.\nStates in which one step of Euler leads over the "
        "edge were left out.\n\n"
    )


def page(record: dict[str, Any], command: str) -> str:
    """Return the page docs/results/compare_realtime.md."""
    found, packages = record["found"], ", ".join(f"{name} {number}" for name, number in record["versions"].items())
    first = "\n".join(
        f"- {intervals} intervals, {one['variables']} variables: planned in {one['seconds']:.0f} s, replanner made in "
        f"{one['replanner']:.1f} s"
        for intervals, one in found["plans"].items()
    )
    return f"""# Replanning compared with IMPACT and nosnoc

Made by `{command}` on {record["machine"]},
one process with one thread on one core, {packages}.
{_busy(record)} All numbers are in [compare_realtime.json](compare_realtime.json).

**Not the same service.** fesd-robot replans: it has a plan and keeps its contact sequence, with free times. IMPACT and
nosnoc find the sequence anew. For a first plan fesd-robot is the slowest by far, and IMPACT, which needs none, the
fastest. fesd-robot's:

{first}

nosnoc's real-time algorithms, nearest to what is measured here, are not in the version that can be installed, so nosnoc
solves its whole problem here.

The task is cart transport of IMPACT's benchmark ([2605.09127](https://arxiv.org/abs/2605.09127)): a driven cart of
0.2 kg, on it a cargo of 0.1 kg that slides with friction 0.2 and stays within 1 m of the cart's middle. In 6 s the
cargo moves by 1 m and the cart comes back. fesd-robot has it as a robot with a contact
(`scripts/benchmarks/compare/cart_transport/cart_transport.yaml`), nosnoc as two vector fields in Stewart's form,
IMPACT as its authors wrote it.

## Disturbed starts

{start_table(found)}

Both bodies begin up to 5 cm away and with up to 0.1 m/s; every tool has the whole 6 s. *Before* is what fesd-robot does
before the start is known, *answer* is the time from the start to the controls. *Goal missed* and *cost*,
∫ u² + (v_cargo − v_cart)² dt, are medians, of the controls under Coulomb's law, integrated in closed form whatever the
tool itself integrates; *solved* is the tool's own word.

- **fesd-robot** has Radau IIA with two stages and one element an interval, whose intervals move with the contacts. It
  makes at most four Newton steps an answer. With 300 intervals it has as many as IMPACT has steps.
- **IMPACT** (f56f1403, its authors' settings and release flags, OpenBLAS) has 300 steps of explicit Euler and begins
  from a constant guess, as its program does; the time is the one that it prints, without building the problem. By its
  own integration it ends at most {_own(found)} from the goal, so the distance above comes from that integration; in a
  loop feedback would correct much of it. Its cost has the square of the friction, too, all with 1e-6 against 5000 for
  the goal, and its tolerance is 1e-5.
- **nosnoc** has 30 intervals with two elements, Radau IIA with two stages, complementarity 1e-6 and MUMPS; it is built
  once, which is not counted. *From its solution*: from its undisturbed solution, first relaxed by {WARM:g}, the fastest
  of four that were tried on six of these starts. Its guess leads to another local optimum than fesd-robot's search.

## Closed loop

{loop_table(found)}

Every {1e3 * PERIOD:g} ms an update from the measured state, for which the world waits; what is left of the 6 s is
replanned. {PUSHES} pushes a ride make the cart alone faster or slower by up to {LARGEST} m/s at once, at random times.
Arrived: within {ARRIVED:g} m and m/s of the goal after 6 s, IMPACT's own test. *Goal missed* and *cargo off the middle*
are the largest of all rides; 1 m is the limit. *Kept* are updates whose result was taken; after others the earlier
policy goes on. Where prepare and feedback together take longer than {1e3 * PERIOD:g} ms, there would be no such loop in
real time. *Not repeatable*: rides differ from their repeats by more than 1e-9 or in their steps, for a reason that was
not looked into; there all repeats count with their own times, and other processes are in them.

{way_text(found)}## Published times

Of other machines, for other problems: they show magnitudes, no ranking.

{markdown(["code", "task", "published", "what it is", "source"], PUBLISHED)}

The processors of these times were not in what could be read. Push box and push T cannot be stated as tasks: there a
quasi-static object is pushed at any point of its edge, without a pusher.
"""


def _own(found: dict[str, Any]) -> str:
    """Return how far from the goal IMPACT ends by its own integration."""
    own = [answer["own"] for one in found["starts"] for answer in one["answers"] if answer["own"] is not None]
    return f"{max(own):.1e} m" if own else "not measured here"


def _busy(record: dict[str, Any]) -> str:
    """Return what else the machine did, and what became of it."""
    before, after = record["load"]
    share = min(one["core_share"] for one in record["found"]["loops"])
    return (
        f"The machine had other work (load {before:.1f} before and {after:.1f} after; in the rides this process had "
        f"{100 * share:.0f} % of its core).\nSo everything was timed {record['repeats']} times, and the shortest time "
        "of every answer and update counts, for all tools alike;\n99th percentiles are over answers and updates."
    )
