"""Groups of pairs that decide together: the two sides of a step function, the regions of a subsystem."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, product

import casadi as ca
import numpy as np

from fesd_robot.dcs import ComplementaritySystem

LARGEST_SUBSETS = 1024
"""So many subsets of one group at most are combined with others."""


@dataclass(frozen=True, eq=False)
class PairGroups:
    """The pairs of a system in groups whose H are linked by equations that hold at all times.

    A mode is a mode of every group, independently. In a group like ``sum_i theta_i = 1`` or ``alpha + (1 - alpha) = 1``
    at least one H is positive.

    Args:
        system: the pairs and equations.
    """

    system: ComplementaritySystem

    @cached_property
    def groups(self) -> list[np.ndarray]:
        """Indices of the pairs of every group."""
        z = self.system.algebraic
        together = _together(list(_dependence(self.system.H, z)), list(_dependence(self._linking_rows, z)))
        return sorted((np.array(one) for one in together), key=lambda one: int(one[0]))

    @cached_property
    def components(self) -> list[list[int]]:
        """Numbers of groups that depend on each other: dG/dt of one on H of another, directly or by others."""
        system, z = self.system, self.system.algebraic
        rows = ca.vertcat(system.residual, system.equations)
        rate = ca.solve(system.mass_matrix, system.right_hand_side)
        in_rows = _dependence(rows, z)
        in_rates = _dependence(ca.mtimes(ca.jacobian(rows, system.state), rate), z)
        of_G, of_H = _dependence(system.G, z), _dependence(system.H, z)
        of_groups = [of_G[group].any(axis=0) for group in self.groups]
        multiplier = of_G.any(axis=0)
        # Sets of variables that are not G: those of one group's H, of one equation, of what moves one group's G.
        of_own = [of_H[group].any(axis=0) for group in self.groups]
        linked = [row & ~multiplier for row in in_rows]
        for group, own in zip(self.groups, of_groups, strict=True):
            moving = in_rates[(in_rows & own).any(axis=1)]
            linked.append((moving.any(axis=0) & ~multiplier) | of_H[group].any(axis=0))
        return _together(of_own, linked)

    @cached_property
    def _linking_rows(self) -> ca.SX:
        """Equations in variables of H alone."""
        system = self.system
        rows = ca.vertcat(system.residual, system.equations)
        others = ca.vertcat(system.state, system.control, system.parameters)
        of_H = _dependence(system.H, system.algebraic).any(axis=0)
        inside, outside = _dependence(rows, system.algebraic), _dependence(rows, others).any(axis=1)
        chosen = np.flatnonzero(~outside & inside.any(axis=1) & ~(inside & ~of_H).any(axis=1))
        return rows[chosen.tolist()] if chosen.size else ca.SX(0, 1)

    @cached_property
    def needs_one(self) -> list[bool]:
        """For every group whether not all of its H can vanish."""
        z = self.system.algebraic
        result = []
        for group in self.groups:
            rows = ca.vertcat(self.system.H[group.tolist()], self._linking_rows)
            jacobian, value = (np.asarray(part.full()) for part in _at_zero(rows, z))
            own = jacobian[: len(group)].any(axis=0)
            mine = np.concatenate([np.ones(len(group), dtype=bool), (jacobian[len(group) :][:, own] != 0).any(axis=1)])
            A, b = jacobian[mine], value.ravel()[mine]
            z_best = np.linalg.lstsq(A, -b, rcond=None)[0] if A.size else np.zeros(0)
            result.append(bool(A.size and np.abs(A @ z_best + b).max() > 1e-9))
        return result

    def touched(self, pairs: Sequence[int] | np.ndarray) -> list[int]:
        """Return the numbers of the groups that have one of these pairs."""
        wanted = set(np.asarray(pairs).tolist())
        return [number for number, group in enumerate(self.groups) if wanted & set(group.tolist())]

    def subsets(self, number: int, pool: np.ndarray) -> list[np.ndarray]:
        """Return the modes of a group, as booleans over all pairs, with active pairs from a pool; smallest first."""
        where = [int(i) for i in self.groups[number] if pool[i]]
        modes = []
        for size in range(int(self.needs_one[number]), len(where) + 1):
            for chosen in combinations(where, size):
                mode = np.zeros(len(pool), dtype=bool)
                mode[list(chosen)] = True
                modes.append(mode)
                if len(modes) >= LARGEST_SUBSETS:
                    return modes
        return modes

    def combined(self, base: np.ndarray, options: Sequence[tuple[int, Sequence[np.ndarray]]]) -> Iterator[np.ndarray]:
        """Yield a mode for every combination of modes of some groups, the others as in `base`; first choices first.

        Args:
            base: (n_pairs) booleans.
            options: numbers of groups, with modes of each over all pairs.
        """
        keep = base.copy()
        for number, _ in options:
            keep[self.groups[number]] = False
        for chosen in product(*[modes for _, modes in options]):
            yield np.logical_or.reduce([keep, *chosen])


def _dependence(rows: ca.SX, variables: ca.SX) -> np.ndarray:
    """Return which rows depend on which variables, (rows, variables) booleans."""
    if not rows.numel() or not variables.numel():
        return np.zeros((rows.numel(), variables.numel()), dtype=bool)
    pattern = ca.jacobian_sparsity(rows, variables)
    return np.asarray(ca.DM(pattern, 1).full(), dtype=bool)


def _together(own: Sequence[np.ndarray], links: Sequence[np.ndarray]) -> list[list[int]]:
    """Return the numbers of sets of variables that share some, directly or over links; an empty set stays alone."""
    merged = _merged([*own, *links])
    home = [next((i for i, one in enumerate(merged) if (one & each).any()), -1 - n) for n, each in enumerate(own)]
    return [[n for n, at in enumerate(home) if at == i] for i in sorted(set(home))]


def _merged(sets: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Return the unions of sets that share something."""
    merged: list[np.ndarray] = []
    for one in sets:
        if one.any():
            touching = [other for other in merged if (other & one).any()]
            merged = [other for other in merged if not (other & one).any()]
            merged.append(np.logical_or.reduce([one, *touching]))
    return merged


def _at_zero(rows: ca.SX, z: ca.SX) -> tuple[ca.DM, ca.DM]:
    jacobian, value = ca.Function("rows", [z], [ca.jacobian(rows, z), rows])(np.zeros(z.numel()))
    return jacobian, value
