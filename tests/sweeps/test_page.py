"""The page of a sweep as a browser shows it, without a network."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from fesd_robot.sweeps import Answer, Order, SweepSettings, Verdict, load_sweep, swept
from tests.render.browser import Browser
from tests.sweeps.stubs import answer, value

SWEEP = {
    "task": "hopper_one_jump",
    "vary": {"goal.configuration.root_x": [0.9, 1.0, 1.1], "ground.friction": [0.4, 0.5, 0.6, 0.7]},
}
NAME = "</script><script>document.title = 'taken'</script>"


def varied(order: Order, task: Path) -> Answer:
    """Cost that grows with both keys; one row fails, with a message that could end a script."""
    if order.number == 5:
        return Answer(order.number, Verdict.NOT_SOLVED, {"cost": 9.0}, NAME)
    cost = value(order, "goal.configuration.root_x") + value(order, "ground.friction")
    return answer(order, cost, {"plan.json": b"{}", "plan.html": b"<title>the plan</title>"})


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a sweep."""
    root = tmp_path_factory.mktemp("page")
    swept(load_sweep(SWEEP), root / "other", SweepSettings(jobs=1, keep="none"), varied)
    swept(load_sweep(SWEEP), root / "sweep", SweepSettings(jobs=1, against=root / "other"), varied)
    return root / "sweep"


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """A browser without a network."""
    with Browser() as opened:
        yield opened


def test_the_page_shows_cells_plots_and_a_table(folder: Path, browser: Browser) -> None:
    """Every row is a cell and a line, both plots are drawn, nothing is asked of a network, no text runs."""
    browser.open(folder / "sweep.html")
    assert browser.run("document.title") == "sweep"
    assert browser.run("document.querySelectorAll('#cells td').length") == 12
    assert browser.run("document.querySelectorAll('#plans tbody tr').length") == 12
    assert browser.run("document.querySelectorAll('#pareto canvas, #costs canvas').length") == 2
    assert browser.run("document.getElementById('summary').textContent") == "12 of 12 plans, 11 solved, 1 not solved"
    assert browser.console == []
    assert not [url for url in browser.requests if not url.startswith(("file:", "about:"))]


def test_cells_say_what_is_in_them(folder: Path, browser: Browser) -> None:
    """Costs of solved rows are there by value, the others by verdict; another choice redraws them."""
    browser.open(folder / "sweep.html")
    texts = browser.run("[...document.querySelectorAll('#cells td')].map((td) => td.textContent)")
    assert texts.count("not solved") == 1 and "1.3" in texts and "1.8" in texts
    browser.run("document.getElementById('down').value = '–'; document.getElementById('down').onchange({})")
    texts = browser.run("[...document.querySelectorAll('#cells td')].map((td) => td.textContent)")
    assert texts == ["4/4", "3/4", "4/4"]


def test_a_click_opens_a_plan(folder: Path, browser: Browser) -> None:
    """Numbers in the table, and cells, lead to the page of their plan."""
    browser.open(folder / "sweep.html")
    links = browser.run("[...document.querySelectorAll('#plans a')].map((a) => a.getAttribute('href'))")
    assert len(links) == 11
    assert all((folder / link).read_text() == "<title>the plan</title>" for link in links)
    assert browser.run("document.querySelectorAll('#cells a').length") == 11


def test_the_table_sorts_and_chooses(folder: Path, browser: Browser) -> None:
    """A click on a column orders by it, a verdict leaves the others out."""
    browser.open(folder / "sweep.html")
    browser.run("[...document.querySelectorAll('#plans th')].find((th) => th.textContent.startsWith('cost')).click()")
    costs = browser.run(
        "[...document.querySelectorAll('#plans tbody tr')].map((tr) => Number(tr.cells[4].textContent))"
    )
    assert costs == sorted(costs)
    browser.run("document.getElementById('which').value = 'not solved'")
    browser.run("document.getElementById('which').onchange({ target: document.getElementById('which') })")
    assert browser.run("document.getElementById('count').textContent") == "1 plans"


def test_the_comparison_is_of_the_same_rows(folder: Path) -> None:
    """Two equal sweeps have twelve rows in common, and none is cheaper."""
    page = (folder / "sweep.html").read_text()
    assert "<th>rows in common</th><td>12</td><td>12</td>" in page
    assert "<th>cheaper</th><td>0</td><td>0</td>" in page
