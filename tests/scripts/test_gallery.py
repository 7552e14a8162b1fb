"""The gallery keeps in step with tasks/, and takes its rows and pictures from plans of the tasks as they are."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fesd_robot.planning.planner import plan
from fesd_robot.plans import Plan, write_plan
from fesd_robot.plans.plan import ContactHistory
from fesd_robot.render.outputs import write_optional_files
from fesd_robot.task import load_task
from scripts.results import gallery

ROOT = Path(__file__).parents[2]
TASKS = sorted(path.stem for path in (ROOT / "tasks").glob("*.yaml"))


@pytest.fixture(scope="module")
def pushed() -> Plan:
    """A plan of the pushed block."""
    return plan(load_task(ROOT / "tasks" / "block_push.yaml", ["method.compile=never"]))


def test_the_list_has_every_task(tmp_path: Path) -> None:
    """The page of tasks holds exactly the list that the script writes: every task, its purpose, its picture."""
    text = gallery.TASK_LIST.read_text(encoding="utf-8")
    every = gallery.entries(tmp_path)
    assert [entry.name for entry in every] == TASKS
    assert gallery.with_list(text, gallery.task_list(every)) == text, "run scripts/gallery"
    listed = re.findall(r"\]\((images/gallery/\w+\.png)\)<br>\[`(\w+)`\]", text)
    assert [name for _, name in listed] == TASKS, "a picture is missing, run scripts/gallery"


@pytest.mark.parametrize("folder", [["--runs", "/here/runs"], ["--runs=/here/runs"], []])
def test_the_page_tells_no_folder_of_a_machine(folder: list[str]) -> None:
    """How the page was made is told without where plans went."""
    told = gallery.told(["ball_bat", *folder, "--time-limit", "300"])
    assert told == "scripts/gallery ball_bat --time-limit 300"


def test_the_table_has_a_row_for_every_task() -> None:
    """Every task has one row, with its purpose; each is solved within 1e-6."""
    rows = re.findall(r"^\| \[(\w+)\].*$", gallery.PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert rows == TASKS
    (header,) = re.findall(r"^\| task \|(.*)\|$", gallery.PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    header = ["task", *header.split("|")]
    for line in gallery.PAGE.read_text(encoding="utf-8").splitlines():
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


def test_a_row_is_that_of_the_plan(pushed: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Sizes, effort and verdict are the plan's; a plan of a task that has changed since does not count."""
    (entry,) = [one for one in gallery.entries(tmp_path) if one.name == "block_push"]
    assert gallery.row(entry)[-1] == "not planned"
    write_plan(pushed, entry.folder)
    assert gallery.row(entry)[-1] == "not planned", "it was planned with another method.compile"
    monkeypatch.setattr(gallery, "load_task", lambda path: load_task(path, ["method.compile=never"]))
    cells = gallery.row(entry)
    last = ["git", "log", "-1", "--format=%h", "--", "fesd_robot", "models", "tasks/block_push.yaml"]
    commit = subprocess.run(last, cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
    assert cells[-2].removesuffix("+") == commit
    assert gallery.program_of("block_push", "none") == "not known"
    effort = pushed.statistics
    assert cells[2:6] == ["3", "2", str(effort.variables), str(effort.pairs)]
    assert int(cells[6]) == sum(one.iterations for one in effort.attempts)
    assert cells[-1].startswith("solved")
    assert pushed.outcome is not None
    misses, (rear, front) = {one.name: one.missed_by for one in pushed.outcome.goal}, pushed.outcome.contacts.values()
    speed = max(misses["root_x velocity"], misses["root_z velocity"])
    assert cells[8] == f"{misses['root_x']:.3g} m" and cells[9].startswith(f"{speed:.3g} m/s, ")
    longest = max(slide.distance for slide in rear.slides + front.slides)
    assert cells[10:12] == ["no flight", f"{longest:.3g} m"] and len(cells) == len(gallery.COLUMNS)
    rows = gallery.Rows(tmp_path / "gallery.md", gallery.COLUMNS)
    gallery.keep(entry, rows)
    page = gallery.page(rows, "scripts/gallery")
    assert "**1 of 1 solved**" in page
    monkeypatch.setattr(gallery, "LONG_SECONDS", gallery.seconds_of(pushed) + 1.0)
    gallery.keep(entry, rows)
    assert gallery.marked_long(rows) == set()
    monkeypatch.setattr(gallery, "LONG_SECONDS", 0.0)
    gallery.keep(entry, rows)
    assert gallery.marked_long(rows) == {"block_push"}
    assert gallery.Rows(tmp_path / "gallery.md", gallery.COLUMNS).cells == rows.cells, "rows are kept in a data file"


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


def test_a_picture_is_taken_from_the_page(pushed: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The picture of a planned task shows the blue block on its ground, without caption and controls."""
    task = load_task(ROOT / "tasks" / "block_push.yaml", ["method.compile=never", "output.figures=false"])
    (entry,) = [one for one in gallery.entries(tmp_path) if one.name == "block_push"]
    write_plan(pushed, entry.folder, lambda stage: write_optional_files(pushed, task, stage))
    monkeypatch.setattr(gallery, "load_task", lambda path: load_task(path, ["method.compile=never"]))
    monkeypatch.setattr(gallery, "PICTURES", tmp_path / "pictures")
    gallery.draw(entry)
    with Image.open(tmp_path / "pictures" / "block_push.png") as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    assert pixels.shape == (200, 320, 3)
    assert (pixels[:, :, 2] - pixels[:, :, 0] > 60).sum() > 1000, "the block is not visible"
    assert pixels[:10].min() > 180, "the caption is in the picture"


def test_what_is_not_a_task_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    """An unknown name ends with the names there are."""
    with pytest.raises(SystemExit):
        gallery.parse(TASKS, ["hopper_no_jump"])
    assert "found 'hopper_no_jump', expected one of arm_push" in capsys.readouterr().err
