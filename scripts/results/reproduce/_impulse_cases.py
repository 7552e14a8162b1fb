"""Mechanisms with unilateral contacts whose motions are known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp

from fesd_robot.dcs import ComplementaritySystem, Mechanism, UnilateralContact, state_of, with_contacts
from fesd_robot.fesd import FesdOptions, Simulation, make_tableau, simulate

GRAVITY = 9.81


@dataclass(frozen=True)
class ContactCase:
    """A mechanism with contacts from a given start.

    Attributes:
        system: the mechanism with its contacts.
        initial: x(0), (n_x).
        duration: of the motion.
    """

    system: ComplementaritySystem
    initial: np.ndarray
    duration: float

    def run(self, scheme: str, steps: int, elements: int = 2) -> Simulation:
        """Simulate with a scheme named like ``radau_iia 3``, with its number of stages."""
        family, stages = scheme.split()
        options = FesdOptions(make_tableau(family, int(stages)), elements=elements)
        return simulate(self.system, self.initial, steps, self.duration, options=options)


def two_balls() -> ContactCase:
    """Two balls of radius 0.2 on a vertical line with a spring between them; the lower one hits the ground, e = 0.8.

    Source: Nurkanovic et al., arXiv 2305.17003, section 5.1.
    """
    q, v = ca.SX.sym("q", 2), ca.SX.sym("v", 2)
    spring = 1e4 * (q[1] - q[0] - 1.0)
    mechanism = Mechanism(q, v, ca.SX.eye(2), ca.vertcat(spring - GRAVITY, -spring - GRAVITY))
    contacts = [UnilateralContact("ball", q[0] - 0.2, ca.SX([1, 0]), restitution=0.8)]
    return _case(mechanism, contacts, ((1.0, 2.0), (0.0, 0.0)), 1.0)


def bouncing_ball(height: float, restitution: float, duration: float) -> ContactCase:
    """A ball that is dropped."""
    q, v = ca.SX.sym("q"), ca.SX.sym("v")
    mechanism = Mechanism(q, v, ca.SX.eye(1), ca.SX(-GRAVITY))
    contacts = [UnilateralContact("ball", q, ca.SX(1), restitution=restitution)]
    return _case(mechanism, contacts, ((height,), (0.0,)), duration)


def thrown_mass() -> ContactCase:
    """A mass thrown flat, with friction 0.3: it lands, slides and comes to rest."""
    q, v = ca.SX.sym("q", 2), ca.SX.sym("v", 2)
    mechanism = Mechanism(q, v, ca.SX.eye(2), ca.SX([0, -10]))
    contacts = [UnilateralContact("mass", q[1], ca.SX([0, 1]), ca.SX([1, 0]), friction=0.3)]
    return _case(mechanism, contacts, ((0.0, 1.0), (4.0, 0.0)), 3.0)


def bead(gap: Literal["integrated", "true"]) -> ContactCase:
    """A bead in a round bowl of radius 1 that slides from 1 rad: contact that lasts, along a curved gap."""
    q, v = ca.SX.sym("q", 2), ca.SX.sym("v", 2)
    distance = ca.norm_2(q)
    mechanism = Mechanism(q, v, ca.SX.eye(2), ca.SX([0, -GRAVITY]))
    contacts = [UnilateralContact("bead", 1 - distance, -q / distance)]
    initial = state_of(mechanism, contacts, np.array([np.sin(1.0), -np.cos(1.0)]), np.zeros(2))
    system = with_contacts(mechanism, contacts, gap=gap)
    return ContactCase(system, initial[: system.state.numel()], 1.5)


def bead_end() -> tuple[np.ndarray, np.ndarray, float]:
    """Return position, velocity and force of the bead at the end, by the equation of the pendulum."""

    def rate(_: float, state: np.ndarray) -> list[float]:
        return [state[1], -GRAVITY * np.sin(state[0])]

    angle, speed = solve_ivp(rate, (0.0, 1.5), [1.0, 0.0], method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    inward = np.array([np.sin(angle), -np.cos(angle)])
    return inward, speed * np.array([np.cos(angle), np.sin(angle)]), speed**2 + GRAVITY * np.cos(angle)


def _case(
    mechanism: Mechanism,
    contacts: Sequence[UnilateralContact],
    start: tuple[tuple[float, ...], tuple[float, ...]],
    duration: float,
) -> ContactCase:
    q, v = (np.array(part) for part in start)
    return ContactCase(with_contacts(mechanism, contacts), state_of(mechanism, contacts, q, v), duration)
