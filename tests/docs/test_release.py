"""A release says one version everywhere, and its jobs run here as on a forge."""

from __future__ import annotations

import re

from ruamel.yaml import YAML

import fesd_robot
from scripts.tools.oldest import lowest_versions

from .blocks import ROOT

JOBS = sorted(file.name for file in (ROOT / "scripts" / "ci").iterdir() if not file.name.startswith("_"))


def _read(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def test_the_changelog_begins_with_what_is_not_released() -> None:
    """Below `Unreleased` the first release is the version of the package, on the day of CITATION.cff."""
    headings = re.findall(r"^## (.*)$", _read("CHANGELOG.md"), re.MULTILINE)
    citation = YAML(typ="safe", pure=True).load(_read("CITATION.cff"))
    assert headings[:2] == ["[Unreleased]", f"[{fesd_robot.__version__}] - {citation['date-released']}"]


def test_the_version_has_one_source() -> None:
    """The distributions take it from the package."""
    project = _read("pyproject.toml")
    assert 'dynamic = ["version"]' in project and 'path = "fesd_robot/__init__.py"' in project


def test_a_forge_runs_what_runs_here() -> None:
    """Every job of scripts/ci is called by .ci/run and by the workflow, and nothing else is."""
    here = re.findall(r"for job in (.*); do", _read(".ci/run"))[0].split()
    workflow = YAML(typ="safe", pure=True).load(_read(".github/workflows/ci.yml"))["jobs"]
    calls = [step["run"].split()[0] for job in workflow.values() for step in job["steps"] if "run" in step]
    assert sorted(here) == sorted(workflow) == JOBS
    assert sorted(calls) == [f"scripts/ci/{job}" for job in JOBS]


def test_the_oldest_and_the_newest_python_are_tried() -> None:
    """Those of the classifiers, the first of which is the oldest that can be installed, are those of the workflow."""
    versions = re.findall(r"Programming Language :: Python :: (3\.\d+)", _read("pyproject.toml"))
    assert f'requires-python = ">={versions[0]}"' in _read("pyproject.toml")
    workflow = YAML(typ="safe", pure=True).load(_read(".github/workflows/ci.yml"))["jobs"]
    for job in ("tests", "wheel"):
        tried = [row["python"] for row in workflow[job]["strategy"]["matrix"]["include"]]
        assert tried == [versions[0], versions[-1]]


def test_tests_of_pages_are_those_that_open_a_browser() -> None:
    """The job `browser` has all files that use one; the job `tests` leaves out what it has."""
    pages = [ROOT / name for name in re.findall(r"pages=\((.*)\)", _read("scripts/ci/_pages.sh"))[0].split()]
    uses = [
        file
        for file in (ROOT / "tests").rglob("test_*.py")
        if re.search(r"^from (\.|tests\.render\.)browser import", file.read_text(encoding="utf-8"), re.MULTILINE)
    ]
    assert uses
    for file in uses:
        assert any(page == file or page in file.parents for page in pages), file


def test_every_dependency_has_a_lowest_version() -> None:
    """It is the one that the job with the oldest versions installs."""
    project = _read("pyproject.toml")
    dependencies = re.findall(r'"([\w-]+)>=', project.partition("\ndependencies = [")[2].partition("\n]")[0])
    assert [line.partition("==")[0] for line in lowest_versions(project)] == dependencies
