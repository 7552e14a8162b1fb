"""What a reserve costs: the same tasks planned without one and with one.

    python scripts/results/reserve_costs.py WITHOUT WITH   # folders of plans; docs/results/reserve.md

Shares of cones are those of the plans' own outcomes, of efforts those of their controls.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fesd_robot import Plan, read_plan
from fesd_robot.plans.tables import markdown_table
from scripts.tools.arguments import ROOT, Rows

PAGE = ROOT / "docs" / "results" / "reserve.md"
HEADER = (
    "task", "cost without", "cost with", "change", "cone without", "cone with", "effort without", "effort with"
)  # fmt: skip


def friction_of(plan: Plan) -> float | None:
    """Return the largest share of a cone of friction that a contact uses where it sticks or lands."""
    contacts = plan.outcome.contacts.values() if plan.outcome else ()
    shares = [use.share for each in contacts for use in (each.sticking, each.landing) if use is not None]
    return max(shares, default=None)


def effort_of(plan: Plan) -> float | None:
    """Return the largest share of a limit that a control uses."""
    shares = []
    for name, (low, high) in (plan.control_limits or {}).items():
        values = plan.controls[name]
        for side, limit in ((values.max(), high), (-values.min(), -low)):
            if np.isfinite(limit) and limit > 0:
                shares.append(float(side / limit))
    return max(shares, default=None)


def commits(plans: Sequence[Plan]) -> str:
    """Return the commits of the program that plans were made with, as their tasks lie in its repository."""
    return ", ".join(sorted({each.provenance.git for each in plans}))


def row(without: Plan, reserved: Plan) -> list[str]:
    """Return the line of a task."""
    costs = [each.statistics.objective for each in (without, reserved)]
    solved = ["" if each.status.solved else " (not solved)" for each in (without, reserved)]
    shares = [
        "–" if share is None else f"{100 * share:.0f} %"
        for share in (friction_of(without), friction_of(reserved), effort_of(without), effort_of(reserved))
    ]
    change = f"{100 * (costs[1] / costs[0] - 1):+.1f} %"
    return [without.name, f"{costs[0]:.4g}{solved[0]}", f"{costs[1]:.4g}{solved[1]}", change, *shares]


def main() -> int:
    """Write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("without", type=Path, help="folder of plans without a reserve")
    parser.add_argument("reserved", type=Path, help="folder of plans with one")
    parser.add_argument("--page", type=Path, default=PAGE)
    arguments = parser.parse_args()
    names = sorted(each.parent.name for each in arguments.reserved.glob("*/plan.json"))
    pairs = [
        (read_plan(arguments.without / name), read_plan(arguments.reserved / name))
        for name in names
        if (arguments.without / name / "plan.json").is_file()
    ]
    rows = Rows(arguments.page, HEADER)
    for pair in pairs:
        rows.put(row(*pair))
    asked = sorted({str(reserved.task.get("reserve")) for _, reserved in pairs})
    lines = [
        "# What a reserve costs",
        "",
        f"Written by `scripts/results/reserve_costs.py`: {len(pairs)} tasks planned without a reserve and with "
        f"`reserve: {' or '.join(asked)}`. Cheaper with a reserve means that the search took another way. Shares are "
        "the largest of any contact that sticks or lands, and of any control. Plans without a reserve were made at "
        f"{commits([without for without, _ in pairs])}, those with one at {commits([other for _, other in pairs])}.",
        "",
        markdown_table(HEADER, rows.cells),
    ]
    arguments.page.write_text("\n".join(lines), encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
