"""Neighbours of a branch: what a contact may do instead, and where the search for its motion starts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.fesd import FesdOptions, Transcription, initial_value_problem, make_tableau
from fesd_robot.fesd.neighbours import Pivots, filled, moves, with_room, without_room
from fesd_robot.fesd.neighbours.contact_conditions import ContactConditions
from fesd_robot.fesd.neighbours.patterns import intervals_of
from fesd_robot.fesd.polishing import BranchMotion, BranchTranscription, problem_around
from fesd_robot.mpcc import HomotopyOptions, Run, continue_on_branch, solve

from .branches import branch_of, flight_and_stick, patterns, polisher
from .systems import scalar

OPTIONS = HomotopyOptions(tolerance=1e-6)


@pytest.fixture(scope="module")
def hopper() -> BranchTranscription:
    """A hopper that may not slip, over six intervals with four elements each."""
    return polisher("hopper_one_jump", "horizon.intervals=6", "method.elements=4")


def test_every_move_changes_its_intervals_only(hopper: BranchTranscription) -> None:
    """A neighbour has the factors of the branch outside its intervals, other ones inside, and no branch comes twice."""
    transcription = hopper.transcription
    w = transcription.problem.start
    branch, _ = branch_of(hopper, {2, 3})
    found = list(moves(BranchMotion(hopper, w, branch)))
    assert found and len({(move.branch.factors, move.branch.without_length) for move in found}) == len(found)
    for move in found:
        changed = {
            k
            for k, own in enumerate(intervals_of(transcription.elements))
            if any(move.branch.factors[e] != branch.factors[e] for e in own)
        }
        assert changed and changed <= set(move.intervals), move.what
        assert move.w.shape == w.shape and np.isfinite(move.w).all()
        steps = [element.step for element in transcription.unpack(move.w)]
        assert sum(steps) == pytest.approx(transcription.ocp.duration, rel=1e-9), "an interval keeps its length"


def test_a_touchdown_inside_an_interval_has_an_impact(hopper: BranchTranscription) -> None:
    """On a boundary it lands softly; inside it slips while the clock stands still, then sticks so, then sticks."""
    w = hopper.transcription.problem.start
    branch, (foot,) = branch_of(hopper, {2, 3})
    flight, stick = flight_and_stick(foot)
    after = {move.what: patterns(hopper, foot, move.branch) for move in moves(BranchMotion(hopper, w, branch))}
    earlier = after["touchdown of contact 'foot' in interval 3 an interval earlier"]
    assert earlier == [(stick,), (stick,), (flight,), (stick,), (stick,), (stick,)]
    inside = after["touchdown of contact 'foot' in interval 3 into interval 4"]
    assert inside[:4] == [(stick,), (stick,), (flight,), (flight,)] and inside[5] == (stick,)
    first, slipping, sticking, last = inside[4]
    assert (first, last) == (flight, stick)
    assert foot.is_impact(slipping) and foot.is_impact(sticking) and slipping != sticking
    whole = after["take-off and touchdown of contact 'foot' in intervals 1 and 3 an interval later"]
    assert whole == [(stick,), (stick,), (stick,), (flight,), (flight,), (stick,)]
    none = after["no flight of contact 'foot' in intervals 2 to 3"]
    assert none == [(stick,)] * 6


def test_a_flight_gets_longer_or_shorter_as_it_moves(hopper: BranchTranscription) -> None:
    """Both of its ends move, one of them by an interval more, and nothing else changes; not beyond the motion."""
    after: dict[str, list[str]] = {}
    for flying in ({2, 3, 4}, {1, 2, 3}):
        branch, (foot,) = branch_of(hopper, flying)
        flight, stick = flight_and_stick(foot)
        for move in moves(BranchMotion(hopper, hopper.transcription.problem.start, branch)):
            if "two intervals" in move.what:
                found = patterns(hopper, foot, move.branch)
                assert set(found) == {(flight,), (stick,)} and move.what not in after
                after[move.what] = ["-^"[own == (flight,)] for own in found]
    take_off, touchdown = "take-off of contact 'foot' in interval", "and touchdown in interval"
    assert {what: "".join(own) for what, own in after.items()} == {
        f"{take_off} 1 an interval earlier {touchdown} 4 two intervals earlier": "-^^---",
        f"{take_off} 1 two intervals earlier {touchdown} 4 an interval earlier": "^^^^--",
        f"{take_off} 1 two intervals later {touchdown} 4 an interval later": "----^^",
        f"{take_off} 0 an interval earlier {touchdown} 3 two intervals earlier": "^^----",
        f"{take_off} 0 an interval later {touchdown} 3 two intervals later": "--^^^^",
        f"{take_off} 0 two intervals later {touchdown} 3 an interval later": "---^^-",
    }


def test_a_touchdown_beside_another_gets_an_impact_or_loses_it(hopper: BranchTranscription) -> None:
    """The impact ends the interval of the flight, the contact begins with the next, the way back is a move, too, and an
    exchange gives the impact to the other foot; a foot that lands alone gets its impact inside an interval."""
    feet = polisher("solo12_jump", "method.elements=4")
    w = feet.transcription.problem.start
    soft, (front, hind) = branch_of(feet, {2, 3}, {2, 3})
    flight, stick = flight_and_stick(front)

    def neighbour(branch: Branch, what: str) -> Branch:
        return next(move.branch for move in moves(BranchMotion(feet, w, branch)) if move.what == what)

    hard = neighbour(soft, "touchdown of contact 'front' in interval 3 with impact")
    before, *impact = patterns(feet, front, hard)[3]
    assert before == flight and impact and all(front.is_impact(active) for active in impact)
    assert patterns(feet, front, hard)[4] == (stick,) and patterns(feet, hind, hard) == patterns(feet, hind, soft)
    back = neighbour(hard, "touchdown of contact 'front' in interval 3 without impact")
    assert patterns(feet, front, back) == patterns(feet, front, soft)
    other = neighbour(hard, "touchdown of contacts 'front', 'hind' in interval 3 exchanged")
    assert patterns(feet, front, other) == patterns(feet, front, soft)
    assert any(hind.is_impact(active) for active in patterns(feet, hind, other)[3])
    both = neighbour(hard, "touchdown of contact 'hind' in interval 3 with impact")
    for foot in (front, hind):
        assert any(foot.is_impact(active) for active in patterns(feet, foot, both)[3])
    alone, _ = branch_of(hopper, {2, 3})
    start = hopper.transcription.problem.start
    found = [move.what for move in moves(BranchMotion(hopper, start, alone))]
    assert found and not any("with impact" in what for what in found)


def test_what_needs_more_elements_than_there_are_is_no_move() -> None:
    """With three elements an interval cannot hold a flight, the two modes of an impact, and the contact after it."""
    few = polisher("hopper_one_jump", "horizon.intervals=6", "method.elements=3")
    branch, _ = branch_of(few, {2, 3})
    found = moves(BranchMotion(few, few.transcription.problem.start, branch))
    what = [move.what for move in found]
    assert any("take-off" in one and "into interval" in one for one in what)
    assert not any("touchdown" in one and "into interval" in one for one in what)


def test_contacts_move_together() -> None:
    """Both pairs of feet that take off an interval apart do so an interval earlier, besides each alone."""
    feet = polisher("solo12_jump")
    branch, (front, hind) = branch_of(feet, {2, 3}, {3})
    found = list(moves(BranchMotion(feet, feet.transcription.problem.start, branch)))
    together = next(
        move for move in found if "take-off of contacts 'front', 'hind'" in move.what and "earlier" in move.what
    )
    flying = [
        [
            k
            for k, pattern in enumerate(patterns(feet, contact, together.branch))
            if pattern == (flight_and_stick(contact)[0],)
        ]
        for contact in (front, hind)
    ]
    assert flying == [[1, 2, 3], [2, 3]]


def test_what_happens_at_once_moves_together() -> None:
    """Where one foot lands as the other takes off, both move an interval later."""
    feet = polisher("solo12_jump")
    branch, (front, hind) = branch_of(feet, {3, 4}, {1, 2})
    found = list(moves(BranchMotion(feet, feet.transcription.problem.start, branch)))
    words = "take-off of contact 'front' and touchdown of contact 'hind' in interval 2 an interval later"
    together = next(move for move in found if move.what == words)
    flight = {contact: (flight_and_stick(contact)[0],) for contact in (front, hind)}
    flying = [
        [k for k, one in enumerate(patterns(feet, contact, together.branch)) if one == flight[contact]]
        for contact in flight
    ]
    assert flying == [[4], [1, 2, 3]]


def test_a_block_slides_off_as_it_is_hit() -> None:
    """The pusher meets the slider inside an interval, which slips from then on: in the impact, and not before it; and
    the pusher takes off an interval earlier together with the slider that stops an interval after it."""
    pushed = polisher("pusher_slider", "horizon.intervals=8", "method.elements=3")
    start, intervals = pushed.transcription.problem.start, intervals_of(pushed.transcription.elements)
    resting, _ = branch_of(pushed, set(), {0, 1, 2, 6, 7})
    forwards = next(i for i, label in enumerate(resting.conditions) if "sole forwards" in str(label))
    factors = list(resting.factors)
    for e in range(intervals[3].start, intervals[6].stop):
        factors[e] = tuple(ActiveFactor.H if i == forwards else one for i, one in enumerate(factors[e]))
    branch = replace(resting, factors=tuple(factors))
    sole, push = ContactConditions.of(pushed.conditions, branch)
    stick, slip = (patterns(pushed, sole, branch)[k][0] for k in (0, 3))
    found = list(moves(BranchMotion(pushed, start, branch)))

    together = "stick or slip of contact 'sole' and touchdown of contact 'push' in interval 2 into interval 2"
    hit = next(move.branch for move in found if move.what == together)
    before, impact, after = (hit.factors[e] for e in intervals[2])
    assert [sole.of_factors(one) for one in (before, impact, after)] == [stick, slip, slip]
    assert push.is_flight(push.of_factors(before)) and push.is_impact(push.of_factors(impact))
    assert not push.is_impact(push.of_factors(after)) and not push.is_flight(push.of_factors(after))

    withdrawn = next(
        move.branch for move in found if "take-off" in move.what and "sole" in move.what and "earlier" in move.what
    )
    assert patterns(pushed, push, withdrawn)[4:7] == [patterns(pushed, push, branch)[4], (push.flight,), (push.flight,)]
    assert patterns(pushed, sole, withdrawn)[5:7] == [(slip,), (stick,)]


def test_room_keeps_the_motion() -> None:
    """With an element more, and without it again, a point is the same motion, exact, and elements of one mode equal."""
    options = FesdOptions(tableau=make_tableau("radau_iia", 2), elements=3)
    transcription = Transcription(initial_value_problem(scalar("crossing"), [-1.0], 0.9), options)
    solution = solve(transcription.problem, Run(OPTIONS), polisher=BranchTranscription(transcription))
    assert solution.exact and solution.branch is not None
    roomier = with_room(BranchMotion.of(transcription, solution.w, solution.branch))
    assert roomier.transcription.elements == (4,) and not any(roomier.branch.without_length)
    back = without_room(roomier, transcription.elements)
    assert back.transcription.elements == (3,)
    for motion in (roomier, back):
        residuals = motion.transcription.problem.residuals(motion.w)
        assert residuals.constraint_violation <= 1e-9 and residuals.complementarity <= 1e-12
        elements, modes = motion.elements, motion.branch
        assert min(abs(element.end - 1 / 3) for element in elements) <= 1e-9, "the switch stays where it is"
        for before, after, one, other in zip(elements, elements[1:], modes.factors, modes.factors[1:], strict=False):
            assert one != other or before.step == pytest.approx(after.step, abs=1e-12)


def test_short_runs_at_the_ends_can_be_left_out(hopper: BranchTranscription) -> None:
    """A flight in the last interval becomes contact, one in the first two as well; a longer one stays."""
    w = hopper.transcription.problem.start
    for flying, left_out in (({5}, [{5}]), ({0, 1}, [{0, 1}]), ({0, 1, 2, 3}, [])):
        branch, (contact,) = branch_of(hopper, flying)
        found = [move for move in moves(BranchMotion(hopper, w, branch)) if "no flight" in move.what]
        assert [set(move.intervals) for move in found] == left_out
        for move in found:
            flight, stick = flight_and_stick(contact)
            assert patterns(hopper, contact, move.branch) == [(stick,)] * 6 and flight != stick


def test_elements_without_length_are_put_to_use(hopper: BranchTranscription) -> None:
    """All elements have a length again, equal within a mode, and the motion at the ends of intervals is the same."""
    transcription = hopper.transcription
    rng, elements = np.random.default_rng(0), list(transcription.unpack(transcription.problem.start))
    step = elements[0].step
    branch, _ = branch_of(hopper, {2, 3})
    short = [e % 4 in (1, 2) for e in range(len(elements))]
    time, at = 0.0, rng.uniform(-1, 1, elements[0].x.shape[1])
    for e, element in enumerate(elements):
        length = 0.0 if short[e] else 2 * step
        end = at if short[e] else rng.uniform(-1, 1, len(at))
        fractions = transcription.options.tableau.c[:, None]
        elements[e] = replace(element, start=time, step=length, x_left=at, x=at + fractions * (end - at))
        time, at = time + length, end
    w = transcription.pack(elements)
    whole = filled(BranchMotion(hopper, w, replace(branch, without_length=tuple(short))))
    again = whole.elements
    assert not any(whole.branch.without_length) and whole.branch.factors == branch.factors
    assert [element.step for element in again] == pytest.approx([step] * len(again))
    ends = [element.x[-1] for element in elements[3::4]]
    assert [element.x[-1] for element in again[3::4]] == [pytest.approx(end) for end in ends]


def test_a_branch_keeps_elements_of_one_mode_equal() -> None:
    """Moved off their lengths, the elements of one mode come back equal, and the problem with pairs can ask for it."""
    options = FesdOptions(tableau=make_tableau("radau_iia", 2), elements=5, step_equilibration="none")
    transcription = Transcription(initial_value_problem(scalar("crossing"), [-1.0], 0.9), options)
    branches = BranchTranscription(transcription)
    coarse = solve(
        replace(transcription, options=replace(options, step_equilibration="mean")).problem,
        Run(OPTIONS),
        polisher=BranchTranscription(replace(transcription, options=replace(options, step_equilibration="mean"))),
    )
    assert coarse.exact and coarse.branch is not None
    moved = coarse.w + 1e-3 * np.random.default_rng(0).standard_normal(len(coarse.w))
    start = BranchMotion(branches, moved, coarse.branch)
    fine = continue_on_branch(transcription.problem, branches, start, coarse, Run(OPTIONS))
    assert fine is not None and fine.branch is not None
    steps = [element.step for element in transcription.unpack(fine.w)]
    same = [n for n in range(4) if fine.branch.factors[n] == fine.branch.factors[n + 1]]
    assert same and all(steps[n] == pytest.approx(steps[n + 1], abs=1e-9) for n in same)
    asking = problem_around(BranchMotion.of_solution(branches, fine))
    assert asking.constraints == transcription.problem.constraints + len(same)
    assert asking.residuals(fine.w).constraint_violation <= 1e-8
    assert asking.residuals(moved).constraint_violation >= 1e-4


def test_a_direction_completes_modes(hopper: BranchTranscription) -> None:
    """Where a direction lifts the gap of a contact without a force, the element flies; where it slips, it may slip."""
    transcription = hopper.transcription
    branch, (foot,) = branch_of(hopper, set())
    flight, stick = flight_and_stick(foot)
    w = transcription.problem.start.copy()
    for e, element in enumerate(transcription.unpack(w)):
        for stage in range(len(element.slopes)):
            w[transcription.indices.stage(e, stage)[element.x.shape[1] :][:2]] = 0.0
    direction = np.zeros_like(w)
    gap = list(transcription.ocp.system.state_names).index("foot integrated gap")
    direction[transcription.indices.stage(5, 0)[gap]] = 1.0
    (completed,) = Pivots(BranchMotion(hopper, w, branch), direction).branches()
    changed = [e for e in range(len(branch.factors)) if completed.factors[e] != branch.factors[e]]
    assert changed == [5] and foot.of_factors(completed.factors[5]) == flight
    assert foot.of_factors(completed.factors[4]) == stick
    assert not list(Pivots(BranchMotion(hopper, w, branch), np.zeros_like(w)).branches())


def test_elements_without_length_that_grow(hopper: BranchTranscription) -> None:
    """One that grows in its neighbour's mode does so for nothing and may be held; in another mode it is a branch."""
    transcription = hopper.transcription
    elements = transcription.unpack(transcription.problem.start)
    for e in (8, 9):  # the first of the third interval
        elements[e] = replace(elements[e], step=0.0)
    w = transcription.pack(elements)
    for e in (8, 9):
        for stage in range(len(elements[e].slopes)):
            w[transcription.indices.stage(e, stage)[elements[e].x.shape[1] :][:2]] = 0.0
    direction = np.zeros_like(w)
    direction[[transcription.indices.step(e) for e in (8, 10)]] = 1.0, -1.0
    for flying, nothing in (({2}, {8}), (set[int](), set[int]())):
        branch, (foot,) = branch_of(hopper, flying)
        branch = replace(branch, without_length=tuple(e in (8, 9) for e in range(len(branch.factors))))
        pivots = Pivots(BranchMotion(hopper, w, branch), direction)
        assert pivots.growing_for_nothing == nothing
        grown = list(pivots.branches())
        assert len(grown) == (0 if nothing else 1)
        for one in grown:
            assert foot.of_factors(one.factors[8]) == flight_and_stick(foot)[0]
            assert not one.without_length[8] and one.without_length[9]
    around, held = (problem_around(BranchMotion(hopper, w, branch), held) for held in ((), {8}))
    assert held.constraints == around.constraints + 1
    longer = w + 1e-3 * direction
    violated = [one.residuals(longer).constraint_violation for one in (around, held)]
    assert violated[1] >= max(violated[0], 1e-3)


