"""The equations of motion in given contact modes, linearised: how a motion beside the plan departs from it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from fesd_robot.ocp import MotionProblem

_OPEN = 1e-9
"""Relative singular value of W = J M^-1 J^T below which redundant contacts leave a force open."""

_NO_SLIDING = 1e-9
"""m/s; a slower contact has no direction in which it slides."""


@dataclass(frozen=True)
class ContactState:
    """What contacts and joints with dry friction do, the same at all of n samples.

    Attributes:
        closed: whether a contact touches, (n_c) of bool.
        sliding: whether it slides, (n_c) of bool; only closed ones do.
        held: velocity coordinates that dry friction holds.
    """

    closed: np.ndarray
    sliding: np.ndarray
    held: np.ndarray


@dataclass(frozen=True)
class LinearMotion:
    """The rates of a small departure along a motion, n samples.

    A departure is e = (d, w) with the displacement d = q (-) q_ref, in the tangent space at q_ref, and w = v - v_ref.

        d' = w - ad(v) d,   w' = A_d d + A_w w + B u

    Attributes:
        state: of e, (n, 2 n_v, 2 n_v).
        control: of e by the controls, (n, 2 n_v, n_u).
    """

    state: np.ndarray
    control: np.ndarray


class ModeDynamics:
    """Linearised equations of motion and of impacts of a task's robot in given modes.

    With the rows J of closed contacts, normals of all and tangents of those that stick, and their forces f,

        M a = B u - h + J^T f,   J a + J' v = 0,   f_t = -mu f_n J_t v / |J_t v| where a contact slides,

    is differentiated by q, v and u with a and f given. The forces of compliant contacts are a part of -h: they are
    continuous, so that nothing jumps where they begin. The derivatives are those of the planner's own expressions of
    the robot, so that circles, two bodies and grounds of every kind are included.

    Args:
        motion: the formulated task.
    """

    def __init__(self, motion: MotionProblem) -> None:
        dynamics = motion.dynamics
        self._q, self._v, self._u = dynamics.configuration, dynamics.velocity, dynamics.control
        self._tangent = ca.jacobian(dynamics.configuration_derivative, self._v)
        pushes = [one.contact.normal * ca.fmax(-one.relief(self._v), 0) for one in motion.compliant]
        self._mass, self._force = dynamics.mass_matrix, sum(pushes, dynamics.force)
        self._rate = dynamics.configuration_derivative
        rows = [row for contact in motion.contacts for row in (contact.normal, *contact.directions)]
        self._jacobian = ca.horzcat(ca.SX(self._v.numel(), 0), *rows).T
        self.rows = 3 if motion.in_space else 2
        self.friction = np.array([contact.friction for contact in motion.contacts])
        self.restitution = np.array([contact.restitution for contact in motion.contacts])
        self.n_v, self.n_u = self._v.numel(), self._u.numel()

    def along(
        self,
        state: ContactState,
        configuration: np.ndarray,
        velocity: np.ndarray,
        control: np.ndarray,
        acceleration: np.ndarray,
        force: np.ndarray,
    ) -> LinearMotion:
        """Return the linearised motion at n samples in one mode.

        Args:
            state: of the contacts, at all of them.
            configuration, velocity, control, acceleration: (n, n_q), (n, n_v), (n, n_u), (n, n_v).
            force: of every contact, N, (n, n_c, rows).
        """
        n = len(configuration)
        mass, jacobian, by_q, by_v, by_u, rate_q, rate_v, slip_q = _samples(
            self._continuous, configuration, velocity, control, acceleration, force.reshape(n, -1)
        )
        headings = self._headings(state, jacobian, velocity)
        turned_q, turned_v = self._turned_friction(headings, jacobian, slip_q, force)
        right = -np.concatenate([by_q + turned_q, by_v + turned_v, by_u], axis=2)
        rows, pushing = self._rows_and_pushes(state, jacobian, headings)
        kept = self._kept(state)
        drift = -np.concatenate([rate_q[:, kept], rate_v[:, kept], np.zeros((n, len(kept), self.n_u))], axis=2)
        rates = _constrained(mass, right, *self._with_held_joints(state, rows, pushing, drift))
        n_v = self.n_v
        by_state, by_control = np.zeros((n, 2 * n_v, 2 * n_v)), np.zeros((n, 2 * n_v, self.n_u))
        by_state[:, :n_v, :n_v] = -self._brackets(configuration, velocity)
        by_state[:, :n_v, n_v:] = np.eye(n_v)
        by_state[:, n_v:], by_control[:, n_v:] = rates[:, :, : 2 * n_v], rates[:, :, 2 * n_v :]
        return LinearMotion(by_state, by_control)

    def across(
        self,
        state: ContactState,
        configuration: np.ndarray,
        before: np.ndarray,
        after: np.ndarray,
        impulse: np.ndarray,
    ) -> np.ndarray:
        """Return how an impact changes a small departure, (2 n_v, 2 n_v): M (v+ - v) = J^T L, J v+ = -e J v.

        The displacement passes through; the velocity is projected, with the derivative of this projection by q.

        Args:
            state: the contacts that take part are closed, and slide if their tangential velocity does not end.
            configuration, before, after: q, (n_q), v and v+, (n_v).
            impulse: of every contact, N s, (n_c, rows).
        """
        mass, jacobian, by_q, slip_q, slip_before_q = _samples(
            self._instant, configuration[None], before[None], after[None], impulse.reshape(1, -1)
        )
        rows, pushing = self._rows_and_pushes(state, jacobian, self._headings(state, jacobian, after[None]))
        kept = self._kept(state)
        bounce = np.zeros(len(jacobian[0]))
        bounce[:: self.rows] = self.restitution
        right = np.concatenate([-by_q, mass], axis=2)
        drift = -np.concatenate([slip_q + bounce[:, None] * slip_before_q, bounce[:, None] * jacobian], axis=2)[:, kept]
        change = _constrained(mass, right, *self._with_held_joints(state, rows, pushing, drift))[0]
        n_v = self.n_v
        result = np.eye(2 * n_v)
        result[n_v:] = change
        return result

    @cached_property
    def _continuous(self) -> ca.Function:
        """M, J, and the derivatives of residual, contact accelerations and contact velocities."""
        a, f = ca.SX.sym("a", self._v.numel()), ca.SX.sym("f", self._jacobian.shape[0])
        residual = ca.mtimes(self._mass, a) - self._force - ca.mtimes(self._jacobian.T, f)
        slip = ca.mtimes(self._jacobian, self._v)
        rate = ca.mtimes(self._jacobian, a) + ca.jtimes(slip, self._q, self._rate)
        return ca.Function(
            "mode_dynamics",
            [self._q, self._v, self._u, a, f],
            [
                ca.densify(each)
                for each in (
                    self._mass,
                    self._jacobian,
                    self._by_displacement(residual),
                    ca.jacobian(residual, self._v),
                    ca.jacobian(residual, self._u),
                    self._by_displacement(rate),
                    ca.jacobian(rate, self._v),
                    self._by_displacement(slip),
                )
            ],
        )

    @cached_property
    def _instant(self) -> ca.Function:
        """M, J, and the derivatives of an impact's residual and of contact velocities after and before it."""
        after, impulse = ca.SX.sym("v_after", self._v.numel()), ca.SX.sym("L", self._jacobian.shape[0])
        residual = ca.mtimes(self._mass, after - self._v) - ca.mtimes(self._jacobian.T, impulse)
        return ca.Function(
            "impact",
            [self._q, self._v, after, impulse],
            [
                ca.densify(each)
                for each in (
                    self._mass,
                    self._jacobian,
                    self._by_displacement(residual),
                    self._by_displacement(ca.mtimes(self._jacobian, after)),
                    self._by_displacement(ca.mtimes(self._jacobian, self._v)),
                )
            ],
        )

    @cached_property
    def _bracket(self) -> ca.Function:
        """The matrix ad(v): with q' = E(q) v, E ad(v) d = (dE/dq E v) d - (dE/dq E d) v; zero where q adds up."""
        d = ca.SX.sym("d", self._v.numel())
        along_d = ca.jtimes(ca.mtimes(self._tangent, self._v), self._q, ca.mtimes(self._tangent, d))
        along_v = ca.jtimes(ca.mtimes(self._tangent, d), self._q, self._rate)
        normal = ca.mtimes(self._tangent.T, self._tangent)
        bracket = ca.solve(normal, ca.mtimes(self._tangent.T, along_v - along_d))
        return ca.Function("bracket", [self._q, self._v], [ca.densify(ca.jacobian(bracket, d))])

    def _brackets(self, configuration: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        if self._q.numel() == self._v.numel():
            return np.zeros((len(velocity), self.n_v, self.n_v))
        return _samples(self._bracket, configuration, velocity)[0]

    def _by_displacement(self, expression: ca.SX) -> ca.SX:
        return ca.mtimes(ca.jacobian(expression, self._q), self._tangent)

    def _kept(self, state: ContactState) -> np.ndarray:
        """Return the rows of J along which nothing accelerates."""
        rows = np.zeros((len(state.closed), self.rows), dtype=bool)
        rows[:, 0] = state.closed
        rows[:, 1:] = (state.closed & ~state.sliding & (self.friction > 0))[:, None]
        return np.flatnonzero(rows)

    def _headings(
        self, state: ContactState, jacobian: np.ndarray, velocity: np.ndarray
    ) -> dict[int, tuple[np.ndarray, np.ndarray]]:
        """Return sliding contact -> direction in which it slides, (n, n_t), and how fast, m/s, (n)."""
        found = {}
        for contact in np.flatnonzero(state.sliding).tolist():
            slip = np.einsum("ntv,nv->nt", jacobian[:, self._tangents(contact)], velocity)
            speed = np.linalg.norm(slip, axis=1)
            found[contact] = slip / np.maximum(speed, _NO_SLIDING)[:, None], speed
        return found

    def _tangents(self, contact: int) -> slice:
        return slice(contact * self.rows + 1, (contact + 1) * self.rows)

    def _rows_and_pushes(
        self, state: ContactState, jacobian: np.ndarray, headings: dict[int, tuple[np.ndarray, np.ndarray]]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return rows along which nothing accelerates, and generalized forces of their multipliers, (n, ., n_v)."""
        pushing = jacobian.copy()
        for contact, (heading, _) in headings.items():
            across = np.einsum("nt,ntv->nv", heading, jacobian[:, self._tangents(contact)])
            pushing[:, contact * self.rows] -= self.friction[contact] * across
        kept = self._kept(state)
        return jacobian[:, kept], pushing[:, kept]

    def _turned_friction(
        self,
        headings: dict[int, tuple[np.ndarray, np.ndarray]],
        jacobian: np.ndarray,
        slip_q: np.ndarray,
        force: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return derivatives of -J_t^T f_t by displacement and velocity, (n, n_v, n_v), as sliding turns in space."""
        by_q, by_v = (np.zeros((len(jacobian), self.n_v, self.n_v)) for _ in range(2))
        if self.rows == 2:
            return by_q, by_v
        for contact, (heading, speed) in headings.items():
            rows = self._tangents(contact)
            turning = np.eye(2) - heading[:, :, None] * heading[:, None, :]
            size = np.where(speed > _NO_SLIDING, self.friction[contact] * force[:, contact, 0], 0.0)
            turning *= (size / np.maximum(speed, _NO_SLIDING))[:, None, None]
            pushed = np.einsum("ntv,nts->nvs", jacobian[:, rows], turning)
            by_q += pushed @ slip_q[:, rows]
            by_v += pushed @ jacobian[:, rows]
        return by_q, by_v

    def _with_held_joints(
        self, state: ContactState, rows: np.ndarray, pushing: np.ndarray, drift: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return rows, pushes and drift with those of joints that dry friction holds."""
        if not len(state.held):
            return rows, pushing, drift
        n = len(rows)
        picked = np.broadcast_to(np.eye(self.n_v)[state.held], (n, len(state.held), self.n_v))
        still = np.zeros((n, len(state.held), drift.shape[2]))
        return tuple(np.concatenate(pair, axis=1) for pair in ((rows, picked), (pushing, picked), (drift, still)))  # type: ignore[return-value]


def _constrained(
    mass: np.ndarray, right: np.ndarray, rows: np.ndarray, pushing: np.ndarray, drift: np.ndarray
) -> np.ndarray:
    """Return x of M x = right + P^T f, J x = drift, (n, n_v, columns); least squares where contacts are redundant."""
    free = np.linalg.solve(mass, right)
    if not rows.shape[1]:
        return free
    response = np.linalg.solve(mass, np.swapaxes(pushing, 1, 2))
    compliance = rows @ response
    force = np.linalg.pinv(compliance, rcond=_OPEN) @ (drift - rows @ free)
    return np.asarray(free + response @ force)


def _samples(function: ca.Function, *inputs: np.ndarray) -> list[np.ndarray]:
    """Return a function's matrices at n samples, (n, rows, columns) each."""
    n = len(inputs[0])
    mapped = function.map(n)
    results = mapped(*(each.T for each in inputs))
    results = [results] if function.n_out() == 1 else list(results)
    shapes = [function.size_out(i) for i in range(function.n_out())]
    return [
        np.asarray(each.full()).reshape(rows, n, columns).transpose(1, 0, 2)
        for each, (rows, columns) in zip(results, shapes, strict=True)
    ]
