"""Draw the picture of the README, docs/images/hopper_page.png, from a plan.

    scripts/hero.py tests/render/plans/hopper_one_jump.json --tasks tasks

With `--check` nothing is written: it fails if the picture is not that of the plan any more. Needs Chromium.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from fesd_robot.plans import Plan, read_plan, task_of  # noqa: E402
from fesd_robot.render.outputs import write_page  # noqa: E402
from tests.render.browser import Browser  # noqa: E402

PICTURE = ROOT / "docs" / "images" / "hopper_page.png"
SIZE = (1280, 720)
AFTER_IMPACT = 0.01
"""s."""

DIFFERENCE = 4.0
"""Mean difference of grey levels up to which two pictures are the same: fonts differ between machines."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plan", type=Path, help="a folder of results, or a plan.json")
    parser.add_argument("--time", type=float, help="moment, s; default: just after the hardest impact")
    parser.add_argument("--tasks", type=Path, help="where relative paths in the task start; default: as the plan says")
    parser.add_argument("--out", type=Path, default=PICTURE, help="the picture")
    parser.add_argument("--check", action="store_true", help="compare with the picture that is there")
    given = parser.parse_args()
    drawn = picture(given.plan, given.time, given.tasks)
    if not given.check:
        given.out.parent.mkdir(parents=True, exist_ok=True)
        Image.fromarray(drawn).save(given.out, optimize=True)
        print(f"{given.out}: {given.out.stat().st_size / 1e3:.0f} kB")
        return
    old = np.asarray(Image.open(given.out).convert("RGB"))
    difference = np.abs(old.astype(float) - drawn).mean() if old.shape == drawn.shape else np.inf
    print(f"{given.out} differs by {difference:.2f} grey levels on average, allowed are {DIFFERENCE:g}")
    if difference > DIFFERENCE:
        sys.exit(f"{given.out} is not what the page looks like; draw it again with scripts/hero.py {given.plan}")


def telling_moment(plan: Plan) -> float:
    """Return when force and impulse are both to be seen, just after the hardest impact, or the largest force, s."""
    if plan.impulses:
        return max(plan.impulses, key=lambda one: one.normal).time + AFTER_IMPACT
    force = np.max([contact.normal_force for contact in plan.contacts.values()], axis=0)
    return float(plan.trajectory.time[np.argmax(force)])


def picture(path: Path, time: float | None, tasks: Path | None) -> np.ndarray:
    """Return the page of a plan at a moment, uint8, (height, width, 3)."""
    plan = read_plan(path)
    if time is None:
        time = telling_moment(plan)
    with tempfile.TemporaryDirectory() as folder, Browser(SIZE) as browser:
        browser.open(write_page(plan, task_of(plan, tasks), Path(folder) / "plan.html"), f"#t={time}")
        browser.screenshot()  # the first one may lack the shadow
        return browser.screenshot()


if __name__ == "__main__":
    main()