def test_a_long_contact_is_interrupted_by_a_flight(hopper: BranchTranscription) -> None:
    """A stance of six intervals may fly in its third and fourth; stances of two stay whole."""
    w = hopper.transcription.problem.start
    for flying, inserted in ((set(), [{2, 3}]), ({2, 3}, [])):
        branch, (contact,) = branch_of(hopper, flying)
        found = [move for move in moves(BranchMotion(hopper, w, branch)) if "inserted" in move.what]
        flight, stick = flight_and_stick(contact)
        assert [set(move.intervals) for move in found] == inserted
        for move in found:
            expected = [(flight,) if k in (2, 3) else (stick,) for k in range(6)]
            assert patterns(hopper, contact, move.branch) == expected


def test_a_motion_that_begins_with_a_contact_may_begin_in_flight(hopper: BranchTranscription) -> None:
    """It is hit inside the second interval, slipping to either side; not a short stance, nor a motion in flight."""
    w = hopper.transcription.problem.start
    for flying, sides in ((set(), 2), ({4}, 2), ({2, 3}, 0), ({0, 1, 2}, 0)):
        branch, (contact,) = branch_of(hopper, flying)
        found = [move for move in moves(BranchMotion(hopper, w, branch)) if "beginning to" in move.what]
        flight, stick = flight_and_stick(contact)
        assert len({move.branch.factors for move in found}) == len(found) == sides
        for move in found:
            begun, hit, *rest = patterns(hopper, contact, move.branch)
            assert begun == (flight,) and (hit[0], hit[-1]) == (flight, stick)
            assert len(hit) > 2 and all(map(contact.is_impact, hit[1:-1]))
            assert rest == patterns(hopper, contact, branch)[2:]
            assert set(move.intervals) == {0, 1}


