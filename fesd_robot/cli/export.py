"""`fesd-robot export`."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from fesd_robot.cli.arguments import PlanFile


class Format(str, Enum):
    """What a trajectory can be exported as."""

    CSV = "csv"
    NPZ = "npz"
    JSON = "json"
    JOINT_TRAJECTORY = "joint-trajectory"


def export(
    plan: PlanFile,
    kind: Annotated[Format, typer.Option("--format", "-f", help="What to write.", show_default=False)],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FILE",
            help="Where to write it, - for stdout; default: beside the plan. A joint-trajectory is YAML, or JSON if "
            "FILE ends in .json.",
        ),
    ] = None,
    joints: Annotated[
        list[str] | None,
        typer.Option(
            "--joint",
            metavar="NAME",
            help="A joint of the joint-trajectory; may be given several times. Default: all that a control of their "
            "own drives.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Write the trajectory of a plan for another program.

    csv, npz and json hold all samples, with both sides of every impact; joint-trajectory holds the fields of ROS's
    trajectory_msgs/JointTrajectory, of every impact the point after it.
    """
    from fesd_robot.errors import PlanFileError
    from fesd_robot.plans import EXPORTS, read_plan
    from fesd_robot.plans import export as exported
    from fesd_robot.render.files import write_atomically

    found = read_plan(plan)
    path = (plan if plan.is_dir() else plan.parent) / EXPORTS[kind.value] if out is None else out
    if path.is_dir():
        raise PlanFileError(f"{path}: is a folder, expected the name of a file")
    content = exported(found, kind.value, joints=joints or None, as_json=path.suffix == ".json")
    if str(path) == "-":
        typer.echo(content, nl=False)
        return
    try:
        write_atomically(path, content)
    except OSError as error:
        raise PlanFileError(f"{path}: cannot be written ({error.strerror})") from error
    typer.echo(f"written to {path}")
