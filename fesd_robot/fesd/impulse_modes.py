"""Modes of a step whose state may jump: which impulses act where a mode begins, and whether they are right."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np

from fesd_robot.fesd.mode_sequence import StepInput, Violation
from fesd_robot.fesd.modes import ModeEquations, Modes

ZERO_LAW = 1e-8
"""Size of a law, as a velocity, that counts as zero."""


def modes_with_impulses(
    equations: ModeEquations, base: np.ndarray, before: np.ndarray, violation: Violation
) -> Iterator[np.ndarray]:
    """Yield modes that may follow from a wrong sign on, those without contact first.

    Pairs whose G became negative are hit: their impulses act, and those of pairs that are active there may. Where the
    sign is wrong from the beginning such a pair may also just be active, as one that rests.

    Args:
        equations: of the step.
        base: mode in which the sign is wrong.
        before: mode before the boundary from which on another mode is looked for.
        violation: the wrong sign.
    """
    count, of_impulse = equations.pairs, equations.impulse_pairs
    base_acts = base[count:] if violation.immediate else np.zeros(len(of_impulse), dtype=bool)
    active = base[:count].copy()
    if not violation.entering.size:
        for stay in product((False, True), repeat=len(violation.leaving)):
            if not all(stay):
                active[violation.leaving] = stay
                yield np.concatenate([active, base_acts])
        return
    touching = np.flatnonzero(active | before[:count])
    touching = np.setdiff1d(touching, violation.entering)
    hit = np.isin(of_impulse, violation.entering) | base_acts
    for entered in product((False, True), repeat=len(violation.entering)):
        for stays in product((True, False), repeat=len(touching)):
            active[violation.entering], active[touching] = entered, stays
            choices = [hit | np.isin(of_impulse, touching), hit]
            if violation.immediate and all(entered):
                choices.insert(0, hit & False)
            for acts in choices:
                yield np.concatenate([active, acts])


def impulses_are_right(
    equations: ModeEquations, step: StepInput, own: np.ndarray, left_G: np.ndarray, modes: Modes, tolerance: float
) -> bool:
    """Return whether impulses push, where others act none is missing, and none is replaced by a force.

    Args:
        equations: of the step.
        step: where it starts.
        own: its variables.
        left_G: G at its beginning, (n_pairs).
        modes: of its elements.
        tolerance: how negative an impulse may be.
    """
    sizes, laws, forbids, forbidden = equations.impulses(own, step.x, step.p)
    acts = modes[:, equations.pairs :]
    G = np.vstack([left_G, equations.values(own, step.x, step.p)[0][:-1, -1]])
    closed = G[:, equations.impulse_pairs] <= ZERO_LAW
    pulls = acts & (sizes < -tolerance)
    missing = acts.any(axis=1, keepdims=True) & closed & ~acts & (laws < -ZERO_LAW)
    replaced = (forbids > ZERO_LAW) & (forbidden > tolerance)
    return not (pulls.any() or missing.any() or replaced.any())
