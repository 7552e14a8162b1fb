"""Stands in for Meshcat's viewer window: keeps the commands instead of sending them to a server."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Any

import numpy as np
import umsgpack

from fesd_robot.render.meshcat.tree import SceneTree, find_node, walk


def plain(value: Any) -> Any:
    """Return `value` with every numpy scalar replaced by the Python number that msgpack knows."""
    if isinstance(value, dict):
        return {key: plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    return value.item() if isinstance(value, np.generic) else value


LARGE = 2048
"""Bytes from which on a value that occurs several times is kept once: meshes and images that legs share."""


class SceneWindow:
    """Collects drawing commands in Meshcat's own scene tree, without process, socket or display."""

    def __init__(self) -> None:
        self.tree = SceneTree()
        self._values: dict[bytes, None] = {}

    def send(self, command: Any) -> None:
        """Keep one command of `meshcat/commands.py` at its place in the tree, the latest of a kind winning."""
        data = plain(command.lower())
        self._values.update(dict.fromkeys(_large_values(data)))
        node = find_node(self.tree, [name for name in data["path"].split("/") if name])
        packed = umsgpack.packb(data, force_float_precision="single")
        if data["type"] == "set_object":
            node.object = packed
        elif data["type"] == "set_transform":
            node.transform = packed
        elif data["type"] == "set_property":
            node.properties.append(packed)
        elif data["type"] == "set_animation":
            node.animation = packed
        else:
            raise NotImplementedError(f"SceneWindow cannot keep the command {data['type']!r}")

    def payload(self) -> bytes:
        """Return all commands, parents before children, as pieces, each once.

        First comes the number of pieces, and each of them after its length; then, for every command, the number of its
        pieces and which they are. All numbers are uint32, little endian.
        """
        commands: list[bytes] = []
        animations: list[bytes] = []
        for node in walk(self.tree):
            commands += [part for part in (node.object, *node.properties, node.transform) if part is not None]
            animations += [node.animation] if node.animation is not None else []
        pieces: dict[bytes, int] = {}
        numbers = []
        # An animation binds to the nodes that exist when it is loaded, so it comes last.
        for command in commands + animations:
            own = [pieces.setdefault(piece, len(pieces)) for piece in self._cut(command)]
            numbers += [len(own), *own]
        content = b"".join(struct.pack("<I", len(piece)) + piece for piece in pieces)
        return struct.pack("<I", len(pieces)) + content + struct.pack(f"<{len(numbers)}I", *numbers)

    def _cut(self, command: bytes) -> list[bytes]:
        """Return a command in pieces: its large values, and the parts between them."""
        pieces, start = [], 0
        places = sorted((at, value) for value in self._values if (at := command.find(value)) >= 0)
        for at, value in places:
            if at >= start:
                pieces += [command[start:at], value]
                start = at + len(value)
        return [piece for piece in (*pieces, command[start:]) if piece]


def _large_values(data: Any) -> Iterator[bytes]:
    """Yield the large values in a command as they will be packed."""
    if isinstance(data, dict | list):
        for entry in data.values() if isinstance(data, dict) else data:
            yield from _large_values(entry)
    elif isinstance(data, umsgpack.Ext) and len(data.data) >= LARGE:
        yield data.data
    elif isinstance(data, str) and len(data) >= LARGE:
        yield data.encode()
