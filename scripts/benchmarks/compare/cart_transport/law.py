"""The motion of cart and cargo in closed form, which judges the controls of all tools alike.

State (x_cart, x_cargo, v_cart, v_cargo). Under a constant force u on the cart the two move together as long as the
force that this needs is within friction, m u / (m + M) <= F; else the cargo slides and friction is F.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

CARGO, CART = 0.1, 0.2  # kg
FRICTION = 0.2 * CARGO * 9.81  # N, largest
DURATION = 6.0  # s
GOAL = np.array([0.0, 1.0, 0.0, 0.0])
ARRIVED = 0.01
"""m and m/s from the goal, IMPACT's own test."""

SAME_SPEED = 1e-12  # m/s


@dataclass
class Ride:
    """A motion from a state on.

    Attributes:
        state: where it is, (4).
        cost: int u^2 + (v_cargo - v_cart)^2 dt so far.
        farthest: largest distance of the cargo from where it began on the cart's middle, m.
    """

    state: np.ndarray
    cost: float = 0.0
    farthest: float = 0.0

    def advance(self, force: float, duration: float) -> None:
        """Go on under a constant force on the cart, N, for a time, s."""
        left = duration
        while left > 0:
            left -= self._piece(force, left)

    def _piece(self, force: float, left: float) -> float:
        """Go on until a slide ends, or to the end; return how long it took."""
        x, v = self.state[:2], self.state[2:]
        slide = v[1] - v[0]
        needed = CARGO * force / (CARGO + CART)
        sticks = abs(slide) <= SAME_SPEED and abs(needed) <= FRICTION
        if sticks:
            friction = needed
        elif abs(slide) <= SAME_SPEED:
            friction = float(np.sign(needed)) * FRICTION
        else:
            friction = -float(np.sign(slide)) * FRICTION
        a = np.array([(force - friction) / CART, friction / CARGO])
        change = a[1] - a[0]
        stops = abs(slide) > SAME_SPEED and slide * change < 0 and -slide / change <= left
        span = -slide / change if stops else left
        end = v + span * a
        if stops or sticks:
            end[:] = (CART * end[0] + CARGO * end[1]) / (CART + CARGO)
        after = end[1] - end[0]
        self.cost += span * (force**2 + (slide**2 + slide * after + after**2) / 3)
        self.state = np.concatenate([x + span * v + 0.5 * span**2 * a, end])
        self.farthest = max(self.farthest, abs(self.state[1] - self.state[0]))
        return float(span)

    @property
    def errors(self) -> tuple[float, float]:
        """Distance from the goal, m and m/s."""
        difference = self.state - GOAL
        return float(np.linalg.norm(difference[:2])), float(np.linalg.norm(difference[2:]))

    @property
    def arrived(self) -> bool:
        """Whether it is at the goal."""
        return max(self.errors) < ARRIVED


def ridden(start: np.ndarray, controls: Iterable[tuple[float, float]]) -> Ride:
    """Return the motion under controls, pairs of a force, N, and how long it holds, s."""
    ride = Ride(np.array(start, dtype=float))
    for force, duration in controls:
        ride.advance(force, duration)
    return ride


def starts(count: int) -> list[np.ndarray]:
    """Return disturbed starts: both bodies moved by up to 5 cm, with a common speed of up to 0.1 m/s."""
    result = []
    for seed in range(count):
        random = np.random.default_rng(seed)
        speed = random.uniform(-0.1, 0.1)
        result.append(np.array([*random.uniform(-0.05, 0.05, 2), speed, speed]))
    return result
