"""The page and the figures of a plan: from the task and the trajectory to what the render room takes."""

from __future__ import annotations

import logging
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fesd_robot.exactness import WRITTEN
from fesd_robot.plans import FIGURES_FOLDER, PAGE_FILE

if TYPE_CHECKING:
    import pinocchio as pin

    from fesd_robot.contact import Ground
    from fesd_robot.contact.ground import Solid
    from fesd_robot.plans import Plan
    from fesd_robot.render import BoxVisual, CircleVisual, FacingWallVisual, GroundVisual, SolidVisual, WallVisual
    from fesd_robot.robot import Robot
    from fesd_robot.task import Task, Wall

logger = logging.getLogger(__name__)


def write_optional_files(plan: Plan, task: Task, folder: Path) -> None:
    """Write the page and the figures that the task asks for into `folder`.

    What cannot be drawn is left out with a warning: no picture is worth the loss of a plan.
    """
    wanted: list[tuple[str, bool, Callable[[], object]]] = [
        (PAGE_FILE, task.output.page, lambda: write_page(plan, task, folder / PAGE_FILE)),
        (
            FIGURES_FOLDER,
            task.output.figures or task.output.animation,
            lambda: write_drawings(plan, task, folder / FIGURES_FOLDER),
        ),
    ]
    for name, asked, write in wanted:
        if not asked:
            continue
        logger.debug("writing %s", name)
        try:
            write()
        except BaseException as error:
            _remove(folder / name)
            if not isinstance(error, Exception):  # an interrupt
                raise
            logger.warning("%s could not be written: %s", name, error)
            logger.debug("the reason in full", exc_info=True)


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def write_page(plan: Plan, task: Task, path: Path, ghost: tuple[Plan, Task] | None = None) -> Path:
    """Write the web page of a plan: its robot in motion on the ground, forces, events and curves.

    Args:
        task: the task that was planned, with the file it was loaded from.
        ghost: another plan, whose robot is drawn transparent beside it, and its task.

    Raises:
        TaskError: the model cannot be read any more.
        RobotError: its shapes cannot be read.
        FesdRobotError: the trajectory cannot be shown, e.g. because it is not finite.
    """
    from fesd_robot.ocp import build_actuation, load_task_robot
    from fesd_robot.plans import check_task_and_robot
    from fesd_robot.render import PageContent, render_page
    from fesd_robot.render.feet import feet_of
    from fesd_robot.render.page import Ghost
    from fesd_robot.render.story import story_of
    from fesd_robot.render.verdict import effort_facts, goal_rows, verdict_of

    task, robot = load_task_robot(task)
    check_task_and_robot(plan, task, robot)
    time, configuration = _samples(plan, robot)
    feet = feet_of(plan, task, robot, configuration)
    actuation = build_actuation(task, robot)
    other = None
    if ghost is not None:
        other_task, other_robot = load_task_robot(ghost[1])
        check_task_and_robot(ghost[0], other_task, other_robot)
        other = Ghost(ghost[0].name, other_robot.model, other_robot.visual_model, *_samples(ghost[0], other_robot))
    content = PageContent(
        title=plan.name,
        subtitle=plan.status.message,
        verdict=verdict_of(plan),
        goal=goal_rows(plan),
        # What is missed stands in the table of the goal.
        facts=[*effort_facts(plan, actuation), *(fact for fact in outcome_facts(plan) if fact[0] != "goal")],
        model=robot.model,
        visual_model=robot.visual_model,
        time=time,
        configuration=configuration,
        ground=ground_visual(task),
        traces={foot.name: foot.path for foot in feet},
        circles=circle_visuals(task, robot),
        planar=not plan.in_space if plan.contacts else _stays_in_plane(robot.model, configuration),
        story=story_of(plan, feet, actuation, time),
        ghost=other,
    )
    return render_page(path, content)


def _stays_in_plane(model: pin.Model, configuration: np.ndarray) -> bool:
    """Return whether no joint leaves the x-z plane or turns out of it in some configurations, (n, n_q)."""
    import pinocchio as pin  # takes long

    data, sideways = model.createData(), list[np.ndarray]()
    for q in configuration:
        pin.forwardKinematics(model, data, q)
        sideways.append(np.array([[joint.translation[1], *joint.rotation[:, 1]] for joint in data.oMi[1:]]))
    return bool(np.ptp(sideways, axis=0).max(initial=0.0) <= WRITTEN)


