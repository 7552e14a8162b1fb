"""The cart under a replanner's policies, with pushes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fesd_robot.replanning.replanner import Replanner, Update
from scripts.benchmarks.compare.cart_transport.answers import force, measured
from scripts.benchmarks.compare.cart_transport.law import DURATION, Ride

PERIOD = 0.02
"""s between updates, a step of IMPACT's."""

EVERY = 75
"""Of so many updates one state is also given to IMPACT."""

HOLD = 1e-3  # s; how long a force holds
PUSHES, LARGEST = 3, 0.3  # of a run; m/s by which the cart alone is faster at once


@dataclass(frozen=True)
class Run:
    """One ride in closed loop.

    Attributes:
        ride: where it ended.
        updates: of the replanner.
        states: at every update, (n, 4).
    """

    ride: Ride
    updates: list[Update]
    states: np.ndarray


def run(replanner: Replanner, seed: int) -> Run:
    """Drive the cart from the start of the plan, pushed at random times before 5 s.

    Args:
        replanner: of the plan.
        seed: of the pushes.
    """
    random = np.random.default_rng(seed)
    ticks = (random.uniform(0.0, 5.0, PUSHES) / HOLD).astype(int).tolist()
    pushes = dict(zip(ticks, random.uniform(-LARGEST, LARGEST, PUSHES), strict=True))
    replanner.reset()
    before, every = len(replanner.statistics.updates), round(replanner.period / HOLD)
    ride, states = Ride(np.zeros(4)), []
    for tick in range(round(DURATION / HOLD)):
        if tick in pushes:
            ride.state[2] += pushes[tick]
        at = tick * HOLD
        if tick % every == 0:
            states.append(ride.state.copy())
            policy = replanner.update(at, *measured(ride.state))
            replanner.prepare()
        ride.advance(force(policy, at, ride.state), HOLD)
    return Run(ride, replanner.statistics.updates[before:], np.array(states))
