"""Sequences of phases as values."""

from __future__ import annotations

import numpy as np
import pytest

from fesd_robot.contact import ContactMode
from fesd_robot.phases import guessed_sequences

from .sequences import sequence, solver_of


def test_a_knot_cuts_a_phase_and_joining_undoes_it() -> None:
    """Cut phases do the same, the first ends at the knot, durations add up, and nothing else happens."""
    whole = sequence("S F !S", 0.3, 0.5, 0.2)
    cut = whole.with_knots([0.4, 0.8])
    assert cut.durations == pytest.approx([0.3, 0.1, 0.4, 0.2]) and [one.knot for one in cut.phases] == [0, 1, 1, 0]
    assert cut.without_knots.durations == pytest.approx(whole.durations) and cut.without_knots.key == whole.key
    assert [bool(one.impacts) for one in cut.phases] == [False, False, False, True]


def test_a_knot_where_a_phase_ends_cuts_nothing() -> None:
    """A switch that is at a knot to a millionth of a second is at it."""
    near = sequence("S F", 0.3 + 1e-8, 0.7 - 1e-8).with_knots([0.3])
    assert near.durations.tolist() == [0.3, 0.7] and near.phases[0].knot


@pytest.mark.parametrize(
    ("gone", "words", "durations"),
    [([0], "F !S", [0.8, 0.2]), ([1], "S", [1.0]), ([2], "S F", [0.3, 0.7]), ([0, 1], "S", [1.0])],
)
def test_a_phase_that_is_left_out_gives_its_time_to_a_neighbour(
    gone: list[int], words: str, durations: list[float]
) -> None:
    """The duration stays, equal neighbours are one phase, and nothing hits that has not flown."""
    left = sequence("S F !S", 0.3, 0.5, 0.2).without(gone).without_knots
    assert str(left) == words and left.durations == pytest.approx(durations)


def test_what_happens_is_the_key_and_knots_between_which_it_does() -> None:
    """Other durations are the same sequence, unless a switch is on the other side of a knot."""
    early, late = sequence("S F", 0.3, 0.7), sequence("S F", 0.6, 0.4)
    assert early.key == late.key and early.key_with((0.8,)) == late.key_with((0.8,))
    assert early.key_with((0.5,)) != late.key_with((0.5,))
    assert sequence("S F S", 0.3, 0.5, 0.2).key != sequence("S F !S", 0.3, 0.5, 0.2).key


def test_a_simpler_sequence_has_no_short_phases_and_sticks() -> None:
    """What a relaxed motion shows for a moment is left out; contacts that touch stick if that is asked for."""
    read = sequence("FS +S FS SS -S", 0.3, 0.01, 0.29, 0.2, 0.2)
    assert str(read.simplified(0.03, sticking=False)) == "FS SS -S"
    assert str(read.simplified(0.03, sticking=True)) == "FS SS"
    assert read.simplified(0.03, sticking=True).durations.sum() == pytest.approx(1.0)


def test_a_stretched_sequence_keeps_its_parts() -> None:
    """Durations are multiplied by one factor."""
    assert np.allclose(sequence("S F", 1.0, 3.0).lasting(2.0).durations, [0.5, 1.5])


def test_a_cycle_is_guessed_in_turn() -> None:
    """Where a cycle is asked for and the guess stands still, feet stand in turn, in either order, and fly between."""
    solver = solver_of("solo12_bound")
    guesses = [str(one) for one in guessed_sequences(solver.motion)]
    assert "SF FF FS FF" in guesses and "FS FF SF FF" in guesses
    durations = next(one for one in guessed_sequences(solver.motion) if str(one) == "SF FF FS FF").durations
    assert durations == pytest.approx([0.08, 0.02, 0.08, 0.02])


def test_a_step_is_guessed_that_hits_where_its_mirror_image_begins() -> None:
    """Of two feet that change places one stands, and the other one hits at the end as the first one leaves."""
    steps = [one for one in guessed_sequences(solver_of("biped_walk").motion) if str(one) in ("SF!", "FS!")]
    assert [str(one) for one in steps] == ["SF!", "FS!"]
    assert steps[0].at_end == ((ContactMode.FLIGHT, ContactMode.IMPACT_STICK),)
    assert steps[0].durations == pytest.approx([0.6])
    assert not any(str(one).endswith("!") for one in guessed_sequences(solver_of("solo12_bound").motion))


def test_a_slide_that_sticks_joins_its_neighbours() -> None:
    """Phases that do the same then are one; a contact that hit and slid goes on to stick within the impact."""
    assert str(sequence("SF +F SS", 0.3, 0.5, 0.2).sticking([(1, 0)])) == "SF SS"
    landed = sequence("F !+", 0.3, 0.7).sticking([(1, 0)])
    assert str(landed) == "F !S"
    assert [one[0] for one in landed.phases[1].impacts] == [ContactMode.IMPACT_FORWARDS, ContactMode.IMPACT_STICK]
