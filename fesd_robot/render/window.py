"""Stands in for Meshcat's viewer window: keeps the commands instead of sending them to a server."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
import umsgpack
from meshcat.servers.tree import SceneTree, find_node, walk


def plain(value: Any) -> Any:
    """Return `value` with every numpy scalar replaced by the Python number that msgpack knows."""
    if isinstance(value, dict):
        return {key: plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    return value.item() if isinstance(value, np.generic) else value


class SceneWindow:
    """Collects drawing commands in Meshcat's own scene tree, without process, socket or display."""

    def __init__(self) -> None:
        self.tree = SceneTree()

    def send(self, command: Any) -> None:
        """Keep one command of `meshcat.commands` at its place in the tree, the latest of a kind winning."""
        data = plain(command.lower())
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
        """Return all commands, parents before children, each after its length (uint32, little endian)."""
        commands: list[bytes] = []
        animations: list[bytes] = []
        for node in walk(self.tree):
            commands += [part for part in (node.object, *node.properties, node.transform) if part is not None]
            animations += [node.animation] if node.animation is not None else []
        # An animation binds to the nodes that exist when it is loaded, so it comes last.
        return b"".join(struct.pack("<I", len(command)) + command for command in commands + animations)
