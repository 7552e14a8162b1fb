"""Dry friction of joints in the planner's dynamics: slides, stops and sticks as formulas say, also through impacts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache

import casadi as ca
import numpy as np
import pytest

from fesd_robot.complementarity import Branch
from fesd_robot.contact import (
    CompliantContact,
    Contact,
    ContactMode,
    ContactOptions,
    ContactSystem,
    MultibodyDynamics,
    contact_modes,
    contact_system,
    joint_modes,
)
from fesd_robot.errors import OptionError
from fesd_robot.fesd import Element, FesdOptions, OptimalControlProblem, Transcription, make_tableau
from fesd_robot.fesd.neighbours import Pivots, moves
from fesd_robot.fesd.polishing import BranchMotion, BranchTranscription, conditions_of, read_branch
from fesd_robot.mpcc import HomotopyOptions, Run, solve
from fesd_robot.recovery import PhysicalMotion, recover

MASS, LIMIT = 2.0, 3.0
"""kg, N: a block on a rail with dry friction."""

AUXILIARY_FORCE = 100.0
"""N per unit of J_n; what it is makes no difference here."""

RADAU = make_tableau("radau_iia", 2)

FAR = 100.0
"""m; where the block's wall is, which it never meets."""


def block(limit: float = LIMIT) -> tuple[MultibodyDynamics, list[Contact]]:
    """m x'' = u + tau on a rail, with a wall far to the left."""
    q, v, u = ca.SX.sym("q"), ca.SX.sym("v"), ca.SX.sym("u")
    dynamics = MultibodyDynamics(
        configuration=q,
        velocity=v,
        control=u,
        configuration_derivative=v,
        mass_matrix=MASS * ca.SX.eye(1),
        force=u,
        configuration_names=["x"],
        velocity_names=["x"],
        control_names=["push"],
        dry_friction={"x": limit} if limit else {},
    )
    return dynamics, [Contact("wall", q + FAR, ca.SX(1), ca.SX(ca.DM.zeros(1)), 0.0)]


