"""The program's commands as functions of a task or a plan: explain, draw, export."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from fesd_robot.arguments import checked
from fesd_robot.errors import FesdRobotError, PlanFileError, TaskError
from fesd_robot.plans import COMPARISON_FILE, FIGURES_FOLDER, PAGE_FILE, Plan, export, place, task_of
from fesd_robot.plans.exports import export_format, format_of_suffix
from fesd_robot.recovery import ModelMotion
from fesd_robot.render import inline_html, write_drawings, write_page
from fesd_robot.robot import Robot
from fesd_robot.task import Task
from fesd_robot.writing import staging_folder, write_atomically

logger = logging.getLogger(__name__)


@checked
def explain(task: Task) -> str:
    """Describe a task in words, with likely mistakes; nothing is solved.

    Args:
        task: from `load_task`.

    Returns:
        robot, controls, contacts, horizon, goal, costs, constraints and the size of the problem, a section each.

    Raises:
        TaskError: the task does not fit its robot; the message names file, line and key.
    """
    from fesd_robot.explanation import explanation  # the rooms that formulate take longest to import
    from fesd_robot.fesd import Transcription
    from fesd_robot.ocp import formulate
    from fesd_robot.phases import discretised, guessed_sequences

    motion = formulate(task)
    if motion.grid.moving:
        transcription = discretised(motion, next(guessed_sequences(motion))).transcription
    else:
        transcription = Transcription(motion.ocp, motion.fesd)
    return explanation(motion, transcription.problem)


@checked
def draw_task(task: Task, page: Path | str) -> Path:
    """Draw a task before it is planned: a web page with start, goal, ground, contacts, frames, shapes and obstacles.

    Args:
        task: from `load_task`.
        page: the HTML file to write, or the folder for ``task.html``.

    Returns:
        the file.

    Raises:
        TaskError: the task does not fit its robot; the message names file, line and key.
        RobotError: the shapes of the robot cannot be read.
        PlanFileError: the file cannot be written.
    """
    from fesd_robot.ocp import formulate  # the rooms that formulate take longest to import
    from fesd_robot.render import write_task_page

    motion = formulate(task)
    return _drawn(partial(write_task_page, motion), page, "task.html")


@checked
def draw_robot(robot: Robot, page: Path | str) -> Path:
    """Draw what is in a model: a web page with its frames, bodies, joints and collision shapes, every joint at zero.

    Args:
        robot: from `fesd_robot.robot.load_robot`.
        page: the HTML file to write, or the folder for ``robot.html``.

    Returns:
        the file.

    Raises:
        RobotError: the shapes of the robot cannot be read.
        PlanFileError: the file cannot be written.
    """
    from fesd_robot.render import write_robot_page

    return _drawn(partial(write_robot_page, robot), page, "robot.html")


def _drawn(write: Callable[[Path], Path], page: Path | str, name: str) -> Path:
    """Write a page to the file that is named, or to the one of this name in a folder."""
    path = Path(page)
    if path.suffix.lower() not in (".html", ".htm") or path.is_dir():
        path = path / name
    try:
        return write(path)
    except OSError as error:
        raise PlanFileError(f"{path}: cannot be written ({error.strerror})") from error


@checked
def render_plan(
    plan: Plan, folder: Path | str, *, task_folder: Path | None = None, overrides: Sequence[str] = ()
) -> list[Path]:
    """Draw a plan: a web page that plays the motion, ``plan.html``, and the figures, ``figures/``.

    Args:
        plan: from `plan` or `read_plan`.
        folder: where to write; earlier drawings in it are replaced.
        task_folder: where relative paths in the task start; default: the folder of the task file when it was planned.
        overrides: ``output.key=value`` each, in the place of the task's, such as ``output.figure_formats=[svg, pdf]``,
            ``output.figure_width=one_column`` or ``output.animation=true``.

    Returns:
        the files, the page first.

    Raises:
        TaskError: the robot's model or the file of a height map, which the task names, cannot be read any more; an
            override that does not fit, or of a key that is no drawing's.
        RobotError: the shapes of the robot cannot be read.
        PlanFileError: the folder cannot be written to.
    """
    folder = Path(folder)
    for override in overrides:
        if not override.startswith("output."):
            raise TaskError(f"found --set {override}, expected a key of 'output', such as output.figure_formats=[svg]")
    try:
        task = task_of(plan, task_folder, overrides)
        with staging_folder(folder.resolve()) as stage:
            page = write_page(plan, task, stage / PAGE_FILE)
            files = [page, *write_drawings(plan, task, stage / FIGURES_FOLDER)]
            place(stage, folder.resolve())
        return [folder / file.relative_to(stage) for file in files]
    except OSError as error:
        raise PlanFileError(f"{folder}: cannot be written to ({error.strerror})") from error


@checked
def plan_html(plan: Plan) -> str:
    """Return a plan as HTML for a notebook: verdict, five sentences, and the page that plays the motion, in a frame.

    A plan whose robot cannot be read any more is shown without the page, and with the reason.

    Args:
        plan: from `plan` or `read_plan`.
    """
    try:
        with TemporaryDirectory() as folder:
            page = write_page(plan, task_of(plan), Path(folder) / PAGE_FILE).read_text(encoding="utf-8")
    except (FesdRobotError, OSError) as error:
        return inline_html(plan, None, str(error))
    return inline_html(plan, page)


@checked
def render_comparison(
    plan: Plan, other: Plan, folder: Path | str, *, task_folder: Path | None = None, other_folder: Path | None = None
) -> Path:
    """Draw two plans in one web page, ``comparison.html``: the first one in full, the second one as a ghost beside it.

    Args:
        plan, other: from `plan` or `read_plan`; their robots may differ.
        folder: where to write; an earlier comparison in it is replaced.
        task_folder, other_folder: where relative paths in the two tasks start; default: the folder of the task file
            when it was planned.

    Returns:
        the page.

    Raises:
        TaskError: a robot's model or the file of a height map, which a task names, cannot be read any more.
        RobotError: the shapes of a robot cannot be read.
        PlanFileError: the folder cannot be written to.
    """
    ghost = other, task_of(other, other_folder)
    try:
        return write_page(plan, task_of(plan, task_folder), Path(folder) / COMPARISON_FILE, ghost)
    except OSError as error:
        raise PlanFileError(f"{folder}: cannot be written to ({error.strerror})") from error


@checked
def exported(
    plan: Plan,
    kind: str,
    *,
    joints: Sequence[str] | None = None,
    suffix: str = "",
    rate: float | None = None,
) -> bytes:
    """Return the trajectory of a plan as the content of a file, `fesd_robot.plans.export`, also of an earlier version.

    Plans that do not say how all joints of the model file move get it from their task's robot; tables of plans whose
    robot cannot be read any more leave it out with a warning.

    Args:
        plan, joints, suffix: as there.
        kind: name of the format.
        rate: samples a second, Hz, from the polynomials of the finite elements; default: the samples of the plan.

    Raises:
        TaskError: a file that the task names cannot be read any more, and it is needed: for a rate, a format that
            consists of these joints or one with the model.
        FesdRobotError: the plan cannot be written in this format, or not at this rate.
    """
    chosen = export_format(kind, joints)
    if chosen.gains:
        from fesd_robot.tracking import with_gains  # formulating is slow

        if rate is not None:
            raise PlanFileError(f"found a rate for format '{kind}', expected none: gains have steps of their own")
        return export(with_gains(plan), chosen.name, suffix=suffix)
    if rate is not None or chosen.model:
        plan, motion = _on_model(plan, rate, chosen.model)
        return export(plan, chosen.name, joints=joints, suffix=suffix, motion=motion)
    if plan.full_model is None:
        try:
            plan = _on_model(plan)[0]
        except FesdRobotError as error:
            if chosen.joints:
                raise
            logger.warning("the columns of all joints of the model file are left out: %s", error)
    return export(plan, chosen.name, joints=joints, suffix=suffix)


def _on_model(plan: Plan, rate: float | None = None, states: bool = False) -> tuple[Plan, ModelMotion | None]:
    """Return a plan with the motion of all joints of the model file, sampled at a rate, and its states if asked for."""
    from fesd_robot.ocp import (  # formulating is slow
        formulate,
        model_motion_of,
        numeric_physics,
        with_full_model,
        with_gaps,
    )
    from fesd_robot.plans import check_task_and_robot, resampled

    samples = None if rate is None else resampled(plan, rate)
    motion = formulate(task_of(plan), driven=False)
    check_task_and_robot(plan, motion.task, motion.robot)
    physics = numeric_physics(motion)
    if samples is not None:
        plan = with_gaps(samples, motion, physics)
    if plan.full_model is None:
        plan = with_full_model(plan, motion, physics)
    return plan, model_motion_of(plan, motion, physics) if states else None


@checked
def export_plan(
    plan: Plan,
    file: Path | str,
    kind: str | None = None,
    *,
    joints: Sequence[str] | None = None,
    rate: float | None = None,
) -> Path:
    """Write the trajectory of a plan into a file for another program.

    Args:
        plan: from `plan` or `read_plan`.
        file: where to write.
        kind: name of a format, a key of `plans.EXPORTS`, whose values say what each holds: ``csv``, ``npz``, ``json``,
            ``joint-trajectory``, ``parquet``, ``mcap``, ``mujoco``, ``drake``, ``pinocchio`` or ``gains``. Default: the
            first one for the ending of the file.
        joints: names of the joints, for a format that lets one choose; default: all it can hold.
        rate: samples a second, Hz, from the polynomials of the finite elements; impacts have two samples, and the end
            has one. Default: the samples of the plan, the stages of its elements.

    Returns:
        the file.

    Raises:
        PlanFileError: no such format, joints for a format that holds all of them, a rate that is none or of a plan
            without its finite elements, or the file cannot be written.
        TaskError: the joints of a plan of an earlier version, whose task names a file that cannot be read any more.
    """
    path = Path(file)
    if path.is_dir():
        raise PlanFileError(f"{path}: is a folder, expected the name of a file")
    chosen = format_of_suffix(path) if kind is None else export_format(kind, joints)
    content = exported(plan, chosen.name, joints=joints, suffix=path.suffix, rate=rate)
    try:
        return write_atomically(path, content)
    except OSError as error:
        raise PlanFileError(f"{path}: cannot be written ({error.strerror})") from error
