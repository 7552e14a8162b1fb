"""How much a replay of one control interval may take."""

from __future__ import annotations

from dataclasses import dataclass

MOST_EVENTS = 50
"""Events of one replay, bounces left out, after which it no longer looks for more."""

MOST_BOUNCES = 2000
"""The same of bounces, which come to an end by themselves: from 3 m/s with a restitution of 0.99 there are 800."""

MOST_STEPS = 2000
"""Steps of one replay after which it ends: an interval takes 5 to 100, and thousands where rigid bodies have no motion
that goes on (Painleve)."""

STEPS_OF_A_BOUNCE = 50
"""Steps that a bounce adds to them."""


@dataclass
class Budget:
    """What a replay has taken: events, bounces among them, and steps of the integrator."""

    events: int = 0
    bounces: int = 0
    steps: int = 0

    @property
    def watching(self) -> bool:
        """Whether it still looks for events."""
        return self.events - self.bounces < MOST_EVENTS and self.bounces < MOST_BOUNCES

    @property
    def over(self) -> bool:
        """Whether there are no steps left."""
        return self.steps >= MOST_STEPS + STEPS_OF_A_BOUNCE * self.bounces
