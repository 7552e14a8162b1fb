"""A plan driven again: rigid bodies with Coulomb friction, event by event, knowing nothing of how it was planned."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fesd_robot.lazy import lazy_exports

__all__ = [
    "CLOSED_GAP",
    "Budget",
    "ContactDynamics",
    "ContactLaw",
    "Contacts",
    "Event",
    "Impact",
    "IntervalReplay",
    "MotionReplay",
    "ReplayNote",
    "Segments",
    "States",
    "contact_dynamics",
    "each_first",
    "events_along",
    "impact",
    "is_proper",
    "motion_in_modes",
    "rebounds",
    "replay_intervals",
    "slip_headings",
]

if TYPE_CHECKING:
    from fesd_robot.replay.budget import Budget
    from fesd_robot.replay.contacts import CLOSED_GAP, ContactLaw, Contacts, ReplayNote
    from fesd_robot.replay.dynamics import ContactDynamics, contact_dynamics
    from fesd_robot.replay.event import Event
    from fesd_robot.replay.headings import slip_headings
    from fesd_robot.replay.impact_orders import each_first
    from fesd_robot.replay.impacts import Impact, impact, rebounds
    from fesd_robot.replay.integrator import Segments, States, events_along
    from fesd_robot.replay.intervals import IntervalReplay, MotionReplay, replay_intervals
    from fesd_robot.replay.modes import is_proper, motion_in_modes
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "fesd_robot.replay.budget": ["Budget"],
            "fesd_robot.replay.contacts": ["CLOSED_GAP", "ContactLaw", "Contacts", "ReplayNote"],
            "fesd_robot.replay.dynamics": ["ContactDynamics", "contact_dynamics"],
            "fesd_robot.replay.event": ["Event"],
            "fesd_robot.replay.headings": ["slip_headings"],
            "fesd_robot.replay.impact_orders": ["each_first"],
            "fesd_robot.replay.impacts": ["Impact", "impact", "rebounds"],
            "fesd_robot.replay.integrator": ["Segments", "States", "events_along"],
            "fesd_robot.replay.intervals": ["IntervalReplay", "MotionReplay", "replay_intervals"],
            "fesd_robot.replay.modes": ["is_proper", "motion_in_modes"],
        },
    )
