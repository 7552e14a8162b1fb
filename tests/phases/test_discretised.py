"""Sequences on their control grids, and modes as active factors and back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fesd_robot.complementarity import Branch
from fesd_robot.contact import ContactMode, factors_of, modes_of
from fesd_robot.fesd.polishing import OneBranch
from fesd_robot.mpcc import BranchBounds, Mpcc
from fesd_robot.phases import discretised, guessed_sequences
from fesd_robot.phases.discretised import WITH_FORCE, shares

from .sequences import sequence, solver_of


@pytest.mark.parametrize(
    ("words", "durations", "intervals", "counts"),
    [
        ("S F S", (0.25, 0.5, 0.25), 20, [5, 10, 5]),
        ("S F S", (0.01, 0.98, 0.01), 20, [WITH_FORCE, 19, WITH_FORCE]),
        ("F S", (0.001, 0.999), 4, [1, 3]),
    ],
)
def test_intervals_are_shared_out_by_duration(
    words: str, durations: tuple[float, ...], intervals: int, counts: list[int]
) -> None:
    """Every phase has its part of the intervals, a flight at least one, and a contact with a force at least two."""
    found = shares(sequence(words, *durations), intervals)
    assert found[1:] == counts[1:] and abs(found[0] - counts[0]) <= 1 and sum(found) >= intervals


@pytest.mark.parametrize(
    ("task", "modes"),
    [
        ("block_push", ["FLIGHT", "STICK", "SLIP_FORWARDS", "SLIP_BACKWARDS"]),
        ("hopper_one_jump", ["FLIGHT", "STICK", "IMPACT_STICK", "IMPACT_FORWARDS", "IMPACT_BACKWARDS"]),
        ("table_push", ["FLIGHT", "STICK", "SLIP", "IMPACT_STICK", "IMPACT"]),
        ("ball_bat", ["FLIGHT", "SLIP", "IMPACT"]),
    ],
)
def test_modes_are_read_back_from_their_factors(task: str, modes: list[str]) -> None:
    """`modes_of` is the inverse of `factors_of`, in the plane, in space, with restitution and without friction."""
    motion = solver_of(task).motion
    own = discretised(motion, next(guessed_sequences(motion)))
    conditions = [member.condition for member in own.polisher.conditions.members]
    for name in modes:
        mode = ContactMode[name]
        frictionless = {contact.name for contact in motion.contacts if contact.friction == 0}
        given = {
            contact.name: (ContactMode.SLIP if mode is ContactMode.STICK else ContactMode.IMPACT)
            if contact.name in frictionless and mode.running is ContactMode.STICK
            else mode
            for contact in motion.contacts
        }
        factors = factors_of(conditions, given)
        branch = Branch(own.polisher.conditions.labels[: len(factors)], (factors,), (False,))
        assert modes_of(branch, 0) == given


def test_the_grid_has_nodes_at_knots_and_where_contacts_change() -> None:
    """Nodes of the start are at the ends of phases and at the waypoint of the block; their rows hold there."""
    motion = solver_of("block_push").motion
    names = tuple(contact.name for contact in motion.contacts)
    own = discretised(motion, replace(sequence("++ SS ++", 0.25, 0.35, 0.9), names=names))
    nodes = own.transcription.grid.nodes
    assert motion.ocp.knots == (0.5,) and [nodes[k] for k in own.nodes] == pytest.approx([0, 0.25, 0.5, 0.6, 1.5])
    w = own.transcription.problem.start.copy()
    clock = own.transcription.ocp.clock
    assert clock is not None
    for k, time in enumerate(nodes):
        w[own.transcription.indices.state(k)[clock.state]] = time
    blocks = {block.name: block for block in own.transcription.problem.blocks}
    for name in ("equal_intervals", "knot"):
        assert np.abs(blocks[name].evaluate(w)[1]).max() < 1e-12
    assert blocks["duration_of_a_phase"].evaluate(w)[1].ravel() == pytest.approx(own.sequence.durations)


def test_a_branch_alone_has_its_own_rows() -> None:
    """The rows of one branch are those of the whole problem that it bounds, with their bounds and values; what other
    branches hold is not computed, and a branch that holds it is refused."""
    motion = solver_of("solo12_jump_in_space").motion
    own = discretised(motion, next(guessed_sequences(motion)))
    alone, w = OneBranch(own.polisher, own.branch), np.random.default_rng(2).normal(size=own.polisher.problem.size)

    def rows(problem: Mpcc, bounds: BranchBounds) -> list[tuple[float, ...]]:
        values = np.concatenate([block.evaluate(w)[1].ravel(order="F") for block in problem.blocks])
        held = np.isfinite(bounds.g_lower) | np.isfinite(bounds.g_upper)
        return sorted(zip(bounds.g_lower[held], bounds.g_upper[held], values[held].round(9), strict=True))

    whole, part = own.polisher.bounds(own.branch), alone.bounds(own.branch)
    assert rows(own.polisher.problem, whole) == rows(alone.problem, part)
    assert alone.problem.constraints < 0.8 * own.polisher.problem.constraints
    on_the_ground = replace(own.branch, factors=own.branch.factors[:1] * len(own.branch.factors))
    assert alone._has_rows_of(own.branch) and not alone._has_rows_of(on_the_ground)
