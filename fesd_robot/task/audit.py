"""The section `audit` of a task: limits of the audit's entries, by their names."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from fesd_robot.task.fields import Positive, Section


def _limit(unit: str, *, below_zero: bool = False) -> Any:
    size = "How far below zero the entry may be" if below_zero else "Largest value of the entry"
    return Field(default=None, description=f"{size}{f', {unit}' if unit else ''}; default: the audit's own limit.")


class AuditLimits(Section):
    """Limits in place of those that the audit has by itself; names are those of its entries."""

    min_gap: Positive | None = _limit("m", below_zero=True)
    max_gap_drift: Positive | None = _limit("m")
    max_clock_error: Positive | None = _limit("s")
    max_theta_sum_error: Positive | None = _limit("")
    max_friction_cone_violation: Positive | None = _limit("N")
    max_stick_slip_violation: Positive | None = _limit("m/s or N")
    max_impact_law_error: Positive | None = _limit("m/s or N s")
    max_normal_force_violation: Positive | None = _limit("N")
    max_dynamics_error: Positive | None = _limit("relative")
    max_position_limit_violation: Positive | None = _limit("m or rad")
    max_velocity_limit_violation: Positive | None = _limit("m/s or rad/s")
    max_control_limit_violation: Positive | None = _limit("N or N m")
    max_position_defect: Positive | None = _limit("m or rad")
    max_energy_error: Positive | None = _limit("J")
    max_slip_violation: Positive | None = _limit("m/s")
    max_slip_distance_violation: Positive | None = _limit("m")
    max_reserve_violation: Positive | None = _limit("part of the cone")
    max_constraint_violation: Positive | None = _limit("m")
    max_goal_violation: Positive | None = _limit("m, rad or per s")
    max_waypoint_violation: Positive | None = _limit("m, rad or per s")
    max_replay_position_error: Positive | None = _limit("m")
    max_replay_angle_error: Positive | None = _limit("rad")
    max_replay_velocity_error: Positive | None = _limit("m/s")
    max_replay_angular_velocity_error: Positive | None = _limit("rad/s")
    max_improper_slide_time: Positive | None = _limit("s")
    max_force_at_opening: Positive | None = _limit("N")
    max_joint_friction_violation: Positive | None = _limit("N or N m")
    max_joint_slide_violation: Positive | None = _limit("m/s or rad/s")
    max_compliant_force_error: Positive | None = _limit("N")
    max_quaternion_norm_error: Positive | None = _limit("")
    max_impact_energy_gain: Positive | None = _limit("J")
    max_simultaneous_control: Positive | None = _limit("N or N m")

    @property
    def given(self) -> dict[str, float]:
        """Name of an entry -> its limit, of those that the task gives."""
        return {name: value for name in type(self).model_fields if (value := getattr(self, name)) is not None}
