"""`fesd-robot replay`."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fesd_robot.cli.arguments import PlanFile, Quiet

if TYPE_CHECKING:
    from fesd_robot.in_mujoco import Replay


def controller_names() -> list[str]:
    """Return the names of all controllers, for the completion of a command line."""
    from fesd_robot.in_mujoco import RUNS

    return list(RUNS)


def replay(
    plan: PlanFile,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="DIR", help="Folder for the results; default: replay/ beside the plan."),
    ] = None,
    controllers: Annotated[
        list[str] | None,
        typer.Option(
            "--controller",
            metavar="NAME",
            help="open-loop, pd or lqr, or event-driven: the controls alone in this program's own integrator, beside "
            "MuJoCo; may be given several times. Default: the first three.",
            show_default=False,
            autocompletion=controller_names,
        ),
    ] = None,
    perturb: Annotated[
        bool,
        typer.Option(
            "--perturb",
            help="Run it twenty times more with each: masses 10 % off, friction 20 % less, 5 ms late, start off by "
            "1 cm and 2 degrees, sensor noise.",
        ),
    ] = False,
    viewer: Annotated[
        bool, typer.Option("--viewer", help="Play the last controller's run in MuJoCo's viewer.")
    ] = False,
    video: Annotated[
        Path | None,
        typer.Option(
            "--video",
            metavar="FILE",
            help="Write the last controller's run as a video, .gif or .webp.",
            show_default=False,
        ),
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Replay a plan that is not solved, too, in open loop.")
    ] = False,
    quiet: Quiet = False,
) -> None:
    """Run a plan in MuJoCo, with and without feedback, and say how far it is from the plan.

    Leaves replay.json, replay.md, errors.png, scene.xml and a page for every controller. Exit status: 0 if the plan
    finishes with one of the controllers, 3 if with none.
    """
    if video is not None and sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
        os.environ.setdefault("MUJOCO_GL", "egl")  # read when MuJoCo is imported
    from fesd_robot.cli.exits import ExitCode
    from fesd_robot.in_mujoco import CONTROLLERS, write_replay
    from fesd_robot.in_mujoco import replay as replayed
    from fesd_robot.plans import read_plan

    folder = (plan if plan.is_dir() else plan.parent) / "replay" if out is None else out

    def tell(sentence: str) -> None:
        if not quiet:
            typer.echo(sentence, err=True)

    chosen = list(dict.fromkeys(controllers)) if controllers else list(CONTROLLERS)
    found = replayed(read_plan(plan), chosen, perturb=perturb, unsolved=force, tell=tell)
    written = write_replay(found, folder)
    if not quiet:
        typer.echo("\n".join([*_lines(found), f"written to {folder}: {', '.join(each.name for each in written)}"]))
    _show(found, viewer, video, quiet)
    if not any(each.deviation.finished for each in found.runs):
        raise typer.Exit(ExitCode.NOT_SOLVED)


def _lines(found: Replay) -> list[str]:
    """Return a line for every run."""
    lines = [*found.left_out, *(f"note: {each}" for each in found.scene.notes)]
    for each in found.runs:
        entry = each.entry()
        words = ["finished" if entry["finished"] else "did not finish"]
        if entry["base_rms"] is not None:
            words.append(
                f"bodies {1e3 * entry['base_rms']:.3g} mm off in the mean, {1e3 * entry['base_end']:.3g} mm at the end"
            )
        for key, name, unit in (("joint_rms", "hinges", "mrad"), ("slide_rms", "slides", "mm")):
            if entry[key] is not None:
                words.append(f"{name} {1e3 * entry[key]:.3g} {unit}")
        if entry["perturbed"]:
            words.append(
                f"{entry['perturbed']['finished']} of {len(entry['perturbed']['runs'])} perturbed runs finished"
            )
        lines.append(f"{each.controller}: {', '.join(words)}")
    return lines


def _show(found: Replay, viewer: bool, video: Path | None, quiet: bool) -> None:
    """Play the last run, and write it as a video; where one cannot, say so in a sentence."""
    if not found.runs or not (viewer or video):
        return
    from fesd_robot.errors import FesdRobotError
    from fesd_robot.in_mujoco import mujoco_scene, play, write_video

    scene, record = mujoco_scene(found.scene.motion, shapes=True), found.runs[-1].record
    try:
        if video is not None:
            path = write_video(scene, record, video)
            if not quiet:
                typer.echo(f"written to {path}")
        if viewer:
            play(scene, record)
    except FesdRobotError as error:
        typer.echo(str(error), err=True)
