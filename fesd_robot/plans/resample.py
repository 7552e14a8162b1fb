"""A plan whose samples are at a rate instead of at the stages of its finite elements."""

from __future__ import annotations

import math

import numpy as np

from fesd_robot.contact import ContactMode
from fesd_robot.errors import PlanFileError
from fesd_robot.instants import SAME_EVENT, SAME_NODE
from fesd_robot.plans.plan import ContactHistory, Plan, Trajectory
from fesd_robot.plans.sampling import planned_motion

MOST_SAMPLES = 10_000_000
"""More are an error of unit."""


def sample_times(start: float, end: float, impacts: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the times of samples at a rate, and whether each is the second of two, (n,) and (n,) of bool.

    These are start + k / rate, the end, and every impact, which has two samples.

    Args:
        start, end: of the motion, s.
        impacts: s, in order.
        rate: Hz.
    """
    grid = start + np.arange(math.floor((end - start) * rate + SAME_NODE) + 1) / rate
    grid = np.append(grid[grid < end - SAME_EVENT], end)
    apart = np.abs(grid[:, None] - impacts[None, :]).min(axis=1, initial=np.inf) > SAME_EVENT
    times = np.concatenate([grid[apart], impacts, impacts])
    second = np.concatenate([np.zeros(apart.sum() + len(impacts), bool), np.ones(len(impacts), bool)])
    order = np.lexsort((second, times))
    return times[order], second[order]


def resampled(plan: Plan, rate: float) -> Plan:
    """Return a plan with samples at a rate, from the polynomials of its finite elements; its gaps are NaN.

    Args:
        plan: with its finite elements.
        rate: samples a second, Hz; the end of the motion is a sample, too, and an impact is two.

    Raises:
        PlanFileError: a rate that is none, or a plan without its finite elements.
    """
    motion = planned_motion(plan)
    start, end = motion.span
    if not (math.isfinite(rate) and rate > 0 and (end - start) * rate <= MOST_SAMPLES):
        raise PlanFileError(
            f"found a rate of {rate:g} Hz, expected one above zero and below {MOST_SAMPLES / (end - start):.3g} Hz"
        )
    time, second = sample_times(start, end, motion.impacts, rate)
    sides = np.where(second, "after", "before").tolist()
    at = motion.at(time, sides)
    first_of_two = np.append(second[1:], False)
    contacts = {}
    for name, force in at.contacts.items():
        struck = first_of_two & np.isin(time, _impact_times(plan, name, motion.impacts))
        contacts[name] = ContactHistory(
            gap=np.full(len(time), np.nan),
            normal_force=np.asarray(force.normal),
            tangential_force=np.asarray(force.tangential),
            lateral_force=None if force.lateral is None else np.asarray(force.lateral),
            mode=[ContactMode.IMPACT if hit else mode for hit, mode in zip(struck, force.mode, strict=True)],
        )
    joints = {
        name: history.model_copy(update={"force": at.joint_friction[name], "mode": list(at.joint_modes[name])})
        for name, history in plan.joint_friction.items()
    }
    return plan.model_copy(
        update={
            "trajectory": Trajectory.model_validate(
                {
                    "time": time,
                    "configuration": at.configuration,
                    "velocity": at.velocity,
                    "acceleration": at.acceleration,
                }
            ),
            "contacts": contacts,
            "joint_friction": joints,
            "full_model": None,
            "finite_elements": None,
        }
    )


def _impact_times(plan: Plan, contact: str, impacts: np.ndarray) -> np.ndarray:
    """Return the impacts in which a contact takes part."""
    own = np.array([each.time for each in plan.impulses if each.contact == contact])
    return impacts[np.abs(impacts[:, None] - own[None, :]).min(axis=1, initial=np.inf) <= SAME_EVENT]
