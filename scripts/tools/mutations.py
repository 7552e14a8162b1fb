"""Changes of data, texts, XML and bytes, and values of a JSON schema, that are nearly right."""

from __future__ import annotations

import copy
import json
import random
import string
from collections.abc import Callable
from functools import partial
from typing import Any
from xml.etree import ElementTree

ODD_TEXTS = (
    "", " ", "nonsense", "0,6", "1 m", "<<", "*x", "&x", "null", "true", "~", "é", "\u202e", "a.b", "..", "-", "0x10",
    "1e400", "x" * 300, "'", '"', "{", "[", "#", "%", "\\", "a\tb", "a\nb", "nan", "/etc/passwd", "../../..",
)  # fmt: skip


ODD_NUMBERS = (0, -1, 1, 2, 0.5, -0.5, 1e-300, 1e300, -1e9, 1e9, 10**20, 1e-9, float("nan"), float("inf"), 7, 100)


def odd_value(rng: random.Random) -> Any:
    """Return a value that is right in few places."""
    lists: tuple[list[Any], ...] = ([], [None], [[1, 2], [3]], [1, "a"], ["a", "a"])
    return rng.choice((*ODD_TEXTS, *ODD_NUMBERS, *ODD_NUMBERS, *lists, None, True, False, {}, {"a": 1}, {"": None}))


def places(tree: Any) -> list[tuple[Any, Any]]:
    """Return every container of a tree of data with a key or an index in it."""
    if isinstance(tree, dict):
        return [(tree, key) for key in tree] + [place for value in tree.values() for place in places(value)]
    if isinstance(tree, list):
        return [(tree, i) for i in range(len(tree))] + [place for value in tree for place in places(value)]
    return []


def mutate_tree(tree: Any, rng: random.Random) -> None:
    """Change one to three entries of a tree of data in place."""
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        every = places(tree)
        if not every:
            return
        owner, key = rng.choice(every)
        change = rng.randrange(7)
        if change == 0:
            del owner[key]
        elif change == 1 and isinstance(owner, dict):
            owner[f"{key}x" if rng.random() < 0.5 else rng.choice(ODD_TEXTS)] = owner.pop(key)
        elif change == 2:
            other, place = rng.choice(every)
            owner[key] = copy.deepcopy(other.get(place) if isinstance(other, dict) else [*other, None][place])
        elif change == 3 and isinstance(owner[key], int | float) and not isinstance(owner[key], bool):
            owner[key] = owner[key] * rng.choice((-1, 0, 10, 1000, 1e-3, 1e6))
        elif change == 4 and isinstance(owner[key], list):
            owner[key] = owner[key] * 2 if rng.random() < 0.5 else owner[key][:-1]
        else:
            owner[key] = odd_value(rng)


def mutate_text(text: str, rng: random.Random) -> bytes:
    """Return a text with a line or some characters changed, cut off, or with bytes that are none of a text."""
    lines, at = text.splitlines(keepends=True) or [""], rng.randrange(max(len(text), 1))
    line, change = rng.randrange(len(lines)), rng.randrange(9)
    if change == 0:
        del lines[line]
    elif change == 1:
        lines.insert(line, lines[rng.randrange(len(lines))])
    elif change == 2:
        return text[:at].encode()
    elif change == 3:
        return (
            text.encode()[:at] + bytes(rng.randrange(256) for _ in range(rng.choice((1, 3, 40)))) + text.encode()[at:]
        )
    elif change == 4:
        return (text[:at] + rng.choice(string.printable) + text[at + 1 :]).encode()
    elif change == 5:
        lines[line] = rng.choice((" ", "\t", "  ")) + lines[line]
    elif change == 6:
        return text.encode("utf-16" if rng.random() < 0.5 else "latin-1", errors="replace")
    else:
        numbers = [i for i, one in enumerate(lines) if any(letter.isdigit() for letter in one)] or [line]
        line = rng.choice(numbers)
        digit = rng.choice([i for i, letter in enumerate(lines[line]) if letter.isdigit()] or [0])
        lines[line] = lines[line][:digit] + str(rng.choice(ODD_NUMBERS)) + lines[line][digit + 1 :]
    return "".join(lines).encode()


def as_yaml(data: Any) -> bytes:
    """Return data as YAML, which JSON is, but for numbers that JSON does not have."""
    return json.dumps(data, indent=1, ensure_ascii=False).replace("NaN", ".nan").replace("Infinity", ".inf").encode()


