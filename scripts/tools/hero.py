"""Draw the picture of the documentation's first page, docs/images/hopper_page.png, from a plan.

    scripts/tools/hero.py tests/render/plans/hopper_one_jump.json --tasks tasks
    scripts/tools/hero.py tests/render/plans/solo12_jump.json --tasks tasks --motion docs/images/solo12_jump.gif

With `--motion` it draws the scene of the page in motion instead, as the README shows it. With `--check` nothing is
written: it fails if the picture, or the first, middle or last one of the motion, is not that of the plan any more.
Needs Chromium.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from fesd_robot.plans import Plan, read_plan, task_of
from fesd_robot.render.outputs import write_page
from scripts.results.gallery import WITHOUT_CAPTION
from tests.render.browser import Browser

ROOT = Path(__file__).parents[2]
PICTURE = ROOT / "docs" / "images" / "hopper_page.png"
SIZE = (1280, 720)
AFTER_IMPACT = 0.01
"""s."""

MOTION_SIZE = (640, 320)
FRAME_STEP = 0.02
"""Time of the motion between two frames, s."""

FRAME_SECONDS, LAST_FRAME_SECONDS = 0.08, 1.0
"""How long a frame is shown: a quarter of the speed of the motion; the last frame is shown for longer."""

COLOURS = 128
"""Half of a GIF's palette: the most frequent colours; the other half are those farthest from each other."""

DIFFERENCE = 4.0
"""Mean difference of grey levels up to which two pictures are the same: fonts differ between machines."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plan", type=Path, help="a folder of results, or a plan.json")
    parser.add_argument("--time", type=float, help="moment, s; default: just after the hardest impact")
    parser.add_argument("--tasks", type=Path, help="where relative paths in the task start; default: as the plan says")
    parser.add_argument("--out", type=Path, default=PICTURE, help="the picture")
    parser.add_argument("--motion", type=Path, help="draw the motion into this GIF instead of the picture")
    parser.add_argument("--check", action="store_true", help="compare with the picture that is there")
    given = parser.parse_args()
    file = given.motion or given.out
    if given.check:
        check(file, given)
    elif given.motion:
        plan = read_plan(given.plan)
        end = float(plan.trajectory.time[-1])
        write_motion(file, frames(given.plan, given.tasks, np.linspace(0.0, end, round(end / FRAME_STEP) + 1)))
    else:
        file.parent.mkdir(parents=True, exist_ok=True)
        Image.fromarray(picture(given.plan, given.time, given.tasks)).save(file, optimize=True)
    print(f"{file}: {file.stat().st_size / 1e3:.0f} kB")


def check(file: Path, given: argparse.Namespace) -> None:
    """End the program if a picture, or some of a motion, are not what the page of the plan looks like."""
    with Image.open(file) as image:
        chosen = [0, (image.n_frames - 1) // 2, image.n_frames - 1] if given.motion else [0]
        old = []
        for index in chosen:
            image.seek(index)
            old.append(np.asarray(image.convert("RGB")).astype(float))
        last = max(image.n_frames - 1, 1) if given.motion else 1
    if given.motion:
        end = float(read_plan(given.plan).trajectory.time[-1])
        drawn = frames(given.plan, given.tasks, [end * index / last for index in chosen])
    else:
        drawn = [picture(given.plan, given.time, given.tasks)]
    difference = max(
        np.abs(before - now).mean() if before.shape == now.shape else np.inf
        for before, now in zip(old, drawn, strict=True)
    )
    print(f"{file} differs by {difference:.2f} grey levels on average, allowed are {DIFFERENCE:g}")
    if difference > DIFFERENCE:
        sys.exit(f"{file} is not what the page looks like; draw it again with scripts/tools/hero.py {given.plan}")


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


def frames(path: Path, tasks: Path | None, times: Sequence[float] | np.ndarray) -> list[np.ndarray]:
    """Return the scene of a plan at some times, s, uint8, (height, width, 3) each."""
    plan = read_plan(path)
    with tempfile.TemporaryDirectory() as folder, Browser(MOTION_SIZE) as browser:
        page = write_page(plan, task_of(plan, tasks), Path(folder) / "plan.html")
        page.write_text(page.read_text(encoding="utf-8").replace("</head>", WITHOUT_CAPTION, 1), encoding="utf-8")
        browser.open(page, "#t=0")
        browser.screenshot()  # the first one may lack the shadow
        drawn = []
        for time in times:
            browser.run(f"location.hash = '#t={time:.6f}'")
            drawn.append(browser.screenshot())
    return drawn


def write_motion(file: Path, drawn: Sequence[np.ndarray]) -> None:
    """Write pictures as a GIF that repeats, with one palette."""
    some = Image.fromarray(np.vstack(drawn[:: max(1, len(drawn) // 4)]))
    palette = Image.new("P", (1, 1))
    halves = (Image.Quantize.MEDIANCUT, Image.Quantize.MAXCOVERAGE)
    palette.putpalette(
        [level for half in halves for level in (some.quantize(COLOURS, half).getpalette() or [])[: 3 * COLOURS]]
    )
    first, *others = [Image.fromarray(one).quantize(palette=palette, dither=Image.Dither.NONE) for one in drawn]
    shown = [1000 * FRAME_SECONDS] * len(others) + [1000 * LAST_FRAME_SECONDS]
    first.save(file, save_all=True, append_images=others, duration=shown, loop=0, optimize=True)


if __name__ == "__main__":
    main()
