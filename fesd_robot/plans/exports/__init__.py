"""The trajectory of a plan in the formats that other programs read: one module each, and the table of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fesd_robot.errors import PlanFileError, nearest
from fesd_robot.plans.exports.csv_table import CSV
from fesd_robot.plans.exports.drake_arrays import DRAKE
from fesd_robot.plans.exports.format import ExportFormat
from fesd_robot.plans.exports.gains_table import GAINS
from fesd_robot.plans.exports.joint_trajectory import JOINT_TRAJECTORY
from fesd_robot.plans.exports.json_columns import JSON
from fesd_robot.plans.exports.mcap_recording import MCAP
from fesd_robot.plans.exports.mujoco_arrays import MUJOCO
from fesd_robot.plans.exports.npz_arrays import NPZ
from fesd_robot.plans.exports.parquet_table import PARQUET
from fesd_robot.plans.exports.pinocchio_arrays import PINOCCHIO
from fesd_robot.plans.plan import Plan
from fesd_robot.recovery import ModelMotion

EXPORTS: dict[str, ExportFormat] = {
    each.name: each for each in (CSV, NPZ, JSON, JOINT_TRAJECTORY, PARQUET, MCAP, MUJOCO, DRAKE, PINOCCHIO, GAINS)
}
"""Name of a format -> what it writes."""


def export_format(name: str, joints: Sequence[str] | None = None, effort: bool = False) -> ExportFormat:
    """Return the format of a name.

    Args:
        name: a key of `EXPORTS`.
        joints: the joints asked for, None if all are meant.
        effort: whether efforts are asked for.

    Raises:
        PlanFileError: no such format, joints or efforts for a format that always holds all of them, or a format whose
            packages are not installed.
    """
    if name not in EXPORTS:
        raise PlanFileError(f"found format '{name}', expected one of {', '.join(EXPORTS)}{nearest(name, EXPORTS)}")
    if (joints is not None or effort) and not EXPORTS[name].joints:
        choosing = ", ".join(other for other, each in EXPORTS.items() if each.joints)
        found, holds = ("efforts", "no choice of them") if joints is None else ("joints", "all of them")
        raise PlanFileError(f"found {found} for format '{name}', which has {holds}; expected {choosing}")
    EXPORTS[name].refuse_missing()
    return EXPORTS[name]


def format_of_suffix(file: Path) -> ExportFormat:
    """Return the first format that writes files with the ending of a file.

    Raises:
        PlanFileError: there is none.
    """
    endings = {suffix: each for each in reversed(EXPORTS.values()) for suffix in each.writers}
    if file.suffix not in endings:
        raise PlanFileError(
            f"{file}: found the ending '{file.suffix}', expected one of {', '.join(sorted(endings))}"
            f"{nearest(file.suffix, endings)}, or the name of a format"
        )
    return endings[file.suffix]


def export(
    plan: Plan,
    kind: str,
    *,
    joints: Sequence[str] | None = None,
    effort: bool = False,
    suffix: str = "",
    motion: ModelMotion | None = None,
) -> bytes:
    """Return the trajectory of a plan as the content of a file.

    Args:
        plan: what to write.
        kind: name of the format, a key of `EXPORTS`.
        joints: names of the joints to write, for a format that lets one choose; default: all it can hold.
        effort: whether such a format has the efforts of the joints.
        suffix: of the file, e.g. ``.json``, where a format has several; default: that of its usual file.
        motion: the samples as states of the model of the robot's file, for a format with a model.

    Raises:
        PlanFileError: no such format, joints or efforts for a format without a choice of them, or no motion for one
            that needs it.
        FesdRobotError: the plan cannot be written in this format.
    """
    chosen = export_format(kind, joints, effort)
    write = chosen.writer(suffix)
    if chosen.gains:
        if plan.gains is None:
            raise PlanFileError(
                f"found no gains in {plan.name} for format '{kind}'; fesd_robot.export_plan computes them"
            )
        return write(plan.gains)
    if chosen.model:
        if motion is None:
            raise PlanFileError(
                f"found no motion of the model of {plan.name} for format '{kind}'; fesd_robot.export_plan reads it"
            )
        return write(plan, motion)
    return write(plan, joints, effort) if chosen.joints else write(plan)
