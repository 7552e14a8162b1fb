"""Kinds of the conditions of a contact, and the directions that are their subjects."""

from fesd_robot.dcs import BACKWARDS, FORCE_AT_A_DISTANCE, FORWARDS, FRICTION_ALONG_SLIDING, SLIPPING

__all__ = ["BACKWARDS", "FORCE_AT_A_DISTANCE", "FORWARDS", "FRICTION_ALONG_SLIDING", "SLIPPING"]

FORCE_WHILE_PARTING = "force while parting"
MOTION_DURING_IMPACT = "motion during impact"

RESTITUTION = "restitution"
FRICTION_AFTER_IMPACT = "friction after impact"
"""Of contacts that bounce, besides those above."""

SLIDING_INSIDE_CONE = "sliding inside the friction cone"
FRICTION_ACROSS_SLIDING = "friction across sliding"
FRICTION_WITH_SLIDING = "friction with sliding"
"""In space instead of `FRICTION_ALONG_SLIDING`."""

SLIDING_INSIDE_SURFACE = "sliding inside the limit surface"
FRICTION_AGAINST_SLIDING = "friction against sliding"
"""Of objects that rub on a table."""

COMPLIANT_FORCE = "compliant force at a distance"
"""Of contacts that give way."""

ONE_AT_A_TIME = "one set of controls at a time"
"""Of controls of which one set acts at a time."""

LEFTWARDS, RIGHTWARDS = "leftwards", "rightwards"

DIRECTIONS = ((FORWARDS, BACKWARDS), (LEFTWARDS, RIGHTWARDS))
"""Along and against every tangent: the first lies in the x-z plane, the second points along +y."""
