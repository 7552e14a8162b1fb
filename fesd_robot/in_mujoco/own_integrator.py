"""The controls of a plan in this program's own event-driven integrator, as a run beside those in MuJoCo."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from fesd_robot.contact import ContactMode
from fesd_robot.in_mujoco.driving import HOLD, RunRecord, Touch
from fesd_robot.instants import SAME_TIME
from fesd_robot.orientations import with_unit_quaternions
from fesd_robot.plans import Plan
from fesd_robot.robot import Robot
from fesd_robot.simulation import simulate_robot


def integrated(plan: Plan, robot: Robot) -> RunRecord:
    """Return the motion under a plan's controls, every event located, in steps of 1 ms (`simulation.simulate_robot`).

    Args:
        plan: with its finite elements; the motion begins where it does.
        robot: of the plan.

    Raises:
        SolverError: the motion does not go on.
    """
    motion = simulate_robot(plan)
    samples, start = motion.trajectory, float(motion.trajectory.time[0])
    span = float(samples.time[-1]) - start
    time = np.minimum(HOLD * np.arange(round(span / HOLD) + 1), span)
    velocity = {name: np.interp(start + time, samples.time, samples.velocity[name]) for name in robot.velocity_names}
    columns = [_between(samples.time, samples.configuration[name], samples.velocity.get(name), start + time)
               for name in robot.configuration_names]  # fmt: skip
    at = np.clip(np.searchsorted(samples.time, start + time, side="right") - 1, 0, len(samples.time) - 1)
    touching = [[each.mode[k] is not ContactMode.FLIGHT for k in at] for each in motion.contacts.values()]
    controls = plan.at(np.minimum(start + time[:-1], plan.trajectory.time[-1]), "after").controls
    return RunRecord(
        time,
        with_unit_quaternions(robot.configuration_names, np.column_stack(columns)),
        np.column_stack(list(velocity.values())),
        np.array(touching, dtype=bool).reshape(-1, len(time)).T,
        np.array([controls[name] for name in plan.controls if name != "time"]).reshape(-1, len(time) - 1).T,
        [Touch(each.contact, each.time - start) for each in motion.switches if each.kind == "touchdown"],
    )


def _between(time: np.ndarray, values: np.ndarray, slopes: np.ndarray | None, wanted: np.ndarray) -> np.ndarray:
    """Return values between samples, by their slopes where these are known; an impact has two samples at its time."""
    result = np.interp(wanted, time, values)
    if slopes is None:
        return result
    for part in np.split(np.arange(len(time)), np.flatnonzero(np.diff(time) <= SAME_TIME) + 1):
        inside = (wanted >= time[part[0]]) & (wanted <= time[part[-1]])
        if len(part) > 1 and inside.any():
            result[inside] = CubicHermiteSpline(time[part], values[part], slopes[part])(wanted[inside])
    return result