def test_an_impact_on_a_boundary_goes_with_its_touchdown(hopper: BranchTranscription) -> None:
    """A touchdown whose impact begins an interval has it at the beginning, or at the end, of its neighbour's, too."""
    w = hopper.transcription.problem.start
    branch, (foot,) = branch_of(hopper, {2, 3})
    flight, stick = flight_and_stick(foot)
    inside = next(
        move
        for move in moves(BranchMotion(hopper, w, branch))
        if move.what == "touchdown of contact 'foot' in interval 3 into interval 4"
    ).branch
    own = intervals_of(hopper.transcription.elements)[4]
    impact = patterns(hopper, foot, inside)[4][1:3]
    factors = [*inside.factors[: own.start], *inside.factors[own.start + 1 : own.stop], inside.factors[own.stop - 1]]
    landed = Branch(inside.conditions, (*factors, *inside.factors[own.stop :]), inside.without_length)
    assert patterns(hopper, foot, landed)[3:5] == [(flight,), (*impact, stick)], "it lands where an interval begins"
    after = {move.what: patterns(hopper, foot, move.branch) for move in moves(BranchMotion(hopper, w, landed))}
    earlier = after["touchdown of contact 'foot' in interval 3 an interval earlier"]
    assert earlier[2:5] == [(flight,), (*impact, stick), (stick,)]
    later = after["touchdown of contact 'foot' in interval 3 an interval later"]
    assert later[3:5] == [(flight,), (flight, *impact)]
