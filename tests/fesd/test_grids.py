"""Switches are found wherever they fall in the grid of steps, and at a cost that does not explode with their number."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from fesd_robot.dcs import ComplementaritySystem, Model, Subsystem
from fesd_robot.fesd import FesdOptions, SimulationError, make_tableau, simulate
from fesd_robot.fesd.groups import PairGroups
from fesd_robot.fesd.tableau import Scheme

from .systems import SIGNS, TIME, by_regions, driven, oscillator, relay, relays

ROOT = np.sqrt(2) - 1
HORIZONS = np.linspace(1.6, 2.6, 81)
"""With 5 steps the boundaries of the steps pass over both switches, 0.414 and 1, forwards and in small steps."""

SCHEMES: list[tuple[Scheme, int]] = [
    ("radau_iia", 2), ("radau_iia", 3), ("radau_iia", 5), ("gauss_legendre", 2), ("lobatto_iiic", 2),
]  # fmt: skip
each_scheme = pytest.mark.parametrize(("scheme", "stages"), SCHEMES, ids=[f"{s}-{n}" for s, n in SCHEMES])
each_form = pytest.mark.parametrize("form", ["stewart", "heaviside"])


def _wrong(
    system: ComplementaritySystem, scheme: Scheme, stages: int, horizons: np.ndarray, exact: list[float]
) -> list[float]:
    """Return the horizons on which the switches are not the exact ones, all of them and no others."""
    options, wrong = FesdOptions(make_tableau(scheme, stages), elements=2), []
    for horizon in horizons:
        motion = simulate(system, np.array([-0.5, 0.0]), 5, float(horizon), options=options)
        assert {report.method for report in motion.reports} == {"modes"}
        found = motion.switch_times
        if len(found) != len(exact) or np.abs(found - exact).max() > 1e-9:
            wrong.append(float(horizon))
    return wrong


@pytest.mark.slow
@each_form
@each_scheme
def test_a_sliding_mode_begins_and_ends_on_every_grid(form: str, scheme: Scheme, stages: int) -> None:
    """x' = t - sign x from -1/2 slides from √2 - 1 to 1, wherever steps begin."""
    system = relay(form, TIME + 1, TIME - 1)
    horizons = HORIZONS if (scheme, stages) == ("radau_iia", 2) else HORIZONS[::4]
    assert _wrong(system, scheme, stages, horizons, [ROOT, 1.0]) == []


@pytest.mark.slow
@each_form
@pytest.mark.parametrize(("scheme", "stages"), [("radau_iia", 2), ("gauss_legendre", 2)])
def test_a_crossing_is_found_on_every_grid(form: str, scheme: Scheme, stages: int) -> None:
    """x' = 1 + t below zero and 1/5 + t/2 above it crosses at √2 - 1."""
    system = relay(form, TIME + 1, TIME / 2 + 0.2)
    assert _wrong(system, scheme, stages, HORIZONS[::2], [ROOT]) == []


@each_form
def test_leaving_shortly_after_the_start(form: str) -> None:
    """From x = 0 at 1 - d it slides until 1; no stage sees the wrong sign of leaving at once."""
    system = relay(form, TIME + 1, TIME - 1)
    for d in (0.3, 0.1, 0.03, 0.01, 1e-3, 1e-4):
        motion = simulate(system, np.array([0.0, 1 - d]), 1, 1.0)
        assert motion.switch_times == pytest.approx([d], abs=1e-9)
        assert motion.states[-1, 0] == pytest.approx((1 - d) ** 2 / 2, abs=1e-12)


@pytest.mark.slow
@each_form
@pytest.mark.parametrize("count", [1, 4, 8, 20])
def test_trials_are_linear_in_the_number_of_switches(form: str, count: int) -> None:
    """One crossing among n relays, and n at once, take 2 trials; n relays that begin to slide at once 2 n + 1."""
    crossing = relays(form, count, 2.0, 1.0)
    one = np.full(count, -5.0)
    one[0] = -0.5
    motion = simulate(crossing, one, 1, 1.0)
    assert motion.reports[0].trials == 2 and motion.switch_times == pytest.approx([0.25], abs=1e-12)
    motion = simulate(crossing, np.full(count, -0.5), 1, 1.0)
    assert motion.reports[0].trials == 2 and motion.states[-1] == pytest.approx(0.75, abs=1e-12)
    if count <= 8:
        motion = simulate(relays(form, count, 1.0, -1.0), np.full(count, -0.5), 1, 1.0)
        assert motion.reports[0].trials <= 2 * count + 1 and np.abs(motion.states[-1]).max() <= 1e-12


@each_form
def test_crossings_one_after_the_other_take_a_trial_each(form: str) -> None:
    """Six relays that cross at six times in one step take 7 trials."""
    starts = -2 * (np.arange(6) + 1) / 8
    motion = simulate(relays(form, 6, 2.0, 1.0), starts, 1, 1.0, options=FesdOptions(elements=7))
    assert motion.reports[0].trials == 7
    assert motion.switch_times == pytest.approx(-starts / 2, abs=1e-12)


def test_too_few_elements_are_no_reason_to_stay_where_nothing_holds_it() -> None:
    """From x = 0 with x' = sign x, resting needs no switch and leaving needs one: it is not given up for that."""
    x = ca.SX.sym("x", 2)
    subsystems = [
        Subsystem(fields=ca.DM([[-1, 1], [0, 0]]), switching=x[0], sign_matrix=SIGNS, name="leaves"),
        Subsystem(
            fields=ca.horzcat(*[ca.vertcat(0, x[0] ** 2)] * 2), switching=x[1], sign_matrix=SIGNS, name="follows"
        ),
    ]
    system, start = by_regions("stewart", Model(x), subsystems), np.array([0.0, -0.01])
    with pytest.raises(
        SimulationError, match="more than the 1 elements of a step; what fits in them is a mode that can"
    ):
        simulate(system, start, 1, 1.0, options=FesdOptions(elements=1))
    motion = simulate(system, start, 1, 1.0)
    assert abs(motion.states[-1, 0]) == pytest.approx(1.0) and motion.switch_times == pytest.approx([0.03 ** (1 / 3)])
    assert not motion.unique and motion.notes[0].time == 0.0


def test_groups_are_what_decides_together() -> None:
    """The sides of a step function are a group, the regions of a subsystem are one; not all H of it can vanish."""
    steps = PairGroups(driven())
    assert [group.tolist() for group in steps.groups] == [[0, 2], [1, 3]] and steps.needs_one == [True, True]
    assert [group.tolist() for group in PairGroups(oscillator()).groups] == [[0, 1]]
    regions = PairGroups(relays("stewart", 3, 2.0, 1.0))
    assert [group.tolist() for group in regions.groups] == [[0, 1], [2, 3], [4, 5]]
    assert regions.needs_one == [True] * 3
    assert regions.components == [[0], [1], [2]] and steps.components == [[0, 1]]
