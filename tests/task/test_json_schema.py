"""The schema that editors use says the same as the code."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from fesd_robot.task import task_json_schema, task_json_schema_text
from fesd_robot.task.json_schema import SCHEMA_FILE


def test_the_committed_schema_is_in_step() -> None:
    """`task.schema.json` is what the code would write; if not, write `task_json_schema_text()` to it."""
    assert json.loads(SCHEMA_FILE.read_text(encoding="utf-8")) == task_json_schema()
    assert SCHEMA_FILE.read_text(encoding="utf-8") == task_json_schema_text()


def test_every_key_is_described_and_none_is_open() -> None:
    """Each key of each part has a description, and parts refuse unknown keys."""
    schema = task_json_schema()
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    for part in _parts(schema):
        assert part["additionalProperties"] is False
        for key, value in part["properties"].items():
            assert value.get("description"), f"{part['title']}.{key}"


def test_the_design_keys_are_the_top_level() -> None:
    """The top level has exactly the documented keys."""
    keys = (
        "name, robot, bodies, ground, surfaces, gravity, contacts, horizon, postures, initial, goal, waypoints, "
        "reference, costs, limits, reserve, constraints, method, solver, audit, output"
    )
    assert ", ".join(task_json_schema()["properties"]) == keys


def _parts(schema: dict[str, Any]) -> Iterator[dict[str, Any]]:
    yield schema
    yield from schema["$defs"].values()
