"""Neighbours of a branch with impacts: where these go, to which side they slip, and what others do meanwhile."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.fesd.neighbours import Move, moves
from fesd_robot.fesd.neighbours.contact_conditions import ContactConditions
from fesd_robot.fesd.neighbours.patterns import Pattern
from fesd_robot.fesd.neighbours.shifts import ImpactSide, Shift, ShiftKind
from fesd_robot.fesd.polishing import BranchMotion, BranchTranscription

from .branches import branch_of, flight_and_stick, in_impact, patterns, polisher, with_modes

KINDS = (ShiftKind.WITH_IMPACT, ShiftKind.WITH_LATER_IMPACT)
"""What a touchdown on a boundary may become without moving: hit before the others switch there, or after that."""


@pytest.fixture(scope="module")
def hopper() -> BranchTranscription:
    """A hopper over six intervals with four elements each."""
    return polisher("hopper_one_jump", "horizon.intervals=6", "method.elements=4")


@pytest.fixture(scope="module")
def feet() -> BranchTranscription:
    """A quadruped in the plane, with four elements in an interval."""
    return polisher("solo12_jump", "method.elements=4")


def neighbours(
    transcription: BranchTranscription, branch: Branch, contact: ContactConditions
) -> dict[str, list[Pattern]]:
    """The moves, in words, and what a contact does after them."""
    start = transcription.transcription.problem.start
    found = moves(BranchMotion(transcription, start, branch))
    return {move.what: patterns(transcription, contact, move.branch) for move in found}


def test_a_bounce_moves_to_a_neighbouring_interval() -> None:
    """An impact between two flights goes into the interval before or after, between flights as before."""
    bat = polisher("ball_bat", "horizon.intervals=4", "method.elements=3")
    flying, (hit,) = branch_of(bat, {0, 1, 2, 3})
    flight, impact = hit.flight, in_impact(hit)
    branch = with_modes(bat, flying, hit, {1: [flight, impact, flight]})
    assert patterns(bat, hit, branch) == [(flight,), (flight, impact, flight), (flight,), (flight,)]
    found = {what: after for what, after in neighbours(bat, branch, hit).items() if "bounce" in what}
    assert found == {
        "bounce of contact 'hit' in interval 1 an interval earlier": [(flight, impact, flight), *[(flight,)] * 3],
        "bounce of contact 'hit' in interval 1 an interval later": [
            *[(flight,)] * 2,
            (flight, impact, flight),
            (flight,),
        ],
    }
    first = with_modes(bat, flying, hit, {0: [flight, impact, flight]})
    later = neighbours(bat, first, hit)["bounce of contact 'hit' in interval 0 an interval later"]
    assert later == [(flight,), (flight, impact, flight), (flight,), (flight,)]


def test_a_bounce_moves_with_both_ends_of_the_slide_that_it_begins() -> None:
    """A puck that is hit in an interval slides from there into another; the blow and both ends of the slide move an
    interval later, or earlier, together, the blow and the beginning of the slide, too, and the blow alone."""
    puck = polisher("puck_shot", "horizon.intervals=6", "method.elements=3")
    resting, (sole, push) = branch_of(puck, set(), set(range(6)))
    flight, stick = flight_and_stick(push)[0], flight_and_stick(sole)[1]
    slip = tuple(ActiveFactor.H if n == sole.parts[1] else factor for n, factor in enumerate(stick))
    sliding = with_modes(puck, resting, sole, {1: [stick, stick, slip], 2: [slip] * 3, 3: [slip, stick, stick]})
    branch = with_modes(puck, sliding, push, {1: [flight, flight, in_impact(push)]})
    begin = "bounce of contact 'push' and stick or slip of contact 'sole' in interval 1 an interval"
    blow, slide = (neighbours(puck, branch, contact) for contact in (push, sole))
    for where, k in (("earlier", 0), ("later", 2)):
        both = f"{begin} {where}, and the end of the slide"
        assert blow[both] == [(flight, in_impact(push)) if at == k else (flight,) for at in range(6)]
        between = [(stick,)] * k, [(stick, slip), (slip,), (slip, stick)], [(stick,)] * (3 - k)
        assert slide[both] == [one for part in between for one in part]
        after = slide[f"{begin} {where}"]
        assert after[k] == (stick, slip) and after[3] == (slip, stick)
        assert slide[f"bounce of contact 'push' in interval 1 an interval {where}"][1] == (stick, slip)


def test_a_foot_is_hit_before_the_other_takes_off_or_after_it() -> None:
    """Where one foot comes down softly as the other takes off, it is hit while that stands, or while that flies, by an
    impact that slips to either side: it moves to none before. A foot that moves along the ground slips as it moves."""
    feet = polisher("solo12_jump", "method.elements=4")
    soft, (front, hind) = branch_of(feet, {1, 2}, {3, 4})
    transcription, moving = feet.transcription, feet.transcription.problem.start
    held = np.array([not name.endswith("velocity") for name in transcription.ocp.system.state_names], dtype=float)
    resting = transcription.pack([replace(one, x=one.x * held) for one in transcription.unpack(moving)])
    flight, stick = flight_and_stick(front)

    def hits(branch: Branch, w: np.ndarray) -> dict[str, Move]:
        first = "touchdown of contact 'front' in interval 2 "
        found = {one.what: one for one in moves(BranchMotion(feet, w, branch)) if "with impact" in one.what}
        return {what.removeprefix(first): one for what, one in found.items() if what.startswith(first)}

    found = hits(soft, resting)
    before_it, after_it = ([str(Shift(kind, side=side)) for side in ImpactSide] for kind in KINDS)
    assert sorted(found) == sorted([*before_it, *after_it])
    sides = [in_impact(front, side) for side in (1, 0)]
    for side, names in zip(sides, zip(before_it, after_it, strict=True), strict=True):
        before, after = (found[name] for name in names)
        (begin, *ending), last = patterns(feet, front, before.branch)[2:4]
        assert (begin, last) == (flight, (stick,)) and ending[0] == side and all(map(front.is_impact, ending))
        assert patterns(feet, front, after.branch)[2:4] == [(flight,), (*ending, stick)]
        assert patterns(feet, hind, before.branch)[2:4] == patterns(feet, hind, soft)[2:4]
    impact = {e for e, one in enumerate(found[before_it[0]].branch.factors) if ActiveFactor.COMPLEMENT in one}
    assert all(hind.of_factors(found[before_it[0]].branch.factors[e]) != flight for e in impact)
    later = hits(found[before_it[0]].branch, resting)
    assert list(later) == [after_it[0]]
    assert sorted(hits(soft, moving)) == sorted([before_it[0], after_it[0]])


def test_only_the_impact_of_a_contact_is_left(hopper: BranchTranscription) -> None:
    """A stance of two intervals between flights becomes a bounce where it began; one that begins softly does not."""
    soft, (foot,) = branch_of(hopper, {0, 1, 4, 5})
    flight, stick = flight_and_stick(foot)
    impact = in_impact(foot, 0)
    hard = with_modes(hopper, soft, foot, {2: [impact, stick, stick, stick]})
    after = neighbours(hopper, hard, foot)["only a bounce of contact 'foot' in intervals 2 to 3"]
    assert after == [*[(flight,)] * 2, (impact, flight), *[(flight,)] * 3]
    assert not any("bounce" in what for what in neighbours(hopper, soft, foot))


def test_an_impact_slips_to_the_other_side(hopper: BranchTranscription) -> None:
    """Where a foot slips in an impact, it slips the other way there, or also as long as it slips after it; one that
    sticks has no other side, and a slip long after a bounce does not turn with the bounce."""
    soft, (foot,) = branch_of(hopper, {0, 1, 4, 5})
    flight, stick = flight_and_stick(foot)
    sides = [in_impact(foot, side) for side in (0, 1)]
    slips = [tuple(factor if n in foot.parts else stick[n] for n, factor in enumerate(one)) for one in sides]
    branch = with_modes(hopper, soft, foot, {2: [sides[0], *[slips[0]] * 3], 3: [slips[0]] * 4})
    found = neighbours(hopper, branch, foot)
    what = "impact of contact 'foot' in interval 2 slipping the other way"
    assert found[what][1:5] == [(flight,), (sides[1], slips[0]), (slips[0],), (flight,)]
    assert found[f"{what}, and after it"][1:5] == [(flight,), (sides[1], slips[1]), (slips[1],), (flight,)]
    sticking = with_modes(hopper, soft, foot, {2: [in_impact(foot), stick, stick, stick]})
    assert not any("other way" in one for one in neighbours(hopper, sticking, foot))
    landing = with_modes(hopper, soft, foot, {2: [sides[1], stick, stick, stick]})
    assert [one for one in neighbours(hopper, landing, foot) if "other way" in one] == [what]
    slip = [slips[0]] * 4
    bounce = with_modes(hopper, soft, foot, {0: [flight, sides[0], flight, flight], 2: slip, 3: slip})
    turned = [one for one in neighbours(hopper, bounce, foot) if "other way" in one]
    assert turned == ["impact of contact 'foot' in interval 0 slipping the other way"]


def test_what_begins_and_ends_in_an_interval_moves(hopper: BranchTranscription) -> None:
    """A short contact, with its impact, goes into the interval before or after, and so does a short flight."""
    flying, (foot,) = branch_of(hopper, set(range(6)))
    flight, stick = flight_and_stick(foot)
    touch = [in_impact(foot, 0), stick, flight, flight]
    found = neighbours(hopper, with_modes(hopper, flying, foot, {2: touch}), foot)
    for where, k in (("earlier", 1), ("later", 3)):
        after = found[f"contact of contact 'foot' in interval 2 an interval {where}"]
        assert after == [(touch[0], stick, flight) if k == at else (flight,) for at in range(6)]
    alone = with_modes(hopper, flying, foot, {2: [in_impact(foot, 0)] * 4})
    assert not any("contact of" in what for what in neighbours(hopper, alone, foot)), "nothing but an impact"
    standing, _ = branch_of(hopper, set())
    hopping = with_modes(hopper, standing, foot, {2: [stick, flight, stick, stick]})
    after = neighbours(hopper, hopping, foot)["flight of contact 'foot' in interval 2 an interval later"]
    assert after == [(stick, flight, stick) if at == 3 else (stick,) for at in range(6)]


def test_a_foot_takes_off_as_another_is_hit(feet: BranchTranscription) -> None:
    """A foot has no force any more while the clock stands still for the other one's impact, which begins an interval;
    it has none after both have moved, to the end of the interval or into it."""
    soft, (front, hind) = branch_of(feet, set(range(4, 20)), {0, 1, 2, 3})
    flight, stick = flight_and_stick(front)
    impact = in_impact(hind, 0)
    branch = with_modes(feet, soft, hind, {4: [impact, stick, stick, stick]})
    what = "take-off of contact 'front' and touchdown of contact 'hind' in interval 3"
    assert neighbours(feet, branch, front)[f"{what} an interval later at once"][3:6] == [
        (stick,),
        (stick, flight),
        (flight,),
    ]
    assert neighbours(feet, branch, hind)[f"{what} an interval later at once"][3:6] == [
        (flight,),
        (flight, impact),
        (stick,),
    ]
    start = feet.transcription.problem.start
    for where, name in (("an interval later at once", "later"), ("into interval 4", "into")):
        found = [move.branch for move in moves(BranchMotion(feet, start, branch)) if move.what == f"{what} {where}"]
        assert found, name
        hit = [one for one in found[0].factors if hind.is_impact(hind.of_factors(one))]
        assert hit and all(front.is_flight(front.of_factors(one)) for one in hit), name
