"""A newcomer meets a short README whose links lead somewhere, and a citation that is that of the package."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from ruamel.yaml import YAML

import fesd_robot

from .blocks import ROOT

README = ROOT / "README.md"
OUTSIDE_THE_SITE = [README, *(ROOT / name for name in ("CONTRIBUTING.md", "CHANGELOG.md", "notes/laboratory-diary.md"))]
"""Pages whose links no build of the site checks."""

MOST_WORDS = 1200


def test_the_readme_is_short() -> None:
    """It has at most 1200 words, code and tables included."""
    assert len(README.read_text(encoding="utf-8").split()) <= MOST_WORDS


@pytest.mark.parametrize("page", OUTSIDE_THE_SITE, ids=lambda page: page.stem)
def test_links_lead_somewhere(page: Path) -> None:
    """Every link to a file of the repository names one that is there, with the section after its #."""
    for target in re.findall(r"\]\((?!https?:)([^)\s]+)\)", page.read_text(encoding="utf-8")):
        name, _, section = target.partition("#")
        file = page.parent / name if name else page
        assert file.exists(), target
        assert not section or section in _sections(file), target


def test_the_citation_is_that_of_the_package() -> None:
    """CITATION.cff has the version of the package, and the README the title, version and authors of CITATION.cff."""
    citation = YAML(typ="safe", pure=True).load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert {"cff-version", "message", "title", "authors"} <= set(citation)
    assert citation["version"] == fesd_robot.__version__
    (entry,) = re.findall(r"```bibtex\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    fields = dict(re.findall(r"(\w+) += \{+(.*?)\}+,?\n", entry))
    assert fields["title"] == citation["title"] and fields["version"] == citation["version"]
    assert [fields["author"]] == [author["name"] for author in citation["authors"]]


def _sections(page: Path) -> set[str]:
    """Return the anchors of a page's headings."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}
