"""How much a replay of one control interval may take."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Budget:
    """Budget of a replay, and the part of it that is spent.

    Attributes:
        most_events: events, bounces left out, after which it no longer looks for more.
        most_bounces: the same of bounces, which come to an end by themselves: from 3 m/s with a restitution of 0.99
            there are 800.
        most_steps: of the integrator, after which it ends: an interval takes 5 to 100, and thousands where rigid bodies
            have no motion that goes on (Painleve).
        steps_of_a_bounce: what a bounce adds to them.
        events, bounces, steps: so far, bounces among the events.
    """

    most_events: int = 50
    most_bounces: int = 2000
    most_steps: int = 2000
    steps_of_a_bounce: int = 50
    events: int = 0
    bounces: int = 0
    steps: int = 0

    @property
    def watching(self) -> bool:
        """Whether it still looks for events."""
        return self.events - self.bounces < self.most_events and self.bounces < self.most_bounces

    @property
    def over(self) -> bool:
        """Whether there are no steps left."""
        return self.steps >= self.most_steps + self.steps_of_a_bounce * self.bounces
