"""The notebook of the documentation runs, and shows a plan with its page, which plays without the network."""

from __future__ import annotations

import time
from pathlib import Path

import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient

from tests.render.browser import Browser

MOST_COLOURS_OF_TEXT = 60
"""A frame without a scene has greys alone."""

NOTEBOOK = Path(__file__).parents[2] / "docs" / "notebook.ipynb"


@pytest.fixture(scope="module")
def executed(tmp_path_factory: pytest.TempPathFactory) -> nbformat.NotebookNode:
    """The notebook after all its cells, run in an empty folder."""
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    folder = tmp_path_factory.mktemp("notebook")
    NotebookClient(
        notebook, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(folder)}}
    ).execute()
    return notebook


def _data(notebook: nbformat.NotebookNode, kind: str) -> list[str]:
    return [
        output["data"][kind]
        for cell in notebook.cells
        for output in cell.get("outputs", [])
        if kind in output.get("data", {})
    ]


def test_the_notebook_is_kept_without_outputs() -> None:
    """What it prints is made where it runs, and never older than the program."""
    cells = nbformat.read(NOTEBOOK, as_version=4).cells
    assert not any(cell.get("outputs") or cell.get("execution_count") for cell in cells)


def test_from_robot_to_plan_to_plot(executed: nbformat.NotebookNode) -> None:
    """The plan is solved and shown with its page, in a line as text; there is a plot, and the switches are printed."""
    (shown,) = _data(executed, "text/html")
    assert "solved</span> The robot reaches its goal" in shown and "<iframe sandbox" in shown
    texts = _data(executed, "text/plain")
    assert max(map(len, texts)) < 300 and any(text.startswith("<Plan block_push: Solved") for text in texts)
    assert _data(executed, "image/png")
    printed = "".join(output.get("text", "") for cell in executed.cells for output in cell.get("outputs", []))
    assert "slip_to_stick" in printed and "push.csv" in printed


def test_the_page_plays_in_its_frame(executed: nbformat.NotebookNode, tmp_path: Path) -> None:
    """In the frame the clock runs, nothing is fetched and nothing is logged as an error."""
    page = tmp_path / "cell.html"
    (shown,) = _data(executed, "text/html")
    page.write_text(f"<!doctype html><meta charset='utf-8'>{shown}", encoding="utf-8")
    with Browser() as browser:
        browser.call("Page.navigate", url=page.as_uri())
        deadline = time.monotonic() + browser.timeout
        while (drawn := _colours(browser.screenshot())) < MOST_COLOURS_OF_TEXT:
            assert time.monotonic() < deadline, f"{drawn} colours in the frame"
        assert not browser.console and not [one for one in browser.requests if one.startswith("http")]


def _colours(picture: np.ndarray) -> int:
    """Return how many colours the frame has, below the sentences."""
    return len(np.unique(picture[260:640:3, 100:1100:3].reshape(-1, 3), axis=0))
