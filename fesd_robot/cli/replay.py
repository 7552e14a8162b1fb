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


def replay(  # noqa: PLR0913  every option is a parameter
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
            help="open-loop, pd, lqr or replan, or event-driven: the controls alone in this program's own integrator, "
            "beside MuJoCo; may be given several times. Default: the first three.",
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
    closed_loop: Annotated[
        bool,
        typer.Option(
            "--closed-loop",
            help="The same as --controller replan: the rest of the plan is solved again from the measured state while "
            "it runs.",
        ),
    ] = False,
    period: Annotated[
        float | None,
        typer.Option(
            "--period",
            metavar="SECONDS",
            help="How often replan solves it again; default: every 0.01 s.",
            show_default=False,
        ),
    ] = None,
    real_time: Annotated[
        bool,
        typer.Option(
            "--real-time",
            help="With replan, a result counts only once the time has passed that it took; else the simulator waits, "
            "and every run is the same.",
        ),
    ] = False,
    goals: Annotated[
        list[str] | None,
        typer.Option(
            "--goal",
            metavar="TIME:NAME=VALUE",
            help="With replan, another goal from a time on, e.g. 0.3:root_x=1.1; may be given several times.",
            show_default=False,
        ),
    ] = None,
    pushes: Annotated[
        list[str] | None,
        typer.Option(
            "--push",
            metavar="TIME:VX,VZ",
            help="Push the robot at a time, s, by a change of its velocity, m/s, e.g. 0.3:0.2,0, in space "
            "TIME:VX,VY,VZ; may be given several times.",
            show_default=False,
        ),
    ] = None,
    mass: Annotated[
        float, typer.Option("--mass", metavar="FACTOR", help="Of all masses in MuJoCo; the plan knows nothing of it.")
    ] = 1.0,
    friction: Annotated[
        float, typer.Option("--friction", metavar="FACTOR", help="The same, of all coefficients of friction.")
    ] = 1.0,
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
    from fesd_robot.cli.disturbances import moved_goal_of, push_of
    from fesd_robot.cli.exits import ExitCode
    from fesd_robot.in_mujoco import CONTROLLERS, Disturbance, Perturbation, Replanning, write_replay
    from fesd_robot.in_mujoco import replay as replayed
    from fesd_robot.in_mujoco.controllers import REPLAN
    from fesd_robot.plans import read_plan

    folder = (plan if plan.is_dir() else plan.parent) / "replay" if out is None else out

    def tell(sentence: str) -> None:
        if not quiet:
            typer.echo(sentence, err=True)

    named = [*(controllers or ()), *([REPLAN] if closed_loop else ())]
    chosen = list(dict.fromkeys(named)) or list(CONTROLLERS)
    wanted = Replanning(period, real_time, tuple(moved_goal_of(each) for each in goals or ()))
    felt = Disturbance(pushes=tuple(push_of(each) for each in pushes or ()))
    given = Perturbation(mass=mass, friction=friction, disturbance=felt)
    found = replayed(
        read_plan(plan),
        chosen,
        perturb=perturb,
        different=given if given != Perturbation() else None,
        replanning=wanted if wanted != Replanning() else None,
        unsolved=force,
        tell=tell,
    )
    written = write_replay(found, folder)
    if not quiet:
        typer.echo("\n".join([*_lines(found), f"written to {folder}: {', '.join(each.name for each in written)}"]))
    _show(found, viewer, video, quiet)
    if not any(each.deviation.finished for each in found.runs):
        raise typer.Exit(ExitCode.NOT_SOLVED)


def _lines(found: Replay) -> list[str]:
    """Return a line for every run."""
    from fesd_robot.in_mujoco.report import replanning_in_words

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
        words += [replanning_in_words(each.replanned)] if each.replanned else []
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
