"""`fesd-robot export`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from fesd_robot.cli.arguments import PlanFile


class ExportCommand(TyperCommand):
    """The command whose help ends with the table of formats, which is read when the help is asked for."""

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Write the formats below the options."""
        from fesd_robot.plans import EXPORTS

        with formatter.section("Formats"):
            formatter.write_dl([(each.name, each.content + ".") for each in EXPORTS.values()])


def format_names() -> list[str]:
    """Return the names of all formats, for the completion of a command line."""
    from fesd_robot.plans import EXPORTS

    return list(EXPORTS)


def export(
    plan: PlanFile,
    kind: Annotated[
        str,
        typer.Option(
            "--format",
            "-f",
            metavar="FORMAT",
            help="What to write, one of the formats below.",
            show_default=False,
            autocompletion=format_names,
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="FILE", help="Where to write it, - for stdout; default: beside the plan."),
    ] = None,
    joints: Annotated[
        list[str] | None,
        typer.Option(
            "--joint",
            metavar="NAME",
            help="A joint of the joint-trajectory; may be given several times. Default: all of the model file, locked "
            "and coupled ones too.",
            show_default=False,
        ),
    ] = None,
    effort: Annotated[
        bool,
        typer.Option(
            "--effort",
            help="Write the efforts of a joint-trajectory, too. Default: none, for ROS 2's joint_trajectory_controller "
            "refuses them where it commands no effort interface.",
            show_default=False,
        ),
    ] = False,
    rate: Annotated[
        float | None,
        typer.Option(
            "--rate",
            metavar="HZ",
            help="Samples a second, from the polynomials of the plan's finite elements; an impact has two samples. "
            "Default: the samples of the plan.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Write the trajectory of a plan for another program."""
    from fesd_robot.actions import export_plan, exported
    from fesd_robot.cli.plan_task import task_in
    from fesd_robot.plans import read_plan
    from fesd_robot.plans.exports import export_format

    joints = joints or None
    chosen, loaded = export_format(kind, joints, effort), read_plan(plan)
    with task_in(plan):
        if str(out) == "-":
            sys.stdout.buffer.write(exported(loaded, kind, joints=joints, effort=effort, rate=rate))
            return
        path = (plan if plan.is_dir() else plan.parent) / chosen.file if out is None else out
        typer.echo(f"written to {export_plan(loaded, path, kind, joints=joints, effort=effort, rate=rate)}")
