"""Joints that follow another one: their limits, velocities and forces as those of their leader."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
import pinocchio as pin

from fesd_robot.errors import RobotError
from fesd_robot.exactness import ROUNDED

LimitNotes = Mapping[tuple[Literal["position", "velocity"], str], str]
"""Kind of a limit and name of its joint -> a sentence that says where it is from."""


class Follower(NamedTuple):
    """A joint whose position is ``ratio * q + offset``, with the position q of its leader."""

    name: str
    leader: str
    ratio: float
    offset: float

    def leader_range(self, limits: tuple[float, float]) -> tuple[float, float]:
        """Return between which positions of the leader the follower is within its limits."""
        ends = [(end - self.offset) / self.ratio + 0.0 for end in limits]
        return min(ends), max(ends)

    @property
    def law(self) -> str:
        """How it follows, as ``-2 hip + 1``."""
        shift = f" {'-' if self.offset < 0 else '+'} {abs(self.offset):g}" if self.offset else ""
        return f"{self.ratio:g} {self.leader}{shift}"


def common_range(own: tuple[float, float], other: tuple[float, float]) -> tuple[float, float] | None:
    """Return the values in both ranges, None without any; ends that differ by rounding are those of the first."""
    low = other[0] if other[0] > own[0] + ROUNDED else own[0]
    high = other[1] if other[1] < own[1] - ROUNDED else own[1]
    return (low, max(low, high)) if low <= high + ROUNDED else None


def with_followers(
    path: Path, separate: pin.Model, followers: Iterable[Follower], unranged: Collection[str] = ()
) -> tuple[pin.Model, LimitNotes]:
    """Return a model in which joints follow others, and have no coordinates of their own.

    The position and velocity limits of leaders are those that keep their followers within theirs, too:

        lower <= ratio q + offset <= upper,   |ratio v| <= limit of the follower

    Args:
        path: of the file, for messages.
        separate: the model in which every joint has coordinates; stays as it is.
        followers: the joints and their leaders.
        unranged: names of joints that the file gives no range; such a follower narrows nothing.

    Returns:
        the model, and the limits that were narrowed.

    Raises:
        RobotError: limits that leader and follower cannot keep at once; names both.
    """
    model, some = separate, list(followers)
    for one in some:
        ids = separate.getJointId(one.leader), separate.getJointId(one.name)
        model = pin.transformJointIntoMimic(model, *ids, one.ratio, one.offset)
    moving = [one for one in some if one.ratio]  # one that stands still is refused with its name
    return model, _narrow_leaders(path, model, separate, moving, unranged)


def _narrow_leaders(
    path: Path, model: pin.Model, separate: pin.Model, followers: Iterable[Follower], unranged: Collection[str]
) -> LimitNotes:
    notes: dict[tuple[Literal["position", "velocity"], str], str] = {}
    for one in followers:
        follower, led = separate.joints[separate.getJointId(one.name)], model.joints[model.getJointId(one.leader)]
        q = follower.idx_q
        own = float(model.lowerPositionLimit[led.idx_q]), float(model.upperPositionLimit[led.idx_q])
        limits = float(separate.lowerPositionLimit[q]), float(separate.upperPositionLimit[q])
        if one.name in unranged:
            notes["position", one.leader] = (
                f"The file gives '{one.name}' no range; '{one.leader}', which it follows, keeps its own."
            )
        else:
            kept = common_range(own, one.leader_range(limits))
            if kept is None:
                raise RobotError(
                    f"{path}: found joint '{one.name}' with limits {_interval(limits)}, which follows '{one.leader}' "
                    f"as {one.law}, and '{one.leader}' with limits {_interval(own)}, where it is in "
                    f"{_interval(_image(one, own))}, expected limits that both can keep."
                )
            if kept != own:
                set_entries(model, "lowerPositionLimit", led.idx_q, [kept[0]])
                set_entries(model, "upperPositionLimit", led.idx_q, [kept[1]])
                notes["position", one.leader] = (
                    f"The limits of '{one.leader}' are {_interval(kept)}: '{one.name}', which follows as {one.law}, "
                    f"has {_interval(limits)}."
                )
        slowest = float(separate.upperVelocityLimit[follower.idx_v]) / abs(one.ratio)
        if slowest < float(model.upperVelocityLimit[led.idx_v]) - ROUNDED:
            set_entries(model, "upperVelocityLimit", led.idx_v, [slowest])
            notes["velocity", one.leader] = (
                f"The velocity limit of '{one.leader}' is {slowest:g}: '{one.name}', which follows as {one.law}, "
                f"has {float(separate.upperVelocityLimit[follower.idx_v]):g}."
            )
    return notes


def _image(follower: Follower, limits: tuple[float, float]) -> tuple[float, float]:
    ends = [follower.ratio * end + follower.offset + 0.0 for end in limits]
    return min(ends), max(ends)


def _interval(limits: tuple[float, float]) -> str:
    return f"[{limits[0]:g}, {limits[1]:g}]"


def set_entries(model: pin.Model, name: str, start: int, values: np.ndarray | list[float]) -> None:
    """Set the entries of an array of a model from `start` on."""
    whole = np.array(getattr(model, name))
    whole[start : start + len(values)] = values
    setattr(model, name, whole)
