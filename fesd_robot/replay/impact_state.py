"""How far an impact has come: velocities, impulses, and the restitution that is left."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fesd_robot.recovery import normal_rows


@dataclass(frozen=True)
class ImpactState:
    """How far an impact has come.

    Attributes:
        velocity: J v, the normal velocity of every contact less its rebound: negative where it is not done,
            (rows n_c).
        impulse: N s, (rows n_c).
        rebound: normal velocity with which a contact has to part, m/s, (n_c); 0 without restitution.
        work: of the normal force of every contact so far, J, (n_c).
    """

    velocity: np.ndarray
    impulse: np.ndarray
    rebound: np.ndarray
    work: np.ndarray

    @classmethod
    def of(cls, before: np.ndarray, rebound: np.ndarray, rows: int) -> ImpactState:
        """Return the state at the beginning, given J v and the rebounds."""
        velocity = before.copy()
        normal_rows(velocity, rows)[:] -= rebound
        return cls(velocity, np.zeros(len(before)), rebound, np.zeros(len(rebound)))

    def advanced(self, rates: np.ndarray, slope: np.ndarray, length: float, rows: int) -> ImpactState:
        """Return the state after a length in which impulses and velocities grow at given rates."""
        velocity = self.velocity + length * slope
        mean = 0.5 * normal_rows(self.velocity + velocity, rows) + self.rebound
        work = self.work + length * normal_rows(rates, rows) * mean
        return replace(self, velocity=velocity, impulse=self.impulse + length * rates, work=work)

    def spent(self, contact: int, rows: int) -> ImpactState:
        """Return the state in which a contact has no restitution left."""
        velocity, rebound = self.velocity.copy(), self.rebound.copy()
        normal_rows(velocity, rows)[contact] += rebound[contact]
        rebound[contact] = 0.0
        return replace(self, velocity=velocity, rebound=rebound)

    def lengths_to_spend(self, rates: np.ndarray, slope: np.ndarray, rows: int) -> np.ndarray:
        """Return after which length the work of every contact with a rebound rises through zero, (n_c); infinite if
        never: the root of work + rate (v s + slope s^2 / 2)."""
        rate = normal_rows(rates, rows)
        square, linear = 0.5 * rate * normal_rows(slope, rows), rate * (normal_rows(self.velocity, rows) + self.rebound)
        under_root = linear**2 - 4.0 * square * self.work
        lengths = np.full(len(rate), np.inf)
        for i in np.flatnonzero((self.rebound > 0) & (rate > 0) & (under_root >= 0)).tolist():
            root = float(np.sqrt(under_root[i]))
            if linear[i] > 0:
                lengths[i] = -2.0 * self.work[i] / (linear[i] + root)
            elif square[i] > 0:
                lengths[i] = (root - linear[i]) / (2.0 * square[i])
        return lengths
