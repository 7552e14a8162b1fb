"""Which modes a motion can follow from a point: H and the derivatives of G there, with hidden constraints."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import casadi as ca
import numpy as np

from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.exactness import SINGULAR
from fesd_robot.fesd.adaptive.compiled import DenseFunction
from fesd_robot.fesd.groups import PairGroups

MAX_COMBINATIONS = 81
"""Modes of a point that are all looked at; of more, those are that pivoting leads to."""

SIGN = 1e-7
"""How negative an H, or a derivative of G in units of the largest rate, may be at a point."""


INCONSISTENT = 3e-6
"""Largest residual of a mode that fits a point."""

STARTS = (0.1, 0.5, 0.9)
"""Values of H from which the modes of intersecting surfaces are solved."""

Point = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""State, control, algebraic variables and parameters."""


@dataclass(frozen=True)
class PointMode:
    """A mode at a point.

    Attributes:
        mode: (n_pairs) booleans, where G stays zero.
        z: algebraic variables, (n_z).
        rate: dx/dt, (n_x).
        H: (n_pairs).
        G_rate: dG/dt, (n_pairs), in units of the largest rate.
        consistent: whether the mode's equations hold there.
        nonlinear: whether Newton's method took its time, so that there may be other solutions.
    """

    mode: np.ndarray
    z: np.ndarray
    rate: np.ndarray
    H: np.ndarray
    G_rate: np.ndarray
    consistent: bool
    nonlinear: bool

    def right(self, closed: np.ndarray) -> bool:
        """Return whether all signs are right: H, and dG/dt of the closed pairs that are not active."""
        return self.consistent and not self.wrong(closed).any()

    def wrong(self, closed: np.ndarray) -> np.ndarray:
        """Return the pairs with a wrong sign, (n_pairs) booleans."""
        return np.where(self.mode, self.H < -SIGN, closed & (self.G_rate < -SIGN))


