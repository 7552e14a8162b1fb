"""A plan's robot, ground and contacts as a model of MuJoCo."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import mujoco
import numpy as np

from fesd_robot.contact import ContactMode
from fesd_robot.errors import OptionError, RobotError
from fesd_robot.in_mujoco.bodies import add_bodies
from fesd_robot.in_mujoco.contacts import Contacts
from fesd_robot.in_mujoco.coordinates import Coordinates
from fesd_robot.in_mujoco.impacts import BOUNCING_TIME_STEP, TIME_STEP
from fesd_robot.in_mujoco.motors import Motors
from fesd_robot.ocp import MotionProblem, formulate, restitution_of
from fesd_robot.plans import Plan, task_of

IMPEDANCE_RATIO = 100.0
"""impratio; how much stiffer friction is than the normal force, so that what sticks does not creep."""

LIGHT = 1e-6
"""Share of the mass of all that it carries, below which a body is a joint only."""

MOSTLY = 5 / 6
"""Share of the time that a contact touches; one that slides so long slides nearly all of the time."""


@dataclass(frozen=True)
class MujocoScene:
    """A model of MuJoCo with the dynamics, the contacts and the motors of a task.

    Attributes:
        motion: the task, formulated.
        spec: the scene, as it is written to a file.
        model: the same, compiled.
        coordinates: the maps between its state and that of the plan.
        motors: the controls.
        notes: how it differs from the plan's physics, one sentence each.
    """

    motion: MotionProblem
    spec: mujoco.MjSpec
    model: mujoco.MjModel
    coordinates: Coordinates
    motors: Motors
    notes: tuple[str, ...]
    pair_contacts: dict[tuple[int, int], int]

    @property
    def contact_names(self) -> list[str]:
        """Names of the contacts in their order."""
        return list(self.motion.scene.geometries)

    @property
    def first_body(self) -> int:
        """Number of the robot's first body with a mass."""
        masses, first = self.model.body_mass, 1
        while masses[first] < LIGHT * self.model.body_subtreemass[first]:
            first += 1
        return first

    def touching(self, data: mujoco.MjData) -> np.ndarray:
        """Return which contacts touch, (n_c) of bool: those on which MuJoCo has a constraint."""
        result = np.zeros(len(self.motion.scene.geometries), dtype=bool)
        if data.ncon:
            contacts = data.contact
            for pair, address in zip(contacts.geom, contacts.efc_address, strict=True):
                if address >= 0:
                    result[self.pair_contacts[int(pair[0]), int(pair[1])]] = True
        return result

    def xml(self) -> str:
        """Return the scene as MJCF."""
        return str(self.spec.to_xml())


def sliding_contacts(plan: Plan) -> list[str]:
    """Return the contacts of a plan that slide nearly all of the time that they touch."""
    spans = np.diff(plan.trajectory.time, append=plan.trajectory.time[-1])
    result = []
    for name, history in plan.contacts.items():
        times = [spans[[mode is each for mode in history.mode]].sum() for each in (ContactMode.SLIP, ContactMode.STICK)]
        slides, sticks = times
        if slides > 0 and slides >= MOSTLY * (slides + sticks):
            result.append(name)
    return result


def mujoco_scene(
    motion: MotionProblem,
    *,
    mass: float = 1.0,
    friction: float = 1.0,
    sliding: Collection[str] = (),
    shapes: bool = False,
) -> MujocoScene:
    """Return a task as a model of MuJoCo.

    Bodies, joints, inertias, armature, damping, springs, dry friction, limits, gravity and motors are those of the
    task's robot; of all shapes only those that the task lists as contacts touch each other. Friction is Coulomb's, with
    elliptic cones; contacts are as stiff as MuJoCo lets them be.

    Args:
        motion: the task, formulated.
        mass: factor of all masses and inertias.
        friction: factor of the coefficients of friction of all contacts.
        sliding: names of contacts that slide nearly all of the time, as `sliding_contacts` says of a plan; their
            friction builds up within ten time steps instead of two.
        shapes: whether the robot has the shapes by which it is seen, beside those that touch.

    Raises:
        OptionError: a factor that is not positive.
        RobotError: a robot that MuJoCo cannot have; the message has its words and the file. A limit surface or a
            compliant contact, which it does not know.
    """
    for name, factor in (("mass", mass), ("friction", friction)):
        if not 0.0 < factor < np.inf:
            raise OptionError(f"{name}: found the factor {factor:g}, expected a number greater than 0")
    if motion.robot.limit_surfaces:
        raise RobotError(
            f"{motion.task.name}: found a limit surface ({', '.join(motion.robot.limit_surfaces)}), expected none: "
            "MuJoCo does not know them"
        )
    if motion.compliant:
        raise RobotError(
            f"{motion.task.name}: found contacts with stiffness ({', '.join(one.name for one in motion.compliant)}), "
            "expected none: the stiffness of MuJoCo's contacts is one per mass"
        )
    bounces = any(restitution_of(motion.task, name) for name in motion.scene.geometries)
    time_step = BOUNCING_TIME_STEP if bounces else TIME_STEP
    spec = mujoco.MjSpec()
    spec.modelname = motion.task.name
    spec.compiler.degree, spec.compiler.inertiafromgeom = False, mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    spec.option.timestep, spec.option.gravity = time_step, motion.robot.model.gravity.linear
    spec.option.cone, spec.option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, IMPEDANCE_RATIO
    spec.option.tolerance, spec.option.iterations = 1e-12, 100
    bodies = add_bodies(spec, motion.robot, mass=mass, time_step=time_step)
    contacts = Contacts(spec, bodies, motion, friction=friction, sliding=sliding, time_step=time_step)
    motors = Motors(spec, motion)
    if shapes:
        from fesd_robot.in_mujoco.shapes import add_shapes  # meshes take long to read

        add_shapes(spec, bodies)
        spec.worldbody.add_light(pos=[0, 0, 10], dir=[0, 0, -1], type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL)
    try:
        model = spec.compile()
    except ValueError as error:
        words = " ".join(str(error).split()).rstrip(".")
        raise RobotError(f"{motion.robot.source}: MuJoCo cannot read this robot: {words}") from error
    notes = [*contacts.notes, *([motors.note] if motors.note else [])]
    return MujocoScene(
        motion,
        spec,
        model,
        Coordinates(motion.robot, model),
        motors,
        tuple(notes),
        _pair_contacts(model, contacts),
    )


def scene_file(plan: Plan) -> bytes:
    """Return the scene of a plan in MuJoCo's XML, with the shapes by which the robot is seen.

    Args:
        plan: from `plan` or `read_plan`.

    Raises:
        TaskError: a file that its task names cannot be read any more.
        RobotError: a robot that MuJoCo cannot have.
    """
    motion = formulate(task_of(plan), driven=False)
    return mujoco_scene(motion, sliding=sliding_contacts(plan), shapes=True).xml().encode()


def _pair_contacts(model: mujoco.MjModel, contacts: Contacts) -> dict[tuple[int, int], int]:
    """Return the number of the contact of every pair of shapes, in both orders."""
    result = {}
    for number, pairs in enumerate(contacts.pairs.values()):
        for name in pairs:
            pair = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_PAIR, name)
            first, second = int(model.pair_geom1[pair]), int(model.pair_geom2[pair])
            result[first, second] = result[second, first] = number
    return result
