"""The task: everything a user says about one motion, keyed by name, in SI units and radians."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from pydantic import Field, PrivateAttr, model_validator

from fesd_robot.errors import TaskError, nearest, nearest_file
from fesd_robot.task.audit import AuditLimits
from fesd_robot.task.bodies import Body, BodyName, ModelBody
from fesd_robot.task.consistency import consistency_errors
from fesd_robot.task.constraints import Constraint
from fesd_robot.task.contacts import BodyContact, Contact, SingleContact, TwoBodyContact
from fesd_robot.task.costs import Costs
from fesd_robot.task.endpoints import Horizon, Initial
from fesd_robot.task.fields import Acceleration, Name, Section, Values, conflict
from fesd_robot.task.goal import Goal, Waypoint
from fesd_robot.task.ground import GROUND, Ground, Plane
from fesd_robot.task.limits import Limits, Reserve
from fesd_robot.task.method import IMPULSES_RATIO, Method, Output, Solver
from fesd_robot.task.origins import KeyPath, Origins
from fesd_robot.task.reference import Line, Reference
from fesd_robot.task.robot import EXAMPLE_ROBOT_PREFIX, PACKAGE_PREFIX, Robot
from fesd_robot.task.surfaces import Surfaces


class Task(Section):
    """One motion to plan: robot, ground, contacts, horizon, goal, and how to solve for it."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")] = Field(
        description="Name of the task; files are named after it, so letters, digits, '_', '-' and '.' only."
    )
    robot: Robot = Field(description="The robot: its model, its root, which joints move and which are driven.")
    bodies: dict[BodyName, Body] = Field(
        default_factory=dict,
        description="Name of a body beside the robot -> its model file or its shape, and its root. The name and a dot "
        "stand in front of the names of its joints, coordinates and frames; its first link has the name alone.",
    )
    ground: Ground = Field(default_factory=Plane, description="The ground; default: horizontal plane at height 0 m.")
    surfaces: Surfaces = Field(
        default_factory=dict,
        description="Name of a box or cylinder to stand on or to touch -> its shape and place; contacts choose it by "
        "that name as their surface; default: none.",
    )
    gravity: Acceleration | None = Field(
        default=None,
        description="Acceleration of free fall along the axes of the world, [x, y, z] in m/s2; [0, 0, 0] where the x-z "
        "plane is a table seen from above, or in orbit. Default: the model's, [0, 0, -9.81] unless its file says "
        "otherwise.",
    )
    contacts: dict[Name, Contact] = Field(
        description="Name of a contact -> the point or circle of the robot and the surface that it may touch: the "
        "ground, a wall, a box or cylinder, another part of the robot; {} for a motion without contact.",
    )
    horizon: Horizon = Field(description="Duration, s, and number of control intervals.")
    postures: dict[Name, Values] = Field(
        default_factory=dict,
        description="Name of a posture -> name of a configuration coordinate -> value, m or rad; start, goal and "
        "waypoints use it with 'posture'.",
    )
    initial: Initial = Field(default_factory=Initial, description="State at time 0, m, rad, m/s, rad/s.")
    goal: Goal = Field(
        default_factory=Goal,
        description="State wanted at the end, m, rad, m/s, rad/s; default: at rest where the motion began.",
    )
    waypoints: list[Waypoint] = Field(
        default_factory=list, description="States that the motion should pass on its way, in the order of time."
    )
    reference: Reference = Field(
        default_factory=lambda: Line(type="line"),
        description="Motion that the costs compare with and the solver starts from; default: a straight line.",
    )
    costs: Costs = Field(default_factory=Costs, description="Weights of the cost.")
    limits: Limits = Field(default_factory=Limits, description="Limits that replace those of the robot model.")
    reserve: Reserve = Field(
        default_factory=Reserve,
        description="What a plan leaves unused of friction and effort; checks are against all of it. Default: nothing.",
    )
    constraints: dict[Name, Constraint] = Field(
        default_factory=dict, description="Name of a constraint -> what the motion must keep to besides its limits."
    )
    method: Method = Field(default_factory=Method, description="How the motion is discretised.")
    solver: Solver = Field(default_factory=Solver, description="How the resulting problem is solved.")
    audit: AuditLimits = Field(
        default_factory=AuditLimits, description="Limits of the audit in place of its own; a plan's report names them."
    )
    output: Output = Field(default_factory=Output, description="Which optional files are written.")

    _origins: Origins = PrivateAttr(default_factory=Origins)

    @model_validator(mode="after")
    def _consistent(self) -> Task:
        for error in consistency_errors(self):
            raise error
        return self

    @model_validator(mode="after")
    def _ratio_of_impulses(self) -> Task:
        if self.method.contact == "impulses" and "velocity_level_ratio" not in self.solver.model_fields_set:
            solver = self.solver.model_copy(update={"velocity_level_ratio": IMPULSES_RATIO})
            object.__setattr__(self, "solver", solver)  # a default that depends on another section
        return self

    @model_validator(mode="after")
    def _surfaces_exist(self) -> Task:
        for name in self.surfaces:
            if name in self.ground.walls:
                raise conflict(("surfaces", name), f"found '{name}' twice, it is a wall in ground.walls too")
        surfaces = [GROUND, *self.ground.walls, *self.surfaces]
        for name, contact in self.contacts.items():
            if not isinstance(contact, TwoBodyContact) and contact.surface not in surfaces:
                raise conflict(
                    ("contacts", name, "surface"),
                    f"found '{contact.surface}', expected '{GROUND}', the name of a wall in ground.walls or a name in "
                    f"surfaces{nearest(contact.surface, surfaces)}",
                )
        return self

    @property
    def states(self) -> list[tuple[KeyPath, Initial | Goal | Waypoint]]:
        """The start, the goal and every waypoint, each with its key path."""
        waypoints = [(("waypoints", str(i)), waypoint) for i, waypoint in enumerate(self.waypoints)]
        return [(("initial",), self.initial), (("goal",), self.goal), *waypoints]

    @property
    def single_contacts(self) -> dict[str, SingleContact]:
        """The contacts by name, without those of bodies, which are places before a task becomes a problem."""
        return {name: one for name, one in self.contacts.items() if not isinstance(one, BodyContact)}

    @property
    def rigid_contacts(self) -> dict[str, SingleContact]:
        """The contacts by name that do not give way."""
        return {name: one for name, one in self.single_contacts.items() if one.stiffness is None}

    @property
    def compliant_contacts(self) -> dict[str, SingleContact]:
        """The contacts by name that give way, those with a stiffness."""
        return {name: one for name, one in self.single_contacts.items() if one.stiffness is not None}

    @property
    def has_untouched_ground(self) -> bool:
        """Whether nothing falls on the ground or touches it, as where the plane of the motion is a table."""
        touching = any(getattr(contact, "surface", None) == GROUND for contact in self.contacts.values())
        return self.gravity is not None and not any(self.gravity) and not touching

    def inside(self, surface: str) -> str:
        """Return where a point is whose distance from a surface is negative, as the end of a sentence."""
        if surface == GROUND:
            return "below the ground"
        return f"beyond the wall '{surface}'" if surface in self.ground.walls else f"inside '{surface}'"

    @property
    def folder(self) -> Path:
        """Where relative paths start: the folder of the task file, the working directory for a task made in Python."""
        return self._origins.folder

    @property
    def origins(self) -> Origins:
        """Where each key came from."""
        return self._origins

    def with_origins(self, origins: Origins) -> Task:
        """Return the same task that remembers where its keys came from."""
        task = self.model_copy()
        task._origins = origins
        return task

    def error(self, key_path: Sequence[str] | str, message: str) -> TaskError:
        """Return the error about one key, with the file and line of the key or of its nearest parent.

        Args:
            key_path: dotted text, or the keys one by one (needed if a name contains a dot).
            message: what was found and what was expected, one sentence without a full stop.
        """
        path = tuple(key_path.split(".")) if isinstance(key_path, str) else tuple(key_path)
        return self._origins.error(path, message)

    def locate_model(self, body: str | None = None) -> Path | str:
        """Return the absolute path of a model file, or its address in a package unchanged.

        Args:
            body: name of a body with a model file; default: the robot.

        Raises:
            TaskError: there is no such file.
        """
        at: KeyPath = ("robot",) if body is None else ("bodies", body)
        section = self.robot if body is None else self.bodies[body]
        assert isinstance(section, Robot | ModelBody)
        model = section.model
        if model.startswith((EXAMPLE_ROBOT_PREFIX, PACKAGE_PREFIX)):
            return model
        path = self.folder / model
        if not path.is_file():
            hint = " ('~' and '$' are taken literally)" if model.startswith(("~", "$")) else ""
            raise self.error(
                (*at, "model"), f"found '{model}', but there is no file {path}{hint or nearest_file(path)}"
            )
        return path.absolute()
