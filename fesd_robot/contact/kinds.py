"""Kinds of the vanishing constraints of a contact, and the directions that are their subjects."""

FORCE_AT_A_DISTANCE = "force at a distance"
FORCE_WHILE_PARTING = "force while parting"
MOTION_DURING_IMPACT = "motion during impact"
FRICTION_ALONG_SLIDING = "friction along sliding"
SLIPPING = "slipping"

RESTITUTION = "restitution"
FRICTION_AFTER_IMPACT = "friction after impact"
"""Of contacts that bounce, besides those above."""

SLIDING_INSIDE_CONE = "sliding inside the friction cone"
FRICTION_ACROSS_SLIDING = "friction across sliding"
FRICTION_WITH_SLIDING = "friction with sliding"
"""In space instead of `FRICTION_ALONG_SLIDING`."""

FORWARDS, BACKWARDS = "forwards", "backwards"
LEFTWARDS, RIGHTWARDS = "leftwards", "rightwards"

DIRECTIONS = ((FORWARDS, BACKWARDS), (LEFTWARDS, RIGHTWARDS))
"""Along and against every tangent: the first lies in the x-z plane, the second points along +y."""
