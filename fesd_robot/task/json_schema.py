"""JSON schema of a task file, with which editors complete and check it while it is written."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from fesd_robot.task.schema import Task

SCHEMA_FILE = Path(__file__).with_name("task.schema.json")
"""The committed schema; write `task_json_schema_text()` to it after a change of the task's keys."""


def task_json_schema() -> dict[str, Any]:
    """Return the JSON schema (draft 2020-12) of a task file."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **_plain(Task.model_json_schema())}


def _plain(part: Any) -> Any:
    """Even out what differs between versions of pydantic: whole numbers as integers, no rules for empty names."""
    if isinstance(part, dict):
        return {key: _plain(value) for key, value in part.items() if key != "propertyNames"}
    if isinstance(part, list):
        return [_plain(value) for value in part]
    return int(part) if isinstance(part, float) and part.is_integer() else part


def task_json_schema_text() -> str:
    """Return the JSON schema as text, ending with a newline."""
    return json.dumps(task_json_schema(), indent=2, ensure_ascii=False) + "\n"
