"""Values of the search for the modes of a step: its input, sequences of modes, wrong signs, its result."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fesd_robot.fesd.modes import Modes


@dataclass(frozen=True)
class StepInput:
    """Input of a simulation step: point (x, z), control u, parameters p, length."""

    x: np.ndarray
    z: np.ndarray
    u: np.ndarray
    p: np.ndarray
    length: float


@dataclass(frozen=True)
class FoundModes:
    """A solved interval: own variables, modes, largest residual, and the work done."""

    own: np.ndarray
    modes: Modes
    residual: float
    trials: int
    iterations: int


@dataclass(frozen=True)
class ModeSequence:
    """Modes that follow each other, with the estimated times at which they end, as fractions of the step."""

    modes: tuple[tuple[bool, ...], ...]
    ends: tuple[float, ...]


@dataclass(frozen=True)
class Violation:
    """The first wrong sign of a trial.

    Attributes:
        cell: element (or stage without switch detection).
        entering, leaving: pairs whose G, or whose H, is negative there.
        time: estimated zero, as a fraction of the step.
        immediate: whether the sign is wrong from the beginning of the mode.
    """

    cell: int
    entering: np.ndarray
    leaving: np.ndarray
    time: float
    immediate: bool