def _samples(plan: Plan, robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    """Return time, s, (n), and configuration, (n, n_q), of a plan in the order of its robot."""
    trajectory = plan.trajectory
    configuration = np.column_stack([trajectory.configuration[name] for name in robot.configuration_names])
    # Where the dynamics do not hold yet, the clock may step back; the page says that the plan is not solved.
    return (trajectory.time if plan.status.solved else np.maximum.accumulate(trajectory.time)), configuration


def outcome_facts(plan: Plan) -> list[tuple[str, str]]:
    """Return warnings, misses of the goal, and events of each contact, as far as the plan has them."""
    from fesd_robot.plans import contact_words, goal_words

    warnings = [("warning", warning) for warning in plan.warnings]
    if plan.outcome is None:
        return warnings
    contacts = [(name, contact_words(contact)) for name, contact in plan.outcome.contacts.items()]
    return [*warnings, ("goal", goal_words(plan.outcome)), *contacts]


def ground_visual(task: Task) -> GroundVisual:
    """Return the ground of a task as the page draws it.

    Raises:
        TaskError: the file of its height map cannot be used any more.
    """
    from fesd_robot.ocp import ground_of, solid_of
    from fesd_robot.render import GroundVisual

    ground = ground_of(task)
    return GroundVisual(
        ground,
        untouched=task.has_untouched_ground,
        walls={name: _wall(wall) for name, wall in task.ground.walls.items()},
        solids={name: _solid(solid_of(surface), ground) for name, surface in task.surfaces.items()},
    )


def _wall(wall: Wall) -> WallVisual | FacingWallVisual:
    from fesd_robot.render import FacingWallVisual, WallVisual

    if wall.place is not None and wall.facing is not None:
        return FacingWallVisual(wall.place, wall.facing)
    assert wall.x is not None and wall.side is not None
    return WallVisual(wall.x, wall.side)


def _solid(solid: Solid, ground: Ground) -> SolidVisual:
    """Return a solid; one without an underside reaches down to the ground below its centre."""
    from fesd_robot.contact.ground import Cylinder
    from fesd_robot.render import SolidVisual

    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.array(solid.pose.axes).T, solid.pose.center
    x, y, z = (2 * (half + solid.rounding) for half in solid.half_lengths)
    hanging = float(ground.distance(pose[:3, 3] - z / 2 * pose[:3, 2])) if not solid.underside else 0.0
    if hanging > 0:
        pose[:3, 3] -= hanging / 2 * pose[:3, 2]
        z += hanging
    return SolidVisual(pose, (x, y, z), isinstance(solid, Cylinder))


def circle_visuals(task: Task, robot: Robot) -> dict[str, CircleVisual | BoxVisual]:
    """Return the circles and boxes of a task's contacts, each in the colour of its contact's path."""
    from fesd_robot.render import BoxVisual, CircleVisual
    from fesd_robot.task import CircleBoxContact, CircleCircleContact, PointContact

    circles: dict[str, CircleVisual | BoxVisual] = {}
    for color, (name, contact) in enumerate(task.single_contacts.items()):
        if isinstance(contact, PointContact):
            continue
        circles[name] = CircleVisual(robot.frame_id(contact.touching_frame), contact.radius, color)
        if isinstance(contact, CircleCircleContact):
            assert contact.other_radius is not None
            other = CircleVisual(robot.frame_id(contact.other_frame), contact.other_radius, color)
            circles[f"{name}, other"] = other
        if isinstance(contact, CircleBoxContact):
            assert contact.other_size is not None
            sides = contact.other_size[0], contact.other_size[-1]
            circles[f"{name}, other"] = BoxVisual(robot.frame_id(contact.other_frame), sides, color)
    return circles


def write_drawings(plan: Plan, task: Task, folder: Path) -> list[Path]:
    """Write the figures and the animation that the section `output` of a task asks for, and return the files.

    Of a robot that cannot be read or a trajectory that is not finite only what needs no robot is drawn, with a warning.
    """
    from fesd_robot.errors import FesdRobotError
    from fesd_robot.render import write_figures
    from fesd_robot.render.figures import Look, robot_motion, write_animation

    output, robot = task.output, None
    try:
        robot = robot_motion(plan, task)
    except FesdRobotError as error:
        logger.warning("figures that need the robot are left out: %s", error)
    look = Look(output.figure_formats, output.figure_width)
    files = write_figures(plan, folder, robot, look) if output.figures else []
    return [*files, *([write_animation(robot, folder)] if output.animation and robot is not None else [])]
