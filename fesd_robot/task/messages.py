"""Sentences for what pydantic finds wrong with a task."""

from __future__ import annotations

import types
from collections.abc import Iterable, Sequence
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel, Tag, ValidationError
from pydantic_core import ErrorDetails

from fesd_robot.errors import TaskError, nearest, number_hint
from fesd_robot.task.origins import KeyPath, Origins
from fesd_robot.task.renamed_keys import RENAMED_KEYS, old_names
from fesd_robot.task.schema import Task

_EXPECTED = {
    "float_type": "a number",
    "finite_number": "a finite number",
    "int_type": "a whole number",
    "bool_type": "true or false",
    "string_type": "text",
    "string_too_short": "a name of at least one character",
    "string_pattern_mismatch": "letters, digits, '_', '-' and '.', beginning with a letter or digit",
    "list_type": "a list",
    "dict_type": "a mapping of names to values",
    "model_type": "a mapping of keys to values",
    "model_attributes_type": "a mapping of keys to values",
    "too_short": "at least one entry",
    "greater_than": "a number greater than {gt:g}",
    "greater_than_equal": "a number of at least {ge:g}",
    "less_than": "a number less than {lt:g}",
    "less_than_equal": "a number of at most {le:g}",
    "literal_error": "{expected}",
    "expected": "{what}",
}


def validation_error(error: ValidationError, origins: Origins, model: type[BaseModel] = Task) -> TaskError:
    """Return the first error by line as one sentence that says what was found and what was expected.

    Args:
        error: of the model.
        origins: where the keys came from.
        model: what was validated.
    """
    details = error.errors(include_url=False)
    misspelled = [_follow(detail["loc"], model)[0] for detail in details if detail["type"] == "extra_forbidden"]
    told = (_problem(detail, model) for detail in details if not _is_echo(detail, misspelled, model))
    first = origins.first_error(_joined(told))
    assert first is not None, "a ValidationError holds at least one error"
    return first


def _joined(problems: Iterable[tuple[KeyPath, str]]) -> list[tuple[KeyPath, str]]:
    """Return problems with one for all alternatives of a key, each of which says what it expected."""
    joined: dict[tuple[KeyPath, str], str] = {}
    for path, sentence in problems:
        found, expected, what = sentence.partition(", expected ")
        key = path, found
        joined[key] = f"{joined[key]} or {what}" if key in joined and what else f"{found}{expected}{what}"
    return [(path, sentence) for (path, _), sentence in joined.items()]


def _is_echo(detail: ErrorDetails, misspelled: Sequence[KeyPath], model: type[BaseModel]) -> bool:
    """Return whether a key is only missing because it is misspelled beside, which is one mistake, not two."""
    if detail["type"] != "missing":
        return False
    path, _, _ = _follow(detail["loc"], model)
    return any(unknown[:-1] == path[:-1] and _close(unknown[-1], path[-1:]) for unknown in misspelled)


def _problem(detail: ErrorDetails, model: type[BaseModel]) -> tuple[KeyPath, str]:
    kind, context = detail["type"], detail.get("ctx", {})
    path, owner, place = _follow(detail["loc"], model)
    if kind == "conflict":
        return (*path, *context["at"]), context["sentence"]
    if kind == "extra_forbidden":
        keys = list(owner.model_fields) if owner is not None else []
        if path[0] == "contacts" and path[-1] in _NOT_THERE:
            return path, f"found {_NOT_THERE[path[-1]]}"
        return path, f"found an unknown key, expected a known one{_nearest_key(path, keys)}"
    if kind == "missing":
        field = owner.model_fields[path[-1]] if owner is not None else None
        purpose = (field.description or "").rstrip(".") if field is not None else ""
        return path, f"this key is missing ({purpose[:1].lower()}{purpose[1:]})"
    if kind == "union_tag_not_found":
        return (*path, "type"), f"this key is missing, expected {_quoted(_tags(place))}"
    if kind == "union_tag_invalid":
        return (*path, "type"), (
            f"found the text '{context['tag']}', expected {_quoted(_tags(place))}{_close(context['tag'], _tags(place))}"
        )
    value = _describe(detail["input"])
    if kind not in _EXPECTED:
        return path, f"found {value}, but {detail['msg'][:1].lower()}{detail['msg'][1:]}"
    hint = _close(detail["input"], get_args(place)) if kind == "literal_error" else _number_hint(kind, detail["input"])
    return path, f"found {value}, expected {_EXPECTED[kind].format(**context)}{hint}"


