"""Exactness: what counts as zero, as the same value, and as an exact solution, wherever that is asked."""

from __future__ import annotations

LAST_BITS = 1e-15
"""Of one, or of the largest entry: what double precision leaves of a zero or a one."""

ROUNDED = 1e-9
"""In SI units, or of the largest of its kind: a smaller difference is rounding. Places that are nearer are one, a value
that is less beyond its limit is on it, and what moves less is at rest."""

WRITTEN = 1e-6
"""In SI units: the same of values that follow from those of a file or a task, which are written in six digits or so."""

NO_VELOCITY = 1e-6
"""m/s or rad/s; a smaller change of a velocity is no impact, and a smaller velocity has no direction."""

SINGULAR = 1e-10
"""Ratio of singular values that counts as zero, where it is asked what is redundant."""

SINGULAR_STEP = 1e-12
"""The same in steps of Newton's method and in linear systems that hold exactly: there a large step is better than an
equation that is left out."""

NO_LENGTH = 1e-9
"""m; added to a length in squares, so that it has a derivative at zero; below round-off everywhere else."""

NO_SQUARE = 1e-12
"""m2, or without unit; added to sums of squares and higher powers in rows of an NLP for the same reason: larger than
`NO_LENGTH`, for their second derivatives at zero grow with its inverse, and they may be zero at a solution."""

FEASIBLE = 1e-8
"""Largest violation of constraints of a solution, in their units."""

EXACT_PRODUCT = 1e-12
"""Largest product of a pair at an exact point, or largest smaller side: with a force of 10 N a gap of 1e-12 m has a
product of 1e-11."""

ZERO_PRODUCT = 1e-14
"""Product of a pair by which a certificate tells which sides of an exact solution are zero: those up to 1e-8, the root
of it over ten. That is less than `EXACT_PRODUCT`, which accepts points: a side that its branch holds at zero is zero to
round-off, and a force or a gap of 1e-7 that it does not hold is one."""

SAME_COST = 1e-7
"""Of the cost, relative to the larger of it and one: a smaller difference is none."""
