"""The gallery keeps in step with tasks/, and takes its rows and pictures from plans of the tasks as they are."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fesd_robot.planning.planner import plan
from fesd_robot.plans import Plan, write_plan
from fesd_robot.plans.plan import ContactHistory
from fesd_robot.render.outputs import write_optional_files
from fesd_robot.sweeps.planned import values_of
from fesd_robot.task import load_task
from scripts.results import gallery
from tests.render.browser import installed

ROOT = Path(__file__).parents[2]
TASKS = sorted(path.stem for path in (ROOT / "tasks").glob("*.yaml"))


@pytest.fixture(scope="module")
def pushed() -> Plan:
    """A plan of the pushed block."""
    return plan(load_task(ROOT / "tasks" / "block_push.yaml", ["method.compile=never"]))


def test_the_list_has_every_task() -> None:
    """The page of tasks holds exactly the list that the script writes: every task, its purpose, its picture."""
    text = gallery.TASK_LIST.read_text(encoding="utf-8")
    every = gallery.entries()
    assert [entry.name for entry in every] == TASKS
    assert gallery.with_list(text, gallery.task_list(every)) == text, "run scripts/gallery"
    listed = re.findall(r"\]\((images/gallery/\w+\.png)\)<br>\[`(\w+)`\]", text)
    assert [name for _, name in listed] == TASKS, "a picture is missing, run scripts/gallery"


def test_the_table_has_a_row_for_every_task() -> None:
    """Every task has one row, with its purpose; each is solved within 1e-6."""
    rows = re.findall(r"^\| \[(\w+)\].*$", gallery.TABLE.page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert rows == TASKS
    (header,) = re.findall(r"^\| task \|(.*)\|$", gallery.TABLE.page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    header = ["task", *header.split("|")]
    for line in gallery.TABLE.page.read_text(encoding="utf-8").splitlines():
        if line.startswith("| ["):
            cells = [cell.strip() for cell in line.strip("|").split("|")]
            assert len(cells) == len(header)
            assert cells[-1].startswith("solved") and float(cells[-4]) <= 1e-6


def test_pictures_are_small() -> None:
    """There is a picture of every task and none besides, each below 60 kB, together below 1 MB."""
    files = sorted(gallery.PICTURES.glob("*"))
    assert [file.stem for file in files] == TASKS
    assert max(file.stat().st_size for file in files) < 60_000
    assert sum(file.stat().st_size for file in files) < 1_000_000
    for file in files:
        with Image.open(file) as image:
            assert image.size == gallery.SIZE
            assert len(image.convert("RGB").getcolors(1 << 16)) > 8, "nothing is to be seen"


def test_a_row_is_that_of_the_plan(pushed: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    """Sizes, effort and verdict are the plan's; a task that takes long is marked."""
    effort = pushed.statistics
    row = {"task": "block_push", "verdict": "solved", "attempts": 1, "seconds": 12.0, "message": "Solved.", "made": ""}
    row |= {"program": "abc", **values_of(pushed), **gallery.measure(pushed)}
    cells = gallery.cells(row, "A block is pushed.")
    assert len(cells) == len(gallery.COLUMNS) and cells[1] == "A block is pushed."
    assert cells[2:6] == ["3", "2", str(effort.variables), str(effort.pairs)]
    assert int(cells[6]) == sum(one.iterations for one in effort.attempts)
    assert cells[-2:] == ["abc, older", "solved"]
    assert pushed.outcome is not None
    misses, (rear, front) = {one.name: one.missed_by for one in pushed.outcome.goal}, pushed.outcome.contacts.values()
    speed = max(misses["root_x velocity"], misses["root_z velocity"])
    assert cells[8] == f"{misses['root_x']:.3g} m" and cells[9].startswith(f"{speed:.3g} m/s, ")
    longest = max(slide.distance for slide in rear.slides + front.slides)
    assert cells[10:13] == ["no flight", f"{longest:.3g} m", "yes"]
    assert cells[7] == "12.0"
    monkeypatch.setattr(gallery, "LONG_SECONDS", 0.0)
    assert gallery.cells(row, "")[7] == "12.0 long"


