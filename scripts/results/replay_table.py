"""Plans replayed in MuJoCo: how far each ends from its plan with three controllers, and how many perturbed runs finish.

    scripts/gallery && python scripts/results/replay_table.py build/gallery      # writes docs/results/replay.md

Every argument is a folder of plans, one folder a task, or a plan's own. With ``--perturb NAME ...`` these plans are
also run twenty times perturbed with each controller.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from fesd_robot import FesdRobotError, Plan, read_plan
from fesd_robot.in_mujoco import CONTROLLERS, Replay, replay
from fesd_robot.plans.tables import markdown_table

RESULTS = Path(__file__).resolve().parents[2] / "docs" / "results"
HEADER = ("plan", *CONTROLLERS, "landings with the LQR, ms", "effort used", "what is different in MuJoCo")
RMS, LANDING, TARGET = 2e-3, 5e-3, "lqr"
"""m, s; what a run with the LQR is measured by."""

PERTURBED = ("hopper_one_jump", "hopper_five_jumps", "solo12_jump_in_space", "go2_jump", "biped_step", "pick_and_place")


def plans_in(folders: Sequence[Path]) -> Iterator[Plan]:
    """Yield the plans in some folders, in the order of their names."""
    for folder in folders:
        files = (
            [folder] if (folder / "plan.json").is_file() else sorted(each.parent for each in folder.glob("*/plan.json"))
        )
        for file in files:
            yield read_plan(file)


def reserve_of(plan: Plan) -> dict[str, float]:
    """Return the parts of cones and limits that the task of a plan asks it to leave unused."""
    given = plan.task.get("reserve") or {}
    return {key: float(given.get(key, 0.0)) for key in ("friction", "effort")}


def row_of(found: Replay, seconds: float) -> dict[str, Any]:
    """Return what is kept of a replay."""
    return {
        "plan": found.plan.name,
        "seconds": round(seconds, 1),
        "reserve": reserve_of(found.plan),
        "steps": found.scene.model.opt.timestep,
        "notes": list(found.scene.notes),
        "runs": [each.entry() for each in found.runs],
    }


def measured(plan: Plan, perturb: bool) -> dict[str, Any]:
    """Return the row of a plan, with the reason where it cannot be replayed."""
    begin = time.perf_counter()
    try:
        return row_of(replay(plan, perturb=perturb), time.perf_counter() - begin)
    except FesdRobotError as error:
        return {
            "plan": plan.name,
            "seconds": 0.0,
            "reserve": reserve_of(plan),
            "steps": 0.0,
            "notes": [str(error)],
            "runs": [],
        }


def meets(entry: dict[str, Any]) -> bool:
    """Return whether a run has an error of its bodies of at most 2 mm, and every landing within 5 ms."""
    errors = entry["touchdown_errors"]
    near = entry["base_rms"] is None or entry["base_rms"] <= RMS
    return bool(entry["finished"] and near and all(each is not None and abs(each) <= LANDING for each in errors))


def page(rows: Sequence[dict[str, Any]]) -> str:
    """Return the page of all rows."""
    held = sum(any(meets(each) for each in row["runs"] if each["controller"] == TARGET) for row in rows)
    reserves = sorted({(row["reserve"]["friction"], row["reserve"]["effort"]) for row in rows})
    kept = " or ".join(
        f"{100 * friction:g} % of cones of friction and {100 * effort:g} % of efforts" for friction, effort in reserves
    )
    lines = [
        "# Plans in MuJoCo",
        "",
        "Written by `scripts/results/replay_table.py`; numbers in [replay.json](replay.json). Every plan is "
        "run with its "
        "controls alone, with proportional and derivative controllers, and with the LQR, all with the same weights "
        "([Replay](../replay.md)): root mean square and end of the error of its bodies, mm, and the largest error of a "
        "landing, ms. A run in bold has not finished.",
        "",
        f"The plans leave {kept} unused (`reserve`).",
        "",
        f"With the LQR {held} of {len(rows)} have an error of their bodies of at most {1e3 * RMS:g} mm and every "
        f"landing within {1e3 * LANDING:g} ms.",
        "",
        markdown_table(HEADER, [cells_of(row) for row in rows]),
    ]
    if told := [row for row in rows if any(each["perturbed"] for each in row["runs"])]:
        lines += ["## Perturbed", "", markdown_table(["plan", *CONTROLLERS], [finished(row) for row in told])]
    return "\n".join(lines)


def cells_of(row: dict[str, Any]) -> list[str]:
    """Return the cells of a plan."""
    runs = {each["controller"]: each for each in row["runs"]}
    target = runs.get(TARGET)
    landing = _landing(target) if target else "–"
    effort = f"{100 * target['effort']:.0f} %" if target else "–"
    distances = [_distance(runs.get(name)) for name in CONTROLLERS]
    return [row["plan"], *distances, landing, effort, "; ".join(row["notes"])]


def finished(row: dict[str, Any]) -> list[str]:
    """Return how many of the perturbed runs of a plan have finished, by controller."""
    runs = [each["perturbed"] for each in row["runs"]]
    return [row["plan"], *(f"{each['finished']} of {len(each['runs'])}" for each in runs)]


def _distance(entry: dict[str, Any] | None) -> str:
    if entry is None:
        return "–"
    if entry["base_rms"] is None:
        words = f"joints {1e3 * entry['joint_rms']:.2g} mrad"
    else:
        words = f"{_short(1e3 * entry['base_rms'])} / {_short(1e3 * entry['base_end'])}"
    return words if entry["finished"] else f"**{words}**"


def _short(value: float) -> str:
    return f"{value:.2g}" if value < 100 else f"{value:.0f}"


def _landing(entry: dict[str, Any]) -> str:
    errors = entry["touchdown_errors"]
    came = [each for each in errors if each is not None]
    words = [f"{1e3 * max(came, key=abs):+.2g}"] if came else []
    words += [f"{len(errors) - len(came)} missing"] if len(came) < len(errors) else []
    return ", ".join(words) or "–"


def main() -> int:
    """Replay the plans, and write the page and its numbers."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("plans", nargs="+", type=Path, help="folders of plans")
    parser.add_argument("--perturb", nargs="*", default=PERTURBED, metavar="NAME", help="plans to perturb")
    parser.add_argument("--page", type=Path, default=RESULTS / "replay.md")
    arguments = parser.parse_args()
    rows = []
    for plan in plans_in(arguments.plans):
        row = measured(plan, plan.name in arguments.perturb)
        print(row["plan"], *(f"{each['controller']}: {_distance(each)}" for each in row["runs"]), sep="  ", flush=True)
        rows.append(row)
    arguments.page.write_text(page(rows), encoding="utf-8")
    arguments.page.with_suffix(".json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
