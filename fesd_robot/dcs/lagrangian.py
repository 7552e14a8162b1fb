"""Rigid bodies with unilateral contacts, forces at the stages and impulses between the elements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Literal

import casadi as ca
import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.complementarity import Complementarity, HeldAt, Label
from fesd_robot.dcs.checks import check_content, check_shape, check_unique
from fesd_robot.dcs.jump import Impulse, Jump
from fesd_robot.dcs.system import ComplementaritySystem
from fesd_robot.errors import DimensionError, ModelError

FORCE_AT_A_DISTANCE = "force at a distance"
"""Kind of the pair gap _|_ normal force."""

FORCE_WHILE_APPROACHING = "force while approaching"
"""Kind of the condition that a normal force does not stop a body at once: only an impulse does."""

FRICTION_ALONG_SLIDING, IMPULSE_ALONG_SLIDING = "friction along sliding", "impulsive friction along sliding"
"""Kinds of the conditions that friction, and its impulse, oppose sliding; their subjects are `FORWARDS` and so on."""

SLIPPING = "slipping"
"""Kind of the conditions of a contact that may not slip."""

FORWARDS, BACKWARDS = "forwards", "backwards"


@partial(checked, exact=True)
@dataclass(frozen=True, eq=False)
class UnilateralContact:
    """A gap that does not become negative, and what its contact does.

    Args:
        name: of the contact.
        gap: f_c(q), SX scalar.
        normal: J_n in velocity space, SX (n_v): df_c/dt = J_n v.
        tangent: J_t in velocity space, SX (n_v); only where there is friction.
        friction: coefficient mu of Coulomb's law.
        restitution: e of Newton's law of impact, v_n+ = -e v_n-.
        slips: whether it may slip while it is closed; an impact may change its tangential velocity all the same.

    Raises:
        ModelError: friction without a tangent or a negative one, or restitution outside [0, 1].
    """

    name: str
    gap: ca.SX
    normal: ca.SX
    tangent: ca.SX | None = None
    friction: float = 0.0
    restitution: float = 0.0
    slips: bool = True

    def __post_init__(self) -> None:
        if self.friction < 0 or (self.friction > 0 and self.tangent is None):
            raise ModelError(
                f"contact '{self.name}': friction is {self.friction:g}, must not be negative, and needs a tangent"
            )
        if not self.slips and self.friction == 0:
            raise ModelError(f"contact '{self.name}' may not slip, which needs friction")
        if not 0.0 <= self.restitution <= 1.0:
            raise ModelError(f"contact '{self.name}': restitution is {self.restitution:g}, must be from 0 to 1")


@partial(checked, exact=True)
@dataclass(frozen=True, eq=False)
class Mechanism:
    """M(q) dv/dt = force(q, v, u), dq/dt = configuration_derivative(q, v), without its contacts.

    Args:
        configuration, velocity, control, parameters: SX symbols q (n_q), v (n_v), u (n_u), p (n_p).
        mass_matrix: M, SX (n_v, n_v).
        force: SX (n_v).
        configuration_derivative: SX (n_q); v if omitted.
        configuration_names, velocity_names, control_names: one an entry; q0, v0, u0, ... if omitted.
        pace: speed of physical time, SX scalar in u, by which `force` and `configuration_derivative` are multiplied.
        further, further_rate: SX symbols of states behind the velocity, as a clock, and their derivatives.
        further_names: one an entry.
    """

    configuration: ca.SX
    velocity: ca.SX
    mass_matrix: ca.SX
    force: ca.SX
    control: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    parameters: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    configuration_derivative: ca.SX | None = None
    configuration_names: Sequence[str] = ()
    velocity_names: Sequence[str] = ()
    control_names: Sequence[str] = ()
    pace: ca.SX = field(default_factory=lambda: ca.SX(1))
    further: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    further_rate: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    further_names: Sequence[str] = ()

    @property
    def rate(self) -> ca.SX:
        """Derivative of q by numerical time."""
        return self.pace * (self.velocity if self.configuration_derivative is None else self.configuration_derivative)

    def __post_init__(self) -> None:
        n_q, n_v = self.configuration.numel(), self.velocity.numel()
        for name, symbol, count in (
            ("configuration_names", "q", n_q),
            ("velocity_names", "v", n_v),
            ("control_names", "u", self.control.numel()),
        ):
            if not getattr(self, name):
                object.__setattr__(self, name, [f"{symbol}{i}" for i in range(count)])
        check_shape("mass_matrix", self.mass_matrix, (n_v, n_v))
        check_shape("force", self.force, (n_v, 1))
        check_shape("configuration_derivative", self.rate, (n_q, 1))


@partial(checked, exact=True)
def with_contacts(
    mechanism: Mechanism,
    contacts: Sequence[UnilateralContact],
    *,
    gap: Literal["integrated", "true"] = "integrated",
    baumgarte_gain: float = 30.0,
    force_unit: float = 1.0,
) -> ComplementaritySystem:
    """Return a mechanism with unilateral contacts, whose velocity jumps by impulses.

    ``M v' = force + sum_c (lambda_n J_n + lambda_t J_t)`` with ``lambda_n = l_+ + l_-`` and
    ``lambda_t = mu (l_- - l_+)``, and at the left boundary of every element the same with impulses,
    ``M (v+ - v) = sum_c (Lambda_n J_n + Lambda_t J_t)``. All l are at least zero, and

    - ``0 <= p _|_ lambda_n >= 0``, in an element between all points;
    - friction opposes sliding, ``J_t v < 0 => l_+ = 0`` and ``J_t v > 0 => l_- = 0``, also with the impulses and v+;
    - an impulse acts where p = 0 and then by Newton's law, ``J_n v+ = -e J_n v``;
    - no force while approaching: ``J_n v+ < 0 => lambda_n = 0`` in the element. An impact takes an impulse. (G is the
      length that the approach takes in 1/kappa.)

    The cone of friction is spanned by its two edges l_+ and l_-, so a contact needs neither the slack of the cone nor a
    slip speed, which are unbounded in flight.

    The *integrated gap* p is a state with ``p' = J_n v + kappa (f_c - p)``, ``p(0) = f_c(q(0))``. The gap itself at
    the stages determines lambda_n by its second derivative, that of p by its first, which costs a scheme less of its
    order; and p = 0 at all points is the same as a normal velocity of zero at the stages. (Asking
    for both f_c = 0 and J_n v = 0 there has no solution.) kappa lets what p differs from the gap decay.

    Args:
        mechanism: without contacts.
        contacts: with different names.
        gap: ``integrated``; ``true`` is the published form, with f_c itself in the place of p and no state for it.
        baumgarte_gain: kappa, 1/s.
        force_unit: N, of l, which are forces multiplied by the pace of the mechanism.

    Returns:
        the system: x = (q, v, further states, p), or without p; z = (the gaps, then l_+ and l_- or lambda_n of every
        contact).

    Raises:
        DimensionError: an expression of the wrong shape.
        ModelError: two contacts of one name, or an unknown symbol.

    Source: Nurkanovic et al., arXiv 2305.17003, with forces and impulses on the edges of the cone and with p.
    """
    check_unique("contacts", [contact.name for contact in contacts])
    q, v, M = mechanism.configuration, mechanism.velocity, mechanism.mass_matrix
    n_q, n_v, n_c = q.numel(), v.numel(), len(contacts)
    for contact in contacts:
        for what, expression, shape in (("gap", contact.gap, (1, 1)), ("normal", contact.normal, (n_v, 1))):
            check_shape(f"contact '{contact.name}': {what}", expression, shape)
            check_content(f"contact '{contact.name}': {what}", expression, {"q": q})
    gaps, distance = ca.SX.sym("p", n_c if gap == "integrated" else 0), ca.SX.sym("distance", n_c)
    after, true_gaps = ca.SX.sym("v_after", n_v), ca.vertcat(ca.SX(0, 1), *[contact.gap for contact in contacts])
    forces = [Edges.of(contact, "l", force_unit) for contact in contacts]
    impulses = [Edges.of(contact, "L", 1.0) for contact in contacts]
    drifts = ca.vertsplit(baumgarte_gain * (true_gaps - gaps)) if gaps.numel() else [ca.SX(0)] * n_c
    normal = [ca.dot(contact.normal, v) + drift for contact, drift in zip(contacts, drifts, strict=True)]
    normal_after = [ca.substitute(one, v, after) for one in normal]
    state_names = [*mechanism.configuration_names, *mechanism.velocity_names, *mechanism.further_names]

    approach_time = 1.0 / max(baumgarte_gain, 1.0)
    conditions: list[Complementarity] = []
    for i, own in enumerate(forces):
        name = contacts[i].name
        pair = Label(FORCE_AT_A_DISTANCE, contact=name)
        approaching = Label(FORCE_WHILE_APPROACHING, contact=name)
        conditions += [
            Complementarity(pair, distance[i], own.normal),
            Complementarity(
                approaching,
                -approach_time * normal[i],
                own.normal,
                vanishing=True,
                level="velocity",
                held_at=HeldAt.LEFT_BOUNDARY,
            ),
            *own.against_sliding(FRICTION_ALONG_SLIDING, v),
            *own.against_slipping(v),
        ]
    jump = Jump(
        states=tuple(range(n_q, n_q + n_v)),
        after=after,
        algebraic=ca.vertcat(ca.SX(0, 1), *[edge for own in impulses for edge in own.edges]),
        residual=ca.mtimes(M, after - v) - _sum_of(impulses, n_v),
        impulses=tuple(
            Impulse(
                contact.name,
                i,
                impulses[i].normal,
                normal_after[i] + contact.restitution * normal[i],
                above_only=contact.restitution == 0.0,
            )
            for i, contact in enumerate(contacts)
        ),
        conditions=tuple(one for own in impulses for one in own.against_sliding(IMPULSE_ALONG_SLIDING, v)),
        algebraic_names=[f"impulse {name}" for own in impulses for name in own.names],
    )
    edges = [edge for own in forces for edge in own.edges]
    state, known_gaps = ca.vertcat(q, v, mechanism.further, gaps), gaps if gaps.numel() else true_gaps
    distances = ca.Function("distances", [state], [known_gaps])

    def guess(x: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        return np.concatenate([np.maximum(np.asarray(distances(x)).ravel(), 0.0), np.zeros(len(edges))])

    return ComplementaritySystem(
        state=state,
        control=mechanism.control,
        parameters=mechanism.parameters,
        algebraic=ca.vertcat(distance, *edges),
        mass_matrix=ca.diagcat(ca.SX.eye(n_q), M, ca.SX.eye(gaps.numel() + mechanism.further.numel())),
        right_hand_side=ca.vertcat(
            mechanism.rate,
            mechanism.pace * mechanism.force + _sum_of(forces, n_v),
            mechanism.further_rate,
            *[mechanism.pace * one for one in normal[: gaps.numel()]],
        ),
        residual=known_gaps - distance,
        algebraic_lower=np.zeros(n_c + len(edges)),
        algebraic_upper=np.full(n_c + len(edges), np.inf),
        regularisation=ca.SX(0),
        guess=guess,
        state_names=[*state_names, *[f"{contact.name} integrated gap" for contact in contacts][: gaps.numel()]],
        control_names=list(mechanism.control_names),
        algebraic_names=[
            *(f"{one.name} distance" for one in contacts),
            *(name for own in forces for name in own.names),
        ],
        complementarities=conditions,
        describe=lambda mode: _in_words(contacts, mode),
        jump=jump,
    )


@checked
def state_of(mechanism: Mechanism, contacts: Sequence[UnilateralContact], q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return the state x = (q, v, f_c(q)) of a mechanism with contacts.

    Args:
        mechanism, contacts: as in `with_contacts`.
        q, v: configuration (n_q) and velocity (n_v).

    Raises:
        DimensionError: q or v of another shape.
    """
    for name, values, symbols in (("q", q, mechanism.configuration), ("v", v, mechanism.velocity)):
        if np.shape(values) != (symbols.numel(),):
            raise DimensionError(f"{name} has shape {np.shape(values)}, expected ({symbols.numel()},)")
    gaps = ca.Function("gaps", [mechanism.configuration], [ca.vertcat(ca.SX(0, 1), *[one.gap for one in contacts])])
    return np.concatenate([q, v, np.asarray(gaps(q)).ravel()])


