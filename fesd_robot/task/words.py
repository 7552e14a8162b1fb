"""Numbers of a task in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence


def listed(values: Mapping[str, float]) -> str:
    """Return ``a 1, b 2``; of a value without a name the number alone."""
    return ", ".join(f"{name} {value:g}".strip() for name, value in values.items())


def enumerated(names: Sequence[str]) -> str:
    """Return ``a, b and c``."""
    return " and ".join([*([", ".join(names[:-1])] if names[1:] else []), *names[-1:]])


def along_axes(values: Sequence[float | None]) -> str:
    """Return ``x 1, z 2`` of a point or an extent that does not matter along y."""
    return listed({axis: value for axis, value in zip("xyz", values, strict=True) if value is not None})