@dataclass(frozen=True, eq=False)
class PointModes:
    """The modes of single points.

    In a mode the rows ``r = (g, e, m G + (1 - m) H) = 0`` hold. Where they do not determine z (sliding modes), the
    hidden constraint ``P (dr/dx) x' = 0`` does, with P the projection on the left null space of ``dr/dz``. The
    derivative of G follows from ``(dr/dx) x' + (dr/dz) z' = 0``.

    Args:
        system: the dynamics, without vanishing constraints; linear in the multipliers G.
    """

    system: ComplementaritySystem

    @classmethod
    def of(cls, system: ComplementaritySystem) -> PointModes:
        """Return the modes of a system, whose functions are compiled once."""
        return system.compiled.setdefault(cls, cls(system))

    @cached_property
    def groups(self) -> PairGroups:
        """The pairs in groups that decide together."""
        return PairGroups(self.system)

    @cached_property
    def _function(self) -> DenseFunction:
        system = self.system
        n_z = system.algebraic.numel()
        m, P = ca.SX.sym("m", len(system.pairs)), ca.SX.sym("P", n_z, n_z)
        rows = ca.vertcat(system.residual, system.equations, m * system.G + (1 - m) * system.H)
        rate = ca.solve(system.mass_matrix, system.right_hand_side)
        by_x, z = ca.jacobian(rows, system.state), system.algebraic
        moved = ca.mtimes(by_x, rate)
        hidden = ca.mtimes(P, moved)
        results = [
            rows, ca.jacobian(rows, z), hidden, ca.jacobian(hidden, z), rate, moved, system.G, system.H,
            ca.jacobian(system.G, z), ca.jacobian(system.H, z), by_x,
        ]  # fmt: skip
        return DenseFunction("point", [*system.arguments, m, ca.vec(P)], results)

    def sides(self, x: np.ndarray, u: np.ndarray, z: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return G and H at a point."""
        n_z = len(z)
        results = self._function(x, u, z, p, np.zeros(len(self.system.pairs)), np.zeros(n_z * n_z))
        return results[6].copy(), results[7].copy()

    @cached_property
    def _projections(self) -> dict[bytes, tuple[np.ndarray, np.ndarray]]:
        """Mode -> dr/dz and the projection on its left null space, of the last point."""
        return {}

    def solve(self, x: np.ndarray, u: np.ndarray, z: np.ndarray, p: np.ndarray, mode: np.ndarray) -> PointMode:
        """Return a mode at a point, its z by Newton's method from a given one."""
        m, n_z = mode.astype(float), len(z)
        nothing = np.zeros(n_z * n_z)
        z, known = z.copy(), self._projections
        iterations = 0
        for _ in range(12):
            iterations += 1
            by_z = self._function(x, u, z, p, m, nothing)[1]
            if mode.tobytes() not in known or not np.array_equal(known[mode.tobytes()][0], by_z):
                known[mode.tobytes()] = (by_z.copy(), _left_null_space(by_z))
            projection = known[mode.tobytes()][1]
            rows, by_z, hidden, hidden_z, rate, *_ = self._function(x, u, z, p, m, projection)
            scale = 1.0 + float(np.abs(rate).max())
            matrix, right = np.vstack([by_z, hidden_z / scale]), np.concatenate([rows, hidden / scale])
            if not np.isfinite(matrix).all() or not np.isfinite(right).all():
                break
            step = np.linalg.lstsq(matrix, right, rcond=SINGULAR)[0]
            z -= step
            if np.abs(step).max() <= 1e-13 * (1.0 + np.abs(z).max()):
                break
        rows, by_z, hidden, _, rate, moved, _, H, G_z, *_ = self._function(x, u, z, p, m, projection)
        scale = float(np.abs(rate).max()) + 1e-300
        z_rate = np.linalg.lstsq(by_z, -moved, rcond=SINGULAR)[0] if np.isfinite(by_z).all() else np.zeros(n_z)
        off = max(float(np.abs(rows).max()), float(np.abs(hidden).max()) / (1.0 + scale))
        return PointMode(
            mode.copy(), z, rate.copy(), H.copy(), G_z @ z_rate / scale, bool(off <= INCONSISTENT),
            nonlinear=iterations > 3,
        )  # fmt: skip

    def projected(self, x: np.ndarray, u: np.ndarray, z: np.ndarray, p: np.ndarray, mode: np.ndarray) -> np.ndarray:
        """Return the state nearest to a given one, which is near them, on the surfaces of a mode."""
        if mode.tobytes() not in self._projections:
            self.solve(x, u, z, p, mode)
        for _ in range(3):
            rows, *_, by_x = self._function(x, u, z, p, mode.astype(float), np.zeros(len(z) ** 2))
            P = self._projections[mode.tobytes()][1].reshape(len(rows), -1)
            if np.abs(P @ rows).max() <= 1e-15 * (1.0 + np.abs(x).max()):
                break
            x = x - np.linalg.lstsq(P @ by_x.reshape(len(rows), len(x)), P @ rows, rcond=SINGULAR)[0]
        return x

    def fitting(self, point: Point, closed: np.ndarray, likely: np.ndarray, about: np.ndarray) -> list[PointMode]:
        """Return modes with right signs at a point, first those with few active pairs.

        Groups that depend on each other are looked at together, others one after the other.

        Args:
            point: x, u, z, p.
            closed: pairs whose G is zero there, (n_pairs).
            likely: a mode that fits where nothing changes, (n_pairs).
            about: pairs that may change, (n_pairs); where the likely mode has a wrong sign others do, too.

        Returns:
            the first is right as a whole; every other one differs from it in groups that depend on each other.
        """
        groups, base = self.groups, likely & closed
        missing = [g for g, own in enumerate(groups.groups) if groups.needs_one[g] and not base[own].any()]
        for g in missing:
            base = base | groups.subsets(g, closed)[0]
        about = about | np.isin(np.arange(len(closed)), [i for g in missing for i in groups.groups[g]])
        looked_at: list[tuple[list[int], list[PointMode]]] = []
        for _ in range(1 + len(groups.components)):
            done = [g for component, _ in looked_at for g in component]
            touched = [one for one in groups.components if one[0] not in done and about[self._pairs(one)].any()]
            for component in touched:
                found = self._of_component(component, point, closed, base)
                if not found:
                    return []
                base = found[0].mode
                looked_at.append((component, found))
            whole = self.solve(*point, base) if not looked_at or len(looked_at) > 1 else looked_at[0][1][0]
            about = whole.wrong(closed)
            if not about.any():
                break
        if not whole.right(closed):
            return []
        others = []
        for component, found in looked_at:
            own = self._pairs(component)
            for one in found[1:]:
                mode = base.copy()
                mode[own] = one.mode[own]
                others.append(one if len(looked_at) == 1 else self.solve(*point[:2], one.z, point[3], mode))
        return [whole, *others]

    def _pairs(self, component: Iterable[int]) -> np.ndarray:
        return np.concatenate([self.groups.groups[g] for g in component])

    def _of_component(
        self, component: list[int], point: Point, closed: np.ndarray, base: np.ndarray
    ) -> list[PointMode]:
        """Return the modes with right signs in groups that depend on each other, the others as in `base`."""
        own = self._pairs(component)
        options = [(g, self.groups.subsets(g, closed)) for g in component]
        options = [(g, modes) for g, modes in options if len(modes) > 1]
        if float(np.prod([float(len(modes)) for _, modes in options])) <= MAX_COMBINATIONS:
            return self._right(self.groups.combined(base, options), point, closed, own)
        found = self._pivoted(next(self.groups.combined(base, options)), point, closed, own)
        others = [  # several solutions at least where they differ in one group
            mode
            for one in found
            for number, modes in options
            for mode in self.groups.combined(one.mode, [(number, modes)])
            if (mode != one.mode).any()
        ]
        return found + self._right(others, point, closed, own)

    def _right(self, modes: Iterable[np.ndarray], point: Point, closed: np.ndarray, own: np.ndarray) -> list[PointMode]:
        solved = (one for mode in modes for one in self._solutions(point, mode))
        right = (one for one in solved if one.consistent and not one.wrong(closed)[own].any())
        return sorted(right, key=lambda one: int(one.mode.sum()))

    def _solutions(self, point: Point, mode: np.ndarray) -> list[PointMode]:
        """Return all solutions of a mode that are found: on intersections of surfaces products of H have several."""
        found = [self.solve(*point, mode)]
        sliding = [own[mode[own]][0] for own in self.groups.groups if mode[own].sum() > 1]
        if not found[0].nonlinear or not 2 <= len(sliding) <= len(STARTS):
            return found
        x, u, z, p = point
        for shares in product(STARTS, repeat=len(sliding)):
            *_, H, _, H_z, _ = self._function(x, u, z, p, mode.astype(float), np.zeros(len(z) ** 2))
            start = z + np.linalg.lstsq(H_z[sliding], np.array(shares) - H[sliding], rcond=SINGULAR)[0]
            one = self.solve(x, u, start, p, mode)
            if all(np.abs(one.z - other.z).max() > 1e-6 * (1.0 + np.abs(one.z).max()) for other in found):
                found.append(one)
        return found

    def _pivoted(self, mode: np.ndarray, point: Point, closed: np.ndarray, own: np.ndarray) -> list[PointMode]:
        """Pivot: pairs with a wrong sign change, all at once as long as they become fewer, then the first.

        Source: Judice and Pires, A block principal pivoting algorithm for LCP, Comput. Oper. Res. 21 (1994).
        """
        fewest, patience = len(mode) + 1, 5
        for _ in range(20 * len(mode)):
            solved = self.solve(*point, mode)
            wrong = np.intersect1d(np.flatnonzero(solved.wrong(closed)), own)
            if not wrong.size:
                return [solved] if solved.consistent else []
            if wrong.size < fewest:
                fewest, patience = wrong.size, 5
            else:
                patience -= 1
            mode = mode.copy()
            mode[wrong if patience >= 0 else wrong[:1]] ^= True
        return []


def _left_null_space(matrix: np.ndarray) -> np.ndarray:
    """Return the projection on the left null space of a matrix as a vector."""
    if not np.isfinite(matrix).all():
        return np.zeros(matrix.size)
    left, values, _ = np.linalg.svd(matrix)
    null = left[:, values <= SINGULAR * max(values[0], 1.0)]
    return np.asarray((null @ null.T).ravel())