def driven(
    dynamics: MultibodyDynamics,
    contacts: list[Contact],
    start: Sequence[float],
    control: Sequence[float],
    duration: float,
    elements: int = 3,
    compliant: Sequence[CompliantContact] = (),
    stages: int = 2,
) -> tuple[PhysicalMotion, Branch, list[Element]]:
    """Return the motion that the planner finds from a state (q, v) under a constant control, of one interval."""
    options, end = ContactOptions(auxiliary_force=AUXILIARY_FORCE), ca.SX.sym("end")
    system = contact_system(dynamics, contacts, options, end, compliant)
    clock, n = len(start), system.system.state.numel()
    gap = ca.Function("gap", [dynamics.configuration], [ca.vertcat(*[contact.gap for contact in contacts])])
    x0 = np.concatenate([start, [0.0], np.asarray(gap(start[: clock // 2])).ravel()])
    free, lower = np.full(n, np.inf), np.full(n, -np.inf)
    lower[clock + 1 :] = system.gap_lower
    ocp = OptimalControlProblem(
        system=system.system,
        duration=duration,
        intervals=1,
        parameters=np.array([[duration]]),
        initial_lower=x0,
        initial_upper=x0,
        state_lower=lower,
        state_upper=free,
        terminal_lower=-free,
        terminal_upper=free,
        control_lower=np.array([*control, 0.5]),
        control_upper=np.array([*control, 2.0]),
        state_guess=lambda _: x0,
        control_guess=np.array([[*control, 1.0]]).T,
        interval_end=system.system.state[clock] - end,
        interval_end_names=("clock",),
    )
    transcription = _transcription(ocp, elements, stages)
    polisher, tableau = BranchTranscription(transcription), transcription.options.tableau
    solution = solve(transcription.problem, Run(HomotopyOptions(compile="never")), polisher=polisher)
    assert solution.exact and solution.branch is not None
    found = transcription.unpack(solution.w)
    motion = recover(found, solution.branch, tableau, dynamics, contacts, system, AUXILIARY_FORCE, compliant)
    return motion, solution.branch, found


def _transcription(ocp: OptimalControlProblem, elements: int, stages: int = 2) -> Transcription:
    return Transcription(
        ocp,
        FesdOptions(
            tableau=make_tableau("radau_iia", stages),
            elements=elements,
            cross_complementarity="theta_sum",
            step_equilibration="none",
            step_freedom=elements - 1.0,
        ),
    )


@cache
def stopping() -> tuple[PhysicalMotion, Branch, list[Element]]:
    """The block at 1.5 m/s, pushed back with 1 N for a second."""
    return driven(*block(), [0.0, 1.5], [-1.0], 1.0)


def test_a_block_stops_and_sticks_at_the_time_of_the_formula() -> None:
    """t = m v / (F - u) and x = m v^2 / (2 (F - u)), to 1e-9; then the friction is the push, and nothing moves."""
    motion, branch, _ = stopping()
    assert motion.joints is not None
    (stop,) = motion.joints.switches
    time = MASS * 1.5 / (LIMIT + 1.0)
    assert (stop.kind, stop.contact) == ("slip_to_stick", 0)
    assert stop.time == pytest.approx(time, abs=1e-9)
    assert motion.configuration[-1, 0] == pytest.approx(0.5 * 1.5 * time, abs=1e-9)
    later = motion.time > time + 1e-6
    assert later.sum() >= 2
    np.testing.assert_allclose(motion.velocity[later], 0, atol=1e-12)
    np.testing.assert_allclose(motion.joints.force[later, 0], 1.0, atol=1e-9)
    np.testing.assert_allclose(motion.joints.force[motion.time < time, 0], -LIMIT, atol=1e-9)
    assert joint_modes(branch, 0) == {"x": ContactMode.SLIP_FORWARDS}
    assert joint_modes(branch, len(branch.factors) - 1) == {"x": ContactMode.STICK}


@pytest.mark.parametrize(("push", "distance"), [(2.999, 0.0), (-2.999, 0.0), (5.0, 0.5), (-5.0, -0.5)])
def test_a_block_at_rest_breaks_away_above_its_friction_only(push: float, distance: float) -> None:
    """Pushed with less than F it stays exactly where it is; with more it moves by (|u| - F) t^2 / (2 m)."""
    motion, _, _ = driven(*block(), [0.0, 0.0], [push], 1.0)
    assert motion.configuration[-1, 0] == pytest.approx(distance, abs=1e-9)
    if not distance:
        np.testing.assert_allclose(motion.velocity, 0, atol=1e-12)


def test_a_block_turns_round_against_a_strong_push() -> None:
    """Slowed by u and F together it stops at t = m v / (|u| + F), and goes back by |u| - F alone."""
    motion, _, _ = driven(*block(), [0.0, 1.5], [-5.0], 1.0)
    assert motion.joints is not None
    (turn,) = motion.joints.switches
    time = MASS * 1.5 / (5 + LIMIT)
    assert (turn.kind, turn.time) == ("slip_reversal", pytest.approx(time, abs=1e-9))
    assert motion.velocity[-1, 0] == pytest.approx(-(5 - LIMIT) / MASS * (1 - time), abs=1e-9)


SLIDER, GRAVITY, WEAK = 3.0, 10.0, 2.0
"""kg of the slider, m/s^2, and N of its dry friction."""


def lander() -> tuple[MultibodyDynamics, list[Contact]]:
    """A base of 1 kg at the height z above the ground, and a slider on it at z + y, with dry friction in y."""
    q, v, u = ca.SX.sym("q", 2), ca.SX.sym("v", 2), ca.SX.sym("u", 0)
    dynamics = MultibodyDynamics(
        configuration=q,
        velocity=v,
        control=u,
        configuration_derivative=v,
        mass_matrix=ca.SX(ca.DM([[1 + SLIDER, SLIDER], [SLIDER, SLIDER]])),
        force=ca.SX(ca.DM([-(1 + SLIDER) * GRAVITY, -SLIDER * GRAVITY])),
        configuration_names=["z", "y"],
        velocity_names=["z", "y"],
        control_names=[],
        dry_friction={"y": WEAK},
    )
    return dynamics, [Contact("foot", q[0], ca.SX(ca.DM([1.0, 0.0])), ca.SX(ca.DM([0.0, 0.0])), 0.0)]


@dataclass
class Landing:
    """Elements of constant multipliers, whose states are polynomials of degree two: two stages are exact."""

    system: ContactSystem
    state: np.ndarray
    elements: list[Element] = field(default_factory=list)

    def add(self, duration: float, s: float, *, theta: float = 0.0) -> None:
        """Append an element of numerical time in which the slider moves with the sign s, or sticks without force."""
        left, free, tableau = self.state, 1 - theta, RADAU
        force = free * np.array([-(1 + SLIDER) * GRAVITY, -SLIDER * GRAVITY - WEAK * s]) + [AUXILIARY_FORCE * theta, 0]
        rate = np.linalg.solve([[1 + SLIDER, SLIDER], [SLIDER, SLIDER]], force)

        def at(tau: float) -> np.ndarray:
            q = left[:2] + free * (left[2:4] * tau + 0.5 * rate * tau**2)
            return np.concatenate([q, left[2:4] + rate * tau, [left[4] + free * tau, q[0]]])

        x = np.array([at(duration * c) for c in tableau.c])
        x[np.abs(x) < 1e-14] = 0.0
        z = np.array([theta, free * (1 + s) / 2, free * (1 - s) / 2])
        before = self.elements[-1] if self.elements else None
        self.elements.append(
            Element(
                interval=0,
                start=before.end if before else 0.0,
                step=duration,
                x_left=left,
                z_left=before.z[-1] if before else z,
                x=x,
                z=np.array([z, z]),
                u=np.ones(1),
                slopes=np.zeros((2, len(left))),
            )
        )
        self.state = x[-1]


def _landing(speed: float) -> tuple[Landing, float]:
    """Return the lander from 0.1 s before its impact, at y' = `speed`, to 0.1 s after it, and its y' at the end."""
    fall, s = 0.1, float(np.sign(speed))
    base = -GRAVITY + WEAK * s
    z_speed = -1.0 - base * fall
    height = -(z_speed * fall + 0.5 * base * fall**2)
    y_speed = speed + WEAK * s * (1 + 1 / SLIDER) * fall
    motion = Landing(
        contact_system(*lander(), ContactOptions(auxiliary_force=AUXILIARY_FORCE)),
        np.array([height, 0.0, z_speed, y_speed, 0.0, height]),
    )
    assert list(motion.system.system.algebraic_names) == ["theta_+[foot]", "pi_+[y]", "pi_-[y]"]
    motion.add(fall, s)
    motion.add(1.0 / AUXILIARY_FORCE, 0.0, theta=1.0)
    after, left = speed - 1.0, 0.1
    slowing, falling = GRAVITY + WEAK / SLIDER, GRAVITY - WEAK / SLIDER
    for sign, time in ((1.0, max(after, 0.0) / slowing), (-1.0, left - max(after, 0.0) / slowing)):
        theta = (GRAVITY - WEAK * sign) / (AUXILIARY_FORCE + GRAVITY - WEAK * sign)
        if time:
            motion.add(time / (1 - theta), sign, theta=theta)
    last = after - falling * left if after < 0 else -falling * (left - after / slowing)
    return motion, last


@pytest.mark.parametrize("speed", [0.0, 0.6, 1.5, -0.5], ids=["sticking", "turned round", "slowed", "made faster"])
def test_an_impact_takes_no_notice_of_dry_friction(speed: float) -> None:
    """A base that lands at -1 m/s stops; the slider goes on by its inertia, so that y' falls by 1 m/s at once.

    In the fall friction acts between the two, y'' = -F s (1 + 1/m), z'' = -g + F s, and nothing at all where they do
    not move against each other. After the landing y'' = -g - F s / m, through zero without a stop, as F < m g. That
    motion meets all conditions and the bounds of the branch that is read from it, and comes back from its elements.
    """
    landing, last = _landing(speed)
    total, n = landing.elements[-1].end, len(landing.state)
    free, lower = np.full(n, np.inf), np.full(n, -np.inf)
    lower[-1] = 0.0
    ocp = OptimalControlProblem(
        system=landing.system.system,
        duration=total,
        intervals=1,
        parameters=np.zeros((0, 1)),
        initial_lower=landing.elements[0].x_left,
        initial_upper=landing.elements[0].x_left,
        state_lower=lower,
        state_upper=free,
        terminal_lower=-free,
        terminal_upper=free,
        control_lower=np.ones(1),
        control_upper=np.ones(1),
        state_guess=lambda _: landing.state,
        control_guess=np.ones((1, 1)),
    )
    transcription = _transcription(ocp, len(landing.elements))
    polisher, w = BranchTranscription(transcription), transcription.pack(landing.elements)
    residuals = transcription.problem.residuals(w)
    assert residuals.constraint_violation <= 1e-13, residuals.worst_constraint
    assert residuals.complementarity <= 1e-13, residuals.worst_pair

    branch = read_branch(polisher.conditions, landing.elements, np.zeros(len(landing.elements)), 0.0)
    assert contact_modes(branch, 1) == {"foot": ContactMode.IMPACT}
    bounds = polisher.bounds(branch)
    assert (w >= bounds.lower - 1e-12).all() and (w <= bounds.upper + 1e-12).all()

    dynamics, contacts = lander()
    motion = recover(landing.elements, branch, RADAU, dynamics, contacts, landing.system, AUXILIARY_FORCE)
    (hit,) = motion.impacts
    np.testing.assert_allclose(motion.velocity[hit.before], [-1.0, speed], atol=1e-12)
    np.testing.assert_allclose(motion.velocity[hit.after], [0.0, speed - 1.0], atol=1e-12)
    np.testing.assert_allclose(motion.velocity[-1], [0.0, last], atol=1e-12)
    assert motion.joints is not None
    kinds = {0.0: ["stick_to_slip"], 0.6: ["slip_reversal"], 1.5: ["slip_reversal"], -0.5: []}[speed]
    assert [event.kind for event in motion.joints.switches] == kinds
    sliding = np.abs(motion.velocity[:, 1]) > 1e-9
    np.testing.assert_allclose(np.abs(motion.joints.force[sliding & (motion.weight > 0), 0]), WEAK, atol=1e-12)


def test_a_joint_has_other_modes_before_and_after_an_impact() -> None:
    """Turned round by the impact the slider slides forwards before it and backwards after it."""
    landing, _ = _landing(0.6)
    conditions = conditions_of(landing.system.system)
    branch = read_branch(conditions, landing.elements, np.zeros(len(landing.elements)), 0.0)
    assert joint_modes(branch, 0) == {"y": ContactMode.SLIP_FORWARDS}
    assert joint_modes(branch, 2) == {"y": ContactMode.SLIP_BACKWARDS}


def test_without_dry_friction_nothing_is_added() -> None:
    """A robot without dry friction has the same variables and conditions as before."""
    assert not contact_system(*block(0.0), ContactOptions()).theta_joints
    with_some = contact_system(*block(), ContactOptions()).system
    without = contact_system(*block(0.0), ContactOptions()).system
    assert with_some.algebraic.numel() == without.algebraic.numel() + 2
    assert len(with_some.complementarities) == len(without.complementarities) + 2


def test_the_published_form_refuses_dry_friction() -> None:
    """The step form has none, and says so by the joint's name."""
    with pytest.raises(OptionError, match="dry friction of joints \\(x\\) needs the form 'multipliers'"):
        contact_system(*block(), ContactOptions(form="steps"))


def _pushed(parts: Mapping[str, float]) -> float:
    """Return the largest product of the stopping motion when its friction has other shares while it slides."""
    _, _, elements = stopping()
    dynamics, contacts = block()
    system = contact_system(dynamics, contacts, ContactOptions()).system
    names = list(system.algebraic_names)
    products = []
    z = np.array(elements[0].z[0])
    z[names.index("pi_+[x]")], z[names.index("pi_-[x]")] = parts["+"], parts["-"]
    for condition in system.complementarities:
        if condition.rate_share:
            values = ca.Function("both", [system.state, system.algebraic], [condition.G, condition.H])
            G, H = values(elements[0].x[0], z)
            products.append(max(float(G), 0.0) * float(H))
    return max(products)


def _neighbourhood() -> BranchMotion:
    """The stopping motion as a point of its problem."""
    _, branch, elements = stopping()
    system = contact_system(*block(), ContactOptions(auxiliary_force=AUXILIARY_FORCE)).system
    free, count = np.full(system.state.numel(), np.inf), len(elements)
    ocp = OptimalControlProblem(
        system=system,
        duration=1.0,
        intervals=1,
        parameters=np.zeros((0, 1)),
        initial_lower=elements[0].x_left,
        initial_upper=elements[0].x_left,
        state_lower=-free,
        state_upper=free,
        terminal_lower=-free,
        terminal_upper=free,
        control_lower=elements[0].u,
        control_upper=elements[0].u,
        state_guess=lambda _: elements[0].x_left,
        control_guess=elements[0].u.reshape(-1, 1),
    )
    transcription = _transcription(ocp, count)
    return BranchMotion.of(transcription, transcription.pack(elements), branch)


def test_moves_of_joints_are_asked_for() -> None:
    """The stop of the block may move to either end of its interval; without being asked for, joints stay."""
    motion = _neighbourhood()
    found = list(moves(motion))
    words = [move.what for move in found]
    assert "stick or slip of joint 'x' in interval 0 to the beginning of its interval" in words
    assert "stick or slip of joint 'x' in interval 0 to the end of its interval" in words
    later = found[words.index("stick or slip of joint 'x' in interval 0 to the end of its interval")]
    assert joint_modes(later.branch, len(motion.branch.factors) - 1) == {"x": ContactMode.SLIP_FORWARDS}


def test_a_pivot_lets_a_sticking_joint_go_where_the_direction_takes_it() -> None:
    """A direction along which a sticking block begins to move leads to the branch on which it slides that way."""
    motion = _neighbourhood()
    transcription, last = motion.transcription, len(motion.branch.factors) - 1
    for sign, mode in ((1.0, ContactMode.SLIP_FORWARDS), (-1.0, ContactMode.SLIP_BACKWARDS)):
        direction, layout = np.zeros_like(motion.w), transcription.layouts[last + 1]
        for stage in range(layout.stages):
            direction[transcription.indices.offsets[0] + layout.state(last, stage).start + 1] = sign
        pivots = Pivots(motion, direction)
        assert joint_modes(next(pivots.branches()), last) == {"x": mode}


def test_friction_along_the_motion_breaks_a_condition() -> None:
    """Only the share that opposes the motion may be positive while the block slides."""
    assert _pushed({"+": 1.0, "-": 0.0}) == 0
    assert _pushed({"+": 0.9, "-": 0.1}) > 1e-2
    assert _pushed({"+": 0.0, "-": 1.0}) > 1e-1
