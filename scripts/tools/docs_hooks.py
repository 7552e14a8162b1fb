"""Hooks of MkDocs: the page of all keys of a task is made from the JSON schema; task files are part of the site."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

from fesd_robot.task.json_schema import task_json_schema

TASKS = Path(__file__).resolve().parents[2] / "tasks"

PAGE = "task-reference.md"

_MATRIX = re.compile(r"\[(-?[\d.]+(?: +-?[\d.]+)+)\]")
"""A row of numbers as numpy prints it."""

_TASK_FILE = re.compile(r"\]\(\.\./((?:\.\./)*)tasks/")
"""A link from a page to a task file of the repository, which is one folder nearer in the site."""

_INTRODUCTION = """# All keys of a task

Made from the schema that checks task files; `fesd-robot schema` prints it for editors. Units are SI units and radians.
A key that is not in bold has a default. What the keys are for is on the pages on
[goals, costs and constraints](goals-and-constraints.md), [robots](robots.md), [contact](contact.md) and
[solver settings](solver-settings.md).
"""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the page of all keys, and the task files, which pages of results have links to."""
    files.append(File.generated(config, PAGE, content=reference_page(task_json_schema())))
    for file in sorted(file for file in TASKS.rglob("*") if file.is_file()):
        place = file.relative_to(TASKS.parent).as_posix()
        files.append(File.generated(config, place, abs_src_path=str(file)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Point links to task files, which are those of the repository, to their copies in the site.

    Brackets of matrices are no references.
    """
    return _MATRIX.sub(r"\\[\1\\]", _TASK_FILE.sub("](\\1tasks/", markdown))


def reference_page(schema: dict[str, Any]) -> str:
    """Return the page: a section for every part of a task, with a row for every key.

    Args:
        schema: JSON schema of a task.
    """
    parts = schema["$defs"]
    lines = [_INTRODUCTION, "## Task", "", *_table(schema, parts)]
    for name in _in_order(schema, parts):
        part = parts[name]
        if "properties" in part:
            lines += ["", f"## {name}", "", part.get("description", ""), "", *_table(part, parts)]
    return "\n".join(lines) + "\n"


def _in_order(schema: dict[str, Any], parts: dict[str, Any]) -> list[str]:
    """Return the names of all parts in the order in which a reader meets them."""
    seen: dict[str, None] = {}

    def visit(part: Any) -> None:
        for name in _references(part):
            if name not in seen:
                seen[name] = None
                visit(parts[name])

    visit(schema["properties"])
    return [*seen]


def _references(part: Any) -> Iterator[str]:
    if isinstance(part, dict):
        if isinstance(part.get("$ref"), str):
            yield part["$ref"].rpartition("/")[2]
        part = [value for key, value in part.items() if key != "discriminator"]
    if isinstance(part, list):
        for each in part:
            yield from _references(each)


def _table(part: dict[str, Any], parts: dict[str, Any]) -> list[str]:
    if not part.get("properties"):
        return ["No keys."]
    required = part.get("required", [])
    rows = ["| key | value | default | what it says |", "|---|---|---|---|"]
    for key, value in part["properties"].items():
        shown = f"**`{key}`**" if key in required else f"`{key}`"
        default = "" if key in required else _default(value, parts)
        description = str(value.get("description", "")).replace("|", "\\|").replace("\n", " ")
        rows.append(f"| {shown} | {_kind(value, parts)} | {default} | {description} |")
    return rows


def _default(value: dict[str, Any], parts: dict[str, Any]) -> str:
    """Return the default of a key in code; that of a section is that of its keys."""
    if "default" not in value or value["default"] in (None, {}, []):
        return ""
    default = value["default"]
    text = {True: "true", False: "false"}.get(default, default) if isinstance(default, bool) else default
    return f"`{text}`"


def _kind(value: dict[str, Any], parts: dict[str, Any]) -> str:
    """Return what a value may be, in words, with links to the parts of a task."""
    if "$ref" in value:
        name = value["$ref"].rpartition("/")[2]
        return f"[{name}](#{name.lower()})" if "properties" in parts[name] else _kind(parts[name], parts)
    if "const" in value:
        return f"`{value['const']}`"
    if "enum" in value:
        return ", ".join(f"`{each}`" for each in value["enum"] if each is not True)
    for several in ("anyOf", "oneOf"):
        if several in value:
            kinds = [_kind(each, parts) for each in value[several] if each.get("type") != "null"]
            return " or ".join(dict.fromkeys(kinds))
    if value.get("type") == "array":
        return f"list of {_kind(value['items'], parts)}" if isinstance(value.get("items"), dict) else "list"
    if value.get("type") == "object":
        inner = value.get("additionalProperties")
        return f"name → {_kind(inner, parts)}" if isinstance(inner, dict) else "map"
    words = {"string": "text", "integer": "whole number", "number": "number", "boolean": "true or false"}
    return words.get(str(value.get("type")), "any")