def test_a_task_without_a_plan_has_a_row() -> None:
    """A process that did not survive is said in the last cell."""
    row = {"task": "block_push", "verdict": "crashed", "cost": None, "seconds": 3.0, "message": "it ended", "made": ""}
    cells = gallery.cells({**row, "program": "abc"}, "")
    assert len(cells) == len(gallery.COLUMNS) and cells[-1] == "not solved: it ended" and cells[7] == "3.0"


def test_the_block_slides_stops_and_slides(pushed: Plan) -> None:
    """Friction alone stops the block where a closed form says; it is then pushed to its target and rests there."""
    assert pushed.status.solved, pushed.status.message
    assert pushed.status.complementarity <= 1e-6
    stop = next(switch for switch in pushed.switches if switch.kind == "slip_to_stick")
    x, time = pushed.trajectory.configuration["root_x"], pushed.trajectory.time
    braking = 0.4 * 9.81
    assert stop.time == pytest.approx(1 / braking, abs=0.02)
    assert x[np.searchsorted(time, 0.4)] == pytest.approx(0.5 / braking, abs=0.01)
    assert {switch.kind for switch in pushed.switches} >= {"slip_to_stick", "stick_to_slip"}
    assert pushed.outcome is not None
    for corner in pushed.outcome.contacts.values():
        assert corner.flights == [] and corner.slides[0].end == pytest.approx(stop.time, abs=1e-9)
        assert corner.slides[0].distance == pytest.approx(x[np.searchsorted(time, 0.4)], abs=1e-6)
        assert corner.slide_distance == pytest.approx(x[-1], abs=1e-5), "it goes forwards only"
    assert x[-1] == pytest.approx(0.8, abs=0.0011)


def test_the_picture_shows_the_jump(pushed: Plan) -> None:
    """A jump of all feet is pictured at its highest point, a motion without one at its first touch, or half way."""
    assert gallery.telling_time(pushed) == pytest.approx(0.75)
    time = pushed.trajectory.time
    mode = np.where((time > 0.3) & (time < 0.9), "flight", "stick").tolist()
    gap = np.clip((time - 0.3) * (0.9 - time), 0, None)
    foot = ContactHistory(gap=gap, normal_force=0 * time, tangential_force=0 * time, mode=mode)
    jump = pushed.model_copy(update={"contacts": {"foot": foot}})
    assert gallery.telling_time(jump) == pytest.approx(0.6, abs=0.05)
    step = pushed.model_copy(
        update={"contacts": {"foot": foot, "other": foot.model_copy(update={"mode": len(mode) * ["stick"]})}}
    )
    assert gallery.telling_time(step) == gallery.telling_time(pushed), "the other foot stands"


@pytest.mark.skipif(not installed(), reason="needs Chromium")
def test_a_picture_is_taken_from_the_page(pushed: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The picture of a planned task shows the blue block on its ground, without caption and controls."""
    task = load_task(ROOT / "tasks" / "block_push.yaml", ["method.compile=never", "output.figures=false"])
    folder = write_plan(pushed, tmp_path / "block_push", lambda stage: write_optional_files(pushed, task, stage))
    monkeypatch.setattr(gallery, "PICTURES", tmp_path / "pictures")
    gallery.draw(folder)
    with Image.open(tmp_path / "pictures" / "block_push.png") as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    assert pixels.shape == (200, 320, 3)
    assert (pixels[:, :, 2] - pixels[:, :, 0] > 60).sum() > 1000, "the block is not visible"
    assert pixels[:10].min() > 180, "the caption is in the picture"


def test_what_is_not_a_task_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    """An unknown name ends with the names there are."""
    with pytest.raises(SystemExit):
        gallery.main(["hopper_no_jump"])
    assert "found 'hopper_no_jump', expected one of arm_push" in capsys.readouterr().err