@dataclass(frozen=True, eq=False)
class Edges:
    """The force, or the impulse, of a contact by the edges of its cone.

    Attributes:
        contact: which.
        edges: l_+ and l_-; without friction the normal force alone.
        names: one an edge.
        unit: N, or N s.
    """

    contact: UnilateralContact
    edges: tuple[ca.SX, ...]
    names: tuple[str, ...]
    unit: float

    @classmethod
    def of(cls, contact: UnilateralContact, symbol: str, unit: float) -> Edges:
        """Return the variables of a contact."""
        sides = ("+", "-") if contact.friction > 0 else ("",)
        edges = tuple(ca.SX.sym(f"{symbol}{side}_{contact.name}") for side in sides)
        return cls(contact, edges, tuple(f"force{side}[{contact.name}]" for side in sides), unit)

    @property
    def normal(self) -> ca.SX:
        """Normal force, in its unit."""
        return sum(self.edges[1:], self.edges[0])

    @property
    def generalised(self) -> ca.SX:
        """The force in velocity space, (n_v)."""
        along = self.normal * self.contact.normal
        if self.contact.tangent is not None and len(self.edges) > 1:
            forwards, backwards = self.edges
            along += self.contact.friction * (backwards - forwards) * self.contact.tangent
        return self.unit * along

    def against_sliding(self, kind: str, velocity: ca.SX) -> list[Complementarity]:
        """Return the conditions that friction opposes a velocity, none without friction."""
        return self._of_sliding(kind, velocity, self.edges) if len(self.edges) > 1 else []

    def against_slipping(self, velocity: ca.SX) -> list[Complementarity]:
        """Return the conditions that a closed contact does not slip, none if it may."""
        return [] if self.contact.slips else self._of_sliding(SLIPPING, velocity, (self.normal, self.normal))

    def _of_sliding(self, kind: str, velocity: ca.SX, held: Sequence[ca.SX]) -> list[Complementarity]:
        assert self.contact.tangent is not None, self.contact.name
        sliding, about = ca.dot(self.contact.tangent, velocity), ((BACKWARDS, -1), (FORWARDS, 1))
        return [
            Complementarity(
                Label(kind, subject, self.contact.name), sign * sliding, H, vanishing=True, level="velocity"
            )
            for (subject, sign), H in zip(about, held, strict=True)
        ]


def _sum_of(forces: Sequence[Edges], n_v: int) -> ca.SX:
    return sum((own.generalised for own in forces), ca.SX.zeros(n_v))


def _in_words(contacts: Sequence[UnilateralContact], mode: np.ndarray) -> str:
    """Return which contacts are closed, and which were hit where the mode began."""
    closed = [one.name for one, active in zip(contacts, mode, strict=False) if active]
    hit = [one.name for one, active in zip(contacts, mode[len(contacts) :], strict=False) if active]
    words = ", ".join(f"{name} closed" for name in closed) or "no contact"
    return f"{words}, after an impact of {', '.join(hit)}" if hit else words
