"""What a change of a contact's mode is called."""

from __future__ import annotations

from fesd_robot.recovery import Kind
from fesd_robot.replay.mode import Mode


def kinds_of_change(old: Mode, new: Mode, hit: bool) -> list[Kind]:
    """Return the names of a change of mode, none if it stays the same.

    Args:
        old, new: before and after.
        hit: whether the contact has met the ground; one that flies on has touched down and taken off.
    """
    if old is Mode.FLIGHT:
        parts: list[Kind] = ["touchdown"] if hit or new is not Mode.FLIGHT else []
        return [*parts, "takeoff"] if parts and new is Mode.FLIGHT else parts
    if new is Mode.FLIGHT:
        return ["takeoff"]
    if old is new:
        return []
    if old is Mode.STICK:
        return ["stick_to_slip"]
    return ["slip_to_stick" if new is Mode.STICK else "slip_reversal"]
