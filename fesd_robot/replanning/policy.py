"""What a robot does until the next plan: controls, the motion that they belong to, and feedback around it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from fesd_robot.contact import ContactMode
from fesd_robot.fesd.schemes import lagrange
from fesd_robot.instants import SAME_TIME

LANDING = 0.03
"""s before a landing is due from which on a contact lands that was never seen off."""


@dataclass(frozen=True)
class ContactEvent:
    """A contact that begins to touch, leaves, sticks or slides at a time, s."""

    time: float
    contact: str
    kind: str


def landing(modes: Sequence[ContactMode], later: Sequence[ContactMode]) -> list[int]:
    """Return the numbers of the contacts that land between two phases."""
    return [
        i for i, (now, then) in enumerate(zip(modes, later, strict=True)) if now is ContactMode.FLIGHT and then.closed
    ]


class FeedbackGains:
    """Gains of a plan by the phase in which they are needed.

    Args:
        time: of the gains in the plan, s, (m), not decreasing.
        gain: (m, n_u, 2 n_v).
        ends: when the phases of the plan begin and end, s, (P + 1).
    """

    def __init__(self, time: np.ndarray, gain: np.ndarray, ends: np.ndarray) -> None:
        self._time, self._gain, self._ends = time, gain, ends

    def at(self, phase: int, share: float) -> np.ndarray:
        """Return the gain in a phase of the plan, at a share of its duration, (n_u, 2 n_v); phases repeat behind it."""
        phase %= len(self._ends) - 1
        begin, end = self._ends[phase], self._ends[phase + 1]
        time = begin + min(max(share, 0.0), 1.0 - SAME_TIME) * (end - begin)
        return self._gain[max(int(np.searchsorted(self._time, time, side="right")) - 1, 0)]


@dataclass(frozen=True)
class Policy:
    """A motion from now on, with feedback.

    Attributes:
        begin: time from which on it is meant, s; valid_until: about how long.
        events: what contacts do, in the order of time.
        status: where it comes from: ``kept``, the sequence of the plan; ``changed``, that of another plan, which it
            begins; ``old``, an earlier policy goes on.
        reason: of an old one, why.
    """

    begin: float
    valid_until: float
    events: tuple[ContactEvent, ...]
    status: str
    reason: str
    _begins: np.ndarray
    _ends: np.ndarray
    _phases: np.ndarray
    _nodes: np.ndarray
    _values: np.ndarray
    _controls: np.ndarray
    _modes: tuple[tuple[ContactMode, ...], ...]
    _phase_ends: np.ndarray
    _first_phase: int
    _gains: FeedbackGains
    _flown: np.ndarray
    _patience: float
    _limits: tuple[np.ndarray, np.ndarray]
    _sizes: tuple[int, int]
    _model: pin.Model | None

    def action(
        self, time: float, configuration: np.ndarray, velocity: np.ndarray, contacts: np.ndarray | None = None
    ) -> np.ndarray:
        """Return the controls, N or N m, (n_u): u_ref - K (q (-) q_ref, v - v_ref), within their limits.

        Args:
            time: since the start of the plan, s.
            configuration, velocity: q, (n_q), and v, (n_v), in Pinocchio's order.
            contacts: which contacts touch, (n_c) of bool; where those of the next phase do, it has begun, and as long
                as they do not, it has not. Default: it begins when it is due.
        """
        element, reference, speed = self._at(time, contacts)
        n_v, error = self._sizes[1], np.empty(2 * self._sizes[1])
        if self._model is None:
            error[:n_v] = configuration - reference
        else:
            error[:n_v] = pin.difference(self._model, reference, configuration)
        error[n_v:] = velocity - speed
        control = self._controls[element] - self._gain(element, time) @ error
        return np.minimum(np.maximum(control, self._limits[0]), self._limits[1])

    def reference(self, time: float, contacts: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Return q, (n_q), and v, (n_v), of the motion at a time, s."""
        return self._at(time, contacts)[1:]

    @property
    def controls(self) -> tuple[np.ndarray, np.ndarray]:
        """Times at which controls begin and at which the last one ends, s, (n + 1), and the controls, (n, n_u)."""
        return np.append(self._begins, self._ends[-1]), self._controls

    def mode(self, time: float) -> tuple[ContactMode, ...]:
        """Return what every contact does at a time, s."""
        phase = int(np.searchsorted(self._phase_ends[1:-1], time, side="right"))
        return self._modes[phase]

    def _at(self, time: float, contacts: np.ndarray | None) -> tuple[int, np.ndarray, np.ndarray]:
        """Return the element that is followed, and the reference, which goes on at constant velocity around it."""
        element = max(int(np.searchsorted(self._begins, time, side="right")) - 1, 0)
        if contacts is not None:
            element = self._with_contacts(element, time, contacts)
        begin, end = self._begins[element], self._ends[element]
        inside = min(max(time, begin), end)
        share = (inside - begin) / (end - begin)
        state = lagrange(self._nodes, np.array([share]))[0] @ self._values[element]
        n_q, n_v = self._sizes
        q, v = state[:n_q], state[n_q : n_q + n_v]
        beyond = time - inside
        if beyond and element + 1 == len(self._begins):
            return element, q, np.zeros(n_v)
        if self._model is not None:
            return element, np.asarray(pin.integrate(self._model, pin.normalize(self._model, q), beyond * v)), v
        return element, q + beyond * v, v

    def _with_contacts(self, element: int, time: float, contacts: np.ndarray) -> int:
        """Return the element of the running phase or of the next one, by which contacts touch."""
        lands = landing(*self._modes[:2]) if len(self._modes) > 1 else []
        if not lands:
            return element
        first = int((self._phases == self._first_phase).sum())
        touching = bool(np.asarray(contacts)[lands].all())
        landed = touching and (bool(self._flown[lands].all()) or time >= self._phase_ends[1] - LANDING)
        if landed or time >= self._phase_ends[1] + self._patience:
            return max(element, first)
        return min(element, first - 1)

    def _gain(self, element: int, time: float) -> np.ndarray:
        phase = int(self._phases[element])
        begin, end = self._phase_ends[phase - self._first_phase : phase - self._first_phase + 2]
        return self._gains.at(phase, (time - begin) / max(end - begin, SAME_TIME))
