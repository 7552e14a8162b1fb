"""A plan at the times of a run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fesd_robot.contact import ContactMode
from fesd_robot.orientations import with_unit_quaternions
from fesd_robot.plans import Plan
from fesd_robot.plans.sampling import planned_motion


@dataclass(frozen=True)
class PlannedStates:
    """A plan at n times.

    Attributes:
        configuration: in the order of the plan, (n, n_q).
        sticking: which contacts stick, (n, n_c) of bool.
    """

    configuration: np.ndarray
    sticking: np.ndarray


def planned_states(plan: Plan, times: np.ndarray) -> PlannedStates:
    """Return a plan at some times since its start; between the samples of one without finite elements, lines.

    Args:
        plan: any.
        times: s, (n).
    """
    trajectory = plan.trajectory
    moments = np.minimum(times + trajectory.time[0], trajectory.time[-1])
    names = list(trajectory.configuration)
    if plan.finite_elements is not None:
        at = planned_motion(plan).at(moments)
        configuration = np.column_stack([at.configuration[name] for name in names])
        modes = [np.atleast_1d(at.contacts[name].mode) for name in plan.contacts]
    else:
        clock = np.maximum.accumulate(trajectory.time)
        columns = [np.interp(moments, clock, trajectory.configuration[name]) for name in names]
        configuration = with_unit_quaternions(names, np.column_stack(columns))
        nearest = np.clip(np.searchsorted(clock, moments), 0, len(clock) - 1)
        modes = [np.array(history.mode, dtype=object)[nearest] for history in plan.contacts.values()]
    sticking = [[mode is ContactMode.STICK for mode in each] for each in modes]
    return PlannedStates(configuration, np.array(sticking, dtype=bool).reshape(len(modes), len(times)).T)
