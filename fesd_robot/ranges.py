"""Ranges: up to where the package computes, which tasks are held to before anything is computed."""

from __future__ import annotations

MAX_STAGES = 9
"""Most stages of a Runge-Kutta scheme."""

STEEPEST = 20.0
"""Largest |dh/dx| of a ground: a face of 87 degrees. Steeper ones are walls, whose normals are exact."""
