"""The page of the scripts names every one of them, in the section of its folder."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).parents[2] / "scripts"
PAGE = (SCRIPTS / "README.md").read_text(encoding="utf-8")


def _listed(section: str) -> list[str]:
    """Return the names in the first column of the tables of a part of the page."""
    return re.findall(r"^\| `([\w.]+)` \|", section, re.M)


def _part(begin: str) -> str:
    """Return the page from a text to the next heading, or to where the folder of reproductions begins."""
    return re.split(r"^## |^`results/reproduce/`", PAGE.partition(begin)[2], maxsplit=1, flags=re.M)[0]


@pytest.mark.parametrize("folder", ["benchmarks", "results", "results/reproduce", "tools"])
def test_every_script_of_a_folder_is_listed(folder: str) -> None:
    """Its table has all programs of a folder once, in their order, and nothing else."""
    begin = "`results/reproduce/`" if folder == "results/reproduce" else f"## {folder}/"
    programs = sorted(file.name for file in (SCRIPTS / folder).glob("*.py") if not file.name.startswith("_"))
    assert _listed(_part(begin)) == programs


def test_scripts_without_an_ending_are_listed() -> None:
    """The first tables have what lies in the folder itself and the jobs, and nothing else."""
    own = {file.name for file in SCRIPTS.iterdir() if file.is_file() and file.name != "README.md"}
    jobs = {file.name for file in (SCRIPTS / "ci").iterdir()}
    assert set(_listed(PAGE.partition("\n## ")[0])) == own | jobs


def test_every_folder_is_on_the_page() -> None:
    """No folder of programs is left out."""
    folders = {file.parent.relative_to(SCRIPTS).as_posix() for file in SCRIPTS.rglob("*.py")} - {"."}
    assert {folder for folder in folders if not folder.startswith(("benchmarks/compare", "benchmarks/suites"))} == {
        "benchmarks", "results", "results/reproduce", "tools",
    }  # fmt: skip
