"""Code blocks of README and documentation run, and consoles print what the pages say.

Consoles and Python run as they are, but for plans: these stand still for 0.2 s instead of jumping, and words are
compared, not numbers. Commands in shell blocks are read by the program's own parser, but not run. Blocks of YAML are
read, and compared with the keys of a task; a whole task is checked, and so are the first rows of a sweep.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pydantic import TypeAdapter
from ruamel.yaml import YAML
from typer.main import get_command

import fesd_robot
from fesd_robot.cli.app import app
from fesd_robot.examples import copy_examples
from fesd_robot.ocp import formulate
from fesd_robot.sweeps import load_sweep
from fesd_robot.sweeps.run import checked_tasks
from fesd_robot.task import Task, load_task
from fesd_robot.task.json_schema import task_json_schema

from .blocks import PAGES, ROOT, SHORT, Block, blocks, commands, pattern, run, stable

TESTED_ELSEWHERE = (ROOT / "docs" / "simulation.md", ROOT / "docs" / "simulating-robots.md")
"""Their examples have tests of their own, in tests/fesd and tests/simulation."""

LIVE = [page for page in PAGES if page not in TESTED_ELSEWHERE and blocks(page, "console", "python")]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty working directory; tasks that are loaded in it are short."""
    loading = fesd_robot.load_task
    monkeypatch.setattr(fesd_robot, "load_task", lambda path: loading(path, SHORT))
    monkeypatch.chdir(tmp_path)
    yield tmp_path


@pytest.mark.parametrize("page", LIVE, ids=lambda page: page.stem)
def test_consoles_and_python_run(
    page: Path, folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """One after the other, in one folder, which is that of the repository's tasks for the README."""
    if page.name == "README.md":
        copy_examples(["hopper_one_jump"], folder, schema=b"")
    names: dict[str, Any] = {}
    for block in blocks(page, "console", "python"):
        if block.language == "python":
            exec(compile(block.text, str(page), "exec"), names)
            continue
        for words, shown in commands(block):
            if words[1] == "plan":
                printed = run([*words, *(word for one in SHORT for word in ("--set", one))], monkeypatch, capfd)
                said = [stable(line) for line in printed.splitlines()]
                for line in shown.splitlines():
                    # Whether reading is seen depends on how long it takes; what is indented continues a sentence.
                    if line.startswith(("...", "    ")) or line.endswith("reading the task"):
                        continue
                    assert any(one.startswith(stable(line)) for one in said), f"{line!r} is not in\n{printed}"
            else:
                printed = run(words, monkeypatch, capfd)
                assert re.fullmatch(pattern(shown), printed.rstrip("\n") + "\n"), f"{words}\n{shown}\n---\n{printed}"


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "sh")], ids=lambda page: page.stem)
def test_shell_commands_are_commands(page: Path, folder: Path) -> None:
    """Options and arguments are those of the program, extras those of the package, scripts those of the repository."""
    copy_examples(["hopper_one_jump"], folder, schema=b"")
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    extras = re.findall(r"^(\w+) = ", project.partition("[project.optional-dependencies]")[2].partition("\n[")[0], re.M)
    program = get_command(app)
    for block in blocks(page, "sh"):
        for line in block.text.splitlines():
            words = shlex.split(line, comments=True)
            if words[:1] == ["fesd-robot"]:
                program.commands[words[1]].make_context(words[1], words[2:])
            elif words[:2] == ["pip", "install"]:
                named = re.findall(r"\[(.*)\]", " ".join(words))
                assert set(named) <= set(extras)
            elif words:
                assert (ROOT / words[0]).is_file(), line


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "yaml")], ids=lambda page: page.stem)
def test_yaml_is_of_a_task(page: Path, folder: Path) -> None:
    """Keys at the top are those of a task, and a task with a name can be formulated."""
    copy_examples([], folder, schema=b"")
    schema = task_json_schema()
    keys, parts = (
        set(schema["properties"]),
        {key for one in schema["$defs"].values() for key in one.get("properties", {})},
    )
    for block in blocks(page, "yaml"):
        data = YAML(typ="safe", pure=True).load(block.text)
        if "vary" in data:
            (folder / "of_the_page.yaml").write_text(block.text, encoding="utf-8")
            checked_tasks(load_sweep(folder / "of_the_page.yaml"))
            continue
        # What is indented is a part of a section.
        assert set(data) <= (parts if block.text.startswith(" ") else keys), block.text
        if "name" in data:
            below = folder if data["robot"]["model"].startswith("models") else folder / "tasks"
            file = below / "of_the_page.yaml"
            file.write_text(block.text, encoding="utf-8")
            formulate(load_task(file))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_sections_in_sentences_are_valid(page: Path) -> None:
    """A section of a task that is written inside of a sentence, such as `audit: {...: 0.05}`, has keys that exist."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    for span in re.findall(r"`(\w+: \{[^`]*\})`", text):
        data = YAML(typ="safe", pure=True).load(span.replace("…", "0"))
        for key, value in data.items():
            # Which type is meant may be all that a sentence says.
            if key in Task.model_fields and key not in ("contacts", "initial", "goal") and set(value) != {"type"}:
                TypeAdapter(Task.model_fields[key].annotation).validate_python(value)


def test_the_first_task_of_the_page_is_what_new_writes(folder: Path) -> None:
    """The task of "Bring your own robot" is the hopper's, but for some of its comments."""
    from fesd_robot.first_task import propose_first_task

    copy_examples(["hopper"], folder, schema=b"")
    (shown,) = blocks(ROOT / "docs" / "your-robot.md", "yaml")
    _, written = propose_first_task("models/hopper/hopper.urdf", folder)
    assert _data(shown) == YAML(typ="safe", pure=True).load(written)


def test_the_settings_page_lists_every_key_with_its_default() -> None:
    """Tables of the page have all keys of `solver` and `method`, numbers as in the schema."""
    text = (ROOT / "docs" / "solver-settings.md").read_text(encoding="utf-8")
    parts = task_json_schema()["$defs"]
    rows = [re.split(r" *\| *", line)[1:] for line in text.splitlines() if line.startswith("| `")]
    listed = {name: row[1] for row in rows for name in re.findall(r"`(\w+)`", row[0])}
    fields = {**parts["Solver"]["properties"], **parts["Method"]["properties"]}
    assert set(listed) == set(fields)
    for name, field in fields.items():
        default = field.get("default")
        if isinstance(default, int | float | str) and listed[name].strip():
            words = f"{default:g}".replace("e-0", "e-") if isinstance(default, float) else str(default)
            words = words.lower() if isinstance(default, bool) else words
            assert words in re.findall(r"[-\w.]+", listed[name]), name


def _data(block: Block) -> Any:
    return YAML(typ="safe", pure=True).load(block.text)
