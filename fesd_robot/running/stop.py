"""The wish of a user to end what runs."""

from __future__ import annotations

from collections.abc import Callable

Stop = Callable[[int, float], bool]
"""(iteration, objective) -> whether the user wants the solve to end."""


def stop_requested(stop: Stop | None) -> bool:
    """Return whether the user wants to stop while no solver of this process is running."""
    return stop is not None and stop(0, float("nan"))
