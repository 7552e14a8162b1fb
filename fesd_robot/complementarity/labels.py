"""Structured names of rows and complementarity conditions: what they are and where they hold."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import overload


@dataclass(frozen=True)
class Place:
    """Where a row of a problem holds, as precisely as is known.

    Attributes:
        interval: control interval, from 0.
        element: finite element of the interval, from 0.
        point: point of the element, 0 is the left boundary, j stage j.
        stage: stage of the element, from 1; with a point, the one it is paired with.
        name: a place that has no numbers, such as ``the start``, or words for one that has.
    """

    interval: int | None = None
    element: int | None = None
    point: int | None = None
    stage: int | None = None
    name: str = ""

    def within(self, outer: Place) -> Place:
        """Return this place inside another one, which gives the parts that are not known here.

        Args:
            outer: the place around this one, such as the interval of an element.
        """
        return Place(
            interval=outer.interval if self.interval is None else self.interval,
            element=outer.element if self.element is None else self.element,
            point=outer.point if self.point is None else self.point,
            stage=outer.stage if self.stage is None else self.stage,
            name=", ".join(dict.fromkeys(name for name in (outer.name, self.name) if name)),
        )

    def __str__(self) -> str:
        numbers = (("interval", self.interval), ("element", self.element), ("point", self.point), ("stage", self.stage))
        known = [f"{what} {number}" for what, number in numbers if number is not None]
        return ", ".join([*known, *([self.name] if self.name else [])])


NOWHERE = Place()
"""No place in particular."""


@dataclass(frozen=True)
class Label:
    """The name of a row or a complementarity condition, in parts that a program can read.

    Attributes:
        kind: what it is, such as ``dynamics`` or ``force at a distance``.
        subject: the state, step function, region or direction that it is about.
        contact: name of the contact that it belongs to, if it belongs to one.
        place: where it holds.
        joint: name of the velocity coordinate whose dry friction it belongs to, if it belongs to one.
    """

    kind: str
    subject: str = ""
    contact: str | None = None
    place: Place = NOWHERE
    joint: str | None = None

    def at(self, place: Place) -> Label:
        """Return the label at a place inside which its own place lies."""
        return replace(self, place=self.place.within(place))

    def __str__(self) -> str:
        about = " ".join(part for part in (self.contact, self.joint, self.subject) if part)
        name = f"{self.kind} [{about}]" if about else self.kind
        where = str(self.place)
        return f"{name}, {where}" if where else name


class LateLabels(Sequence[Label]):
    """Labels that are made when the first of them is asked for: thousands of variables are named for a message.

    Args:
        count: how many there are.
        make: makes all of them.
    """

    def __init__(self, count: int, make: Callable[[], Sequence[Label]]) -> None:
        self._count, self._make = count, make

    @cached_property
    def _labels(self) -> Sequence[Label]:
        return self._make()

    def __len__(self) -> int:
        """Return the number of labels."""
        return self._count

    @overload
    def __getitem__(self, i: int) -> Label: ...

    @overload
    def __getitem__(self, i: slice) -> Sequence[Label]: ...

    def __getitem__(self, i: int | slice) -> Label | Sequence[Label]:
        """Return one of them, or some."""
        return self._labels[i]
