"""The documentation site builds without a warning, asks for nothing from the network, and has every key of a task."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from fesd_robot.task.json_schema import task_json_schema

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built once, with no way out to the network."""
    folder = tmp_path_factory.mktemp("site")
    nowhere = {f"{kind}_proxy": "http://127.0.0.1:9" for kind in ("http", "https", "HTTP", "HTTPS")}
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(folder)],
        cwd=ROOT,
        env={**os.environ, **nowhere, "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def test_nothing_is_fetched(site: Path) -> None:
    """No script, style, font or picture of any page has an address in the network."""
    for page in site.rglob("*.html"):
        for tag in re.findall(r"<(?:script|link|img|iframe|source|video)\b[^>]*>", page.read_text(encoding="utf-8")):
            assert not re.search(r"(?:src|href)=[\"']?(?:https?:)?//", tag), f"{page.name}: {tag}"
    for style in site.rglob("*.css"):
        assert not re.search(r"(?:url\([\"']?|@import [\"'])(?:https?:)?//", style.read_text(encoding="utf-8")), style


def test_the_reference_has_every_key(site: Path) -> None:
    """A section for every part of a task that has keys, and its keys in it; links lead to sections."""
    text = (site / "task-reference.html").read_text(encoding="utf-8")
    schema = task_json_schema()
    parts = {"Task": schema, **{name: part for name, part in schema["$defs"].items() if "properties" in part}}
    for name, part in parts.items():
        begin = text.index(f'<h2 id="{name.lower()}"')
        section = text[begin : text.find("<h2 ", begin + 1)]
        assert all(f"<code>{key}</code>" in section for key in part["properties"]), name
    targets = set(re.findall(r'<h2 id="(\w+)"', text))
    assert set(re.findall(r'href="#(\w+)"', text)) <= {*targets, "__skip"} | {"all-keys-of-a-task"} | targets


def test_the_python_reference_has_the_public_functions(site: Path) -> None:
    """Functions of the overview are described with their arguments."""
    text = (site / "python.html").read_text(encoding="utf-8")
    for name in ("load_task", "explain", "plan", "write_plan", "read_plan", "export_plan", "render_plan", "report"):
        assert re.search(rf'<h3 id="fesd_robot\.(?:\w+\.)?{name}"', text), name
    assert text.count("Parameters:") >= 8
