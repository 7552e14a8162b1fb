"""Labels: what a row or condition is and where it holds, in parts and in words."""

from __future__ import annotations

import pytest

from fesd_robot.complementarity import NOWHERE, Label, Place


@pytest.mark.parametrize(
    ("label", "text"),
    [
        (Label("sum of steps"), "sum of steps"),
        (Label("dynamics", "x"), "dynamics [x]"),
        (Label("dynamics", "x", place=Place(0, 1, stage=2)), "dynamics [x], interval 0, element 1, stage 2"),
        (Label("sum of steps", place=Place(interval=3)), "sum of steps, interval 3"),
        (Label("force at a distance", contact="foot"), "force at a distance [foot]"),
        (
            Label("slip", "forwards", "foot", Place(1, 2, 0, 1)),
            "slip [foot forwards], interval 1, element 2, point 0, stage 1",
        ),
        (Label("velocity", place=Place(interval=1, name="to interval 2")), "velocity, interval 1, to interval 2"),
        (Label("step functions", place=Place(name="the start")), "step functions, the start"),
    ],
)
def test_a_label_in_words(label: Label, text: str) -> None:
    """Kind, contact and subject in brackets, and the place from the outside inwards; what is not known is left out."""
    assert str(label) == text


def test_zero_is_a_number() -> None:
    """Interval, element and point 0 are known; only None is not."""
    assert str(Place(0, 0, 0)) == "interval 0, element 0, point 0"
    assert str(NOWHERE) == ""


def test_places_merge() -> None:
    """A place inside another one takes from there what it does not know, and keeps what it does."""
    inner, outer = Place(element=1, stage=2), Place(interval=4, element=9)
    assert inner.within(outer) == Place(interval=4, element=1, stage=2)
    assert inner.within(NOWHERE) == NOWHERE.within(inner) == inner


def test_names_of_places_merge() -> None:
    """Names stand behind each other from the outside inwards, each once."""
    assert Place(name="right end").within(Place(interval=0, name="the start")).name == "the start, right end"
    assert Place(name="the end").within(Place(name="the end")).name == "the end"


def test_a_label_at_a_place() -> None:
    """Its own place lies inside the other one; kind, subject and contact stay."""
    label = Label("force", "foot", "foot", Place(point=0)).at(Place(element=2)).at(Place(interval=1))
    assert label == Label("force", "foot", "foot", Place(1, 2, 0))


def test_labels_are_keys() -> None:
    """Equal labels are one key of a dictionary; another place, subject or contact makes another one."""
    label = Label("force", "foot", "foot", Place(1))
    others = [Label("force", "hand", "foot", Place(1)), Label("force", "foot", None, Place(1)), label.at(Place(2, 0))]
    assert len({label, Label("force", "foot", "foot", Place(interval=1)), *others}) == 1 + len(others)