def resolved(schema: Any, root: Any, rng: random.Random) -> Any:
    """Return one of the alternatives of a schema, without references."""
    while True:
        if "$ref" in schema:
            schema = root["$defs"][schema["$ref"].rpartition("/")[2]]
        elif alternatives := schema.get("anyOf") or schema.get("oneOf"):
            schema = rng.choice(alternatives)
        else:
            return schema


def from_schema(schema: Any, root: Any, rng: random.Random, names: list[str], depth: int = 0) -> Any:
    """Return a value that a JSON schema allows, or, one time in forty, one that it does not."""
    if rng.random() < 1 / 40 or depth > 8:
        return odd_value(rng)
    schema = resolved(schema, root, rng)
    below: Callable[[Any], Any] = partial(from_schema, root=root, rng=rng, names=names, depth=depth + 1)
    kind = schema.get("type", "number")
    kind = rng.choice(kind) if isinstance(kind, list) else kind
    if "const" in schema or "enum" in schema:
        return schema["const"] if "const" in schema else rng.choice(schema["enum"])
    if kind == "object":
        needed = schema.get("required", [])
        chosen = [key for key in schema.get("properties", {}) if key in needed or rng.random() < 0.4]
        value = {key: below(schema["properties"][key]) for key in chosen}
        if isinstance(extra := schema.get("additionalProperties"), dict):
            value |= {rng.choice(names): below(extra) for _ in range(rng.choice((1, 2)))}
        return value
    if kind == "array":
        items = schema.get("prefixItems") or [schema.get("items", {})] * rng.choice((0, 1, 2, 3))
        return [below(item) for item in items]
    numbers = (0, 1, -1, 0.5, 0.1, 3, 20, 1e-3, *ODD_NUMBERS)
    values: dict[str, Any] = {
        "string": rng.choice((*names, *names, *ODD_TEXTS)),
        "boolean": rng.random() < 0.5,
        "integer": rng.choice((0, 1, 2, 3, 5, 40, -1)),
        "null": None,
    }
    return values.get(kind, rng.choice(numbers))


def mutate_xml(text: str, rng: random.Random) -> bytes:
    """Return a robot with one to three changed elements or attributes."""
    tree = ElementTree.fromstring(text)
    for _ in range(rng.choice((1, 1, 2, 3))):
        owners = [one for one in tree.iter() if len(one)] or [tree]
        every = [*tree.iter()]
        one, change = rng.choice(every), rng.randrange(8)
        named = [each for each in every if each.attrib]
        if change == 0:
            owner = rng.choice(owners)
            owner.remove(rng.choice([*owner])) if len(owner) else None
        elif change == 1:
            rng.choice(owners).append(copy.deepcopy(one))
        elif change == 2:
            one.tag = rng.choice(("joint", "link", "body", "geom", "nonsense", "inertial", "mesh", "limit", "default"))
        elif change == 3 and named:
            one = rng.choice(named)
            del one.attrib[rng.choice([*one.attrib])]
        elif change == 4 and named:
            one = rng.choice(named)
            name = rng.choice([*one.attrib])
            one.attrib[name] = rng.choice([str(each.attrib[a]) for each in named for a in each.attrib])
        elif change == 5:
            one.attrib[rng.choice(("name", "type", "xyz", "value", "filename", "size"))] = _odd_attribute(rng)
        elif named:
            one = rng.choice(named)
            one.attrib[rng.choice([*one.attrib])] = _odd_attribute(rng)
    return ElementTree.tostring(tree)


def _odd_attribute(rng: random.Random) -> str:
    numbers = [str(number) for number in ODD_NUMBERS]
    several = [" ".join(rng.choice(numbers) for _ in range(rng.choice((2, 3, 4)))) for _ in range(6)]
    texts = [text for text in ODD_TEXTS if text.isprintable()]
    return rng.choice([*texts, *numbers, *several, "ball", "fixed", "floating", "planar", "universal", "mesh.stl"])


def mutate_bytes(content: bytes, rng: random.Random) -> bytes:
    """Return bytes of which some are others, or missing."""
    changed = bytearray(content)
    for _ in range(rng.choice((0, 1, 3))):
        changed[rng.randrange(len(changed))] = rng.randrange(256)
    return bytes(changed[: rng.choice((len(changed), len(changed), rng.randrange(len(changed))))])
