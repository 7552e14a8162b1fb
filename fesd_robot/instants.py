"""Instants: up to which difference two times are one, for grids, motions, plans, replay, exports and figures."""

from __future__ import annotations

SAME_TIME = 1e-9
"""s; times of one motion that are computed in two ways, as the end of an element and the impact there, are one up to
this difference. An element whose clock advances by less takes no time."""

SAME_EVENT = 1e-6
"""s; the same of times that are solved for to a tolerance, or meant by people: the clock of a plan stands still in an
impact, and never steps back, only nearly; events that nobody can tell apart are one."""

SAME_PART = 1e-9
"""Of a duration or of an interval: `SAME_TIME` where lengths are those of a problem, of whatever unit."""

SAME_NODE = 1e-6
"""Of a duration or of an interval: `SAME_EVENT` there, for nodes of a grid at times that a task asks for."""

WRITTEN_NODE = 1e-3
"""Of an interval: a time that is written in few digits, 0.333 s, is the node that it is this near to."""
