"""Inelastic impacts: contacts push at the same rate with friction until none approaches."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from fesd_robot.recovery.contact_rows import by_contact, normal_rows, tangential_rows
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.replay.mode import Mode
from fesd_robot.replay.splits import widest_split

_PHASES = 100
"""Phases of one impact after which it counts as unfinished."""

_ZERO = 1e-12
"""Ratio of a velocity to the largest one of an impact, and of a rate to the largest one, that counts as zero."""


@dataclass(frozen=True)
class Impact:
    """What an impact does.

    Attributes:
        velocity: after it, (n_v).
        impulse: normal and tangential, N s, (n_c, 2).
        finished: whether no touching contact approaches any more.
    """

    velocity: np.ndarray
    impulse: np.ndarray
    finished: bool


def impact(physics: NumericPhysics, q: np.ndarray, v: np.ndarray, touching: np.ndarray) -> Impact:
    """Return velocity and impulses after an inelastic impact with Coulomb friction.

    The configuration stands still while impulses P grow, M dv = J^T dP. In units of the normal impulse of one
    approaching contact,

        J_n v < 0:  dP_n = 1
        J_n v = 0:  0 <= dP_n <= 1 and J_n dv = 0, or dP_n = 0 and J_n dv >= 0, or dP_n = 1 and J_n dv < 0
        dP_t = -mu sgn(J_t v) dP_n,  or |dP_t| <= mu dP_n and J_t dv = 0 where J_t v = 0

    Rates are constant until a velocity becomes zero, so every phase is exact.

    Args:
        physics: of the robot and its contacts.
        q, v: configuration (n_q) and velocity before (n_v).
        touching: contacts whose gap is closed, (n_c) of bool.

    Source: Nurkanovic et al., arXiv 2111.06759, section 3: the auxiliary dynamics of time freezing, as an impact law.
    """
    jacobian = physics.contact_jacobian(q)
    response = np.linalg.solve(physics.mass_matrix(q), jacobian.T)
    process = _Process(jacobian, jacobian @ response, physics.friction, np.asarray(touching))
    before = jacobian @ v
    velocity, impulse, finished = before.copy(), np.zeros(len(before)), False
    small = _ZERO * max(1.0, float(np.abs(before).max(initial=0.0)))
    for _ in range(_PHASES):
        velocity[np.abs(velocity) <= small] = 0.0
        finished = not bool((normal_rows(velocity)[process.touching] < 0).any())
        if finished:
            break
        rates = process.rates(velocity)
        if rates is None:
            break
        slope = process.compliance @ rates
        length, ending = process.next_zero(velocity, slope)
        if not np.isfinite(length):
            break
        velocity, impulse = velocity + length * slope, impulse + length * rates
        velocity[ending] = 0.0
    return Impact(v + response @ impulse, by_contact(impulse), finished)


@dataclass(frozen=True)
class _Process:
    """Rates of impulses at contact velocities J v, (2 n_c)."""

    jacobian: np.ndarray
    compliance: np.ndarray
    friction: np.ndarray
    touching: np.ndarray

    def next_zero(self, velocity: np.ndarray, slope: np.ndarray) -> tuple[float, int]:
        """Return the impulse at which a velocity of a touching contact becomes zero next, and its row."""
        heading = np.repeat(self.touching, 2) & (velocity * slope < 0)
        lengths = np.full(len(velocity), np.inf)
        lengths[heading] = -velocity[heading] / slope[heading]
        row = int(lengths.argmin())
        return float(lengths[row]), row

    def rates(self, velocity: np.ndarray) -> np.ndarray | None:
        """Return rates (2 n_c) that obey the law, or None if there are none."""
        options = [self._options(*self._of(velocity, i)) if on else [None] for i, on in enumerate(self.touching)]
        for choice in product(*options):
            rates = self._rates_of(choice)
            if self._allowed(choice, velocity, rates):
                return rates
        return None

    @staticmethod
    def _of(values: np.ndarray, i: int) -> tuple[float, float]:
        return float(normal_rows(values)[i]), float(tangential_rows(values)[i])

    @staticmethod
    def _options(normal: float, tangential: float) -> list[tuple[str, Mode] | None]:
        if normal > 0:
            return [None]
        slips = {1: [Mode.SLIP_FORWARDS], -1: [Mode.SLIP_BACKWARDS], 0: list(_TANGENTIAL)}[int(np.sign(tangential))]
        pushes = ["push"] if normal < 0 else ["hold", "push"]
        return [*([None] if normal == 0 else []), *((push, slip) for push in pushes for slip in slips)]

    def _rates_of(self, choice: tuple[tuple[str, Mode] | None, ...]) -> np.ndarray:
        """Return rates of pushing contacts and those that hold velocities of others at zero."""
        unit = np.eye(2 * len(choice))
        pushed = np.zeros(2 * len(choice))
        rows: list[int] = []
        columns: list[np.ndarray] = []
        bounds: list[np.ndarray] = []
        offsets: list[float] = []
        for i, chosen in enumerate(choice):
            if chosen is None:
                continue
            kind, slip = chosen
            direction = unit[2 * i] - self.friction[i] * slip.direction * unit[2 * i + 1]
            if kind == "push":
                pushed += direction
            else:
                rows.append(2 * i)
                columns.append(direction)
                bounds += [unit[2 * i], -unit[2 * i]]
                offsets += [0.0, 1.0]
            if slip is Mode.STICK:
                rows.append(2 * i + 1)
                columns.append(unit[2 * i + 1])
                bounds += [self.friction[i] * unit[2 * i] + sign * unit[2 * i + 1] for sign in (1.0, -1.0)]
                offsets += [0.0, 0.0]
        if not rows:
            return pushed
        spread, limits = np.array(columns).T, np.array(bounds)
        matrix, wanted = (self.compliance @ spread)[rows], -(self.compliance @ pushed)[rows]
        held = np.linalg.lstsq(matrix, wanted, rcond=1e-10)[0]
        held = widest_split(held, self.jacobian.T @ spread, limits @ spread, limits @ pushed + np.array(offsets))
        return np.asarray(pushed + spread @ held)

    def _allowed(self, choice: tuple[tuple[str, Mode] | None, ...], velocity: np.ndarray, rates: np.ndarray) -> bool:
        slope = self.compliance @ rates
        small_rate, small_slope = 1e3 * _ZERO, 1e3 * _ZERO * (1.0 + np.abs(self.compliance).max())
        for i, chosen in enumerate(choice):
            if not self.touching[i]:
                continue
            (normal, tangential), (rising, drifting) = self._of(velocity, i), self._of(slope, i)
            if chosen is None:
                if normal == 0 and rising < -small_slope:
                    return False
                continue
            kind, slip = chosen
            push, friction = self._of(rates, i)
            if kind == "push" and normal == 0 and rising >= -small_slope:
                return False
            if kind == "hold" and (not -small_rate <= push <= 1 + small_rate or abs(rising) > small_slope):
                return False
            if slip is Mode.STICK:
                if abs(friction) > self.friction[i] * push + small_rate or abs(drifting) > small_slope:
                    return False
            elif tangential == 0 and self.friction[i] > 0 and slip.direction * drifting <= small_slope:
                return False
        return True


_TANGENTIAL = (Mode.STICK, Mode.SLIP_FORWARDS, Mode.SLIP_BACKWARDS)