_NOT_THERE = {
    "rolling_friction": "rolling friction, expected no such key: a joint that turns may have dry_friction instead",
    "torsional_friction": "friction about the normal of a contact, expected no such key: a body on a table may have a "
    "limit_surface instead",
}
"""Keys of contacts that other programs have and this one has not."""


def _nearest_key(path: KeyPath, keys: Sequence[str]) -> str:
    """Return a hint to the closest key of a section; one that is close to an old name, to the name it has today."""
    for old, name in RENAMED_KEYS.items():
        if path[-1] == old[-1]:
            return f" (did you mean '{'.'.join((*old[:-1], name))}'?)"
    renamed = dict(old_names(path[:-1]))
    hint = nearest(path[-1], [*keys, *renamed])
    if not hint.startswith(" (did"):
        return nearest(path[-1], keys)
    return next((f" (did you mean '{new}'?)" for old, new in renamed.items() if f"'{old}'" in hint), hint)


def _follow(location: Sequence[str | int], model: type[BaseModel]) -> tuple[KeyPath, type[BaseModel] | None, Any]:
    """Follow a pydantic location through the schema, leaving out the union tags it contains.

    Returns:
        the key path, the model that holds its last key, and the type annotation at its end.
    """
    path: list[str] = []
    owner: type[BaseModel] | None = None
    place: Any = model
    for part in location:
        place = _bare(place)
        if part == "[key]":
            break
        if _is_union(place):
            place = next((member for member in get_args(place) if part in _union_tags(member)), None)
            continue
        path.append(str(part))
        if isinstance(place, type) and issubclass(place, BaseModel):
            owner = place
            field = owner.model_fields.get(str(part))
            place = None if field is None else field.annotation
        elif get_origin(place) in (dict, list):
            place = get_args(place)[-1]
        else:
            place = None
    return tuple(path), owner, _bare(place)


def _bare(annotation: Any) -> Any:
    """Strip ``Annotated`` and ``| None`` off a type annotation."""
    while True:
        if get_origin(annotation) is Annotated:
            annotation = get_args(annotation)[0]
            continue
        members = [member for member in get_args(annotation) if member is not type(None)]
        if not (_is_union(annotation) and len(members) == 1):
            return annotation
        annotation = members[0]


def _is_union(annotation: Any) -> bool:
    return get_origin(annotation) in (Union, types.UnionType)


def _union_tags(member: Any) -> tuple[str, ...]:
    """Return how pydantic calls a member of a union: its `Tag`, the values of its key `type`, or its own name."""
    tags = tuple(mark.tag for mark in getattr(member, "__metadata__", ()) if isinstance(mark, Tag))
    bare = _bare(member)
    if tags or not (isinstance(bare, type) and issubclass(bare, BaseModel)):
        return tags or (getattr(bare, "__name__", str(bare)),)
    return get_args(bare.model_fields["type"].annotation) if "type" in bare.model_fields else (bare.__name__,)


def _tags(union: Any) -> list[str]:
    return [tag for member in get_args(union) for tag in _union_tags(member)]


def _quoted(tags: Sequence[str]) -> str:
    return " or ".join(f"'{tag}'" for tag in tags)


def _close(value: Any, valid: Sequence[Any]) -> str:
    """Return `` (did you mean 'x'?)`` if something valid is close, else nothing."""
    hint = nearest(value, [name for name in valid if isinstance(name, str)]) if isinstance(value, str) else ""
    return hint if hint.startswith(" (did") else ""


def _number_hint(kind: str, value: Any) -> str:
    """Return how to write a number that is there as text with a unit, a decimal comma or quotes."""
    hint = number_hint(value) if kind in ("float_type", "int_type") and isinstance(value, str) else ""
    return f"{hint} without quotes" if hint.startswith(", written") else hint


def _describe(value: Any) -> str:
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f"the text '{_short(value)}'"
    if isinstance(value, list | tuple):
        return f"the list {_short(str(list(value)))}" if value else "an empty list"
    if isinstance(value, dict):
        return f"a mapping with {', '.join(map(str, list(value)[:5]))}" if value else "an empty mapping"
    return "NaN" if value != value else _short(str(value))


def _short(text: str) -> str:
    return text if len(text) <= 60 else f"{text[:57]}..."
