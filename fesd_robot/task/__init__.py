"""The task file: what a user writes, loaded and checked.

from fesd_robot.task import load_task
task = load_task("tasks/hopper_one_jump.yaml", ["horizon.intervals=30"])
"""

from __future__ import annotations

from fesd_robot.task.constraints import (
    AvoidBox,
    AvoidEllipse,
    AvoidSphere,
    BodyPoint,
    Clearance,
    Constraint,
    ContactWindow,
    ForbiddenZone,
    FrameLimits,
    SwingClearance,
)
from fesd_robot.task.contacts import (
    BodyContact,
    CircleBoxContact,
    CircleCircleContact,
    CircleContact,
    Contact,
    PointContact,
    TwoBodyContact,
)
from fesd_robot.task.costs import Costs
from fesd_robot.task.endpoints import FreeDuration, Horizon, Initial
from fesd_robot.task.expression import evaluate_expression, expression_names
from fesd_robot.task.goal import DEFAULT_TOLERANCE, Goal, Periodic, PointTarget, Tolerance, Waypoint
from fesd_robot.task.ground import GROUND, Ground, HeightMap, Plane, Step, Steps, Wall
from fesd_robot.task.json_schema import task_json_schema, task_json_schema_text
from fesd_robot.task.limits import Limits, SpeedOfTime
from fesd_robot.task.load import load_task
from fesd_robot.task.method import FigureFormat, FigureWidth, Formulation, Method, Output, Solver, StepEquilibration
from fesd_robot.task.names import check_names, check_values
from fesd_robot.task.reference import FromFile, Jumps, Line, Reference, ThroughWaypoints
from fesd_robot.task.robot import Actuator, GeneralizedForceActuator, JointActuator, Robot
from fesd_robot.task.schema import Task
from fesd_robot.task.standing import StandOn
from fesd_robot.task.surfaces import BoxSurface, CylinderSurface

__all__ = [
    "DEFAULT_TOLERANCE",
    "GROUND",
    "Actuator",
    "AvoidBox",
    "AvoidEllipse",
    "AvoidSphere",
    "BodyContact",
    "BodyPoint",
    "BoxSurface",
    "CircleBoxContact",
    "CircleCircleContact",
    "CircleContact",
    "Clearance",
    "Constraint",
    "Contact",
    "ContactWindow",
    "Costs",
    "CylinderSurface",
    "FigureFormat",
    "FigureWidth",
    "ForbiddenZone",
    "Formulation",
    "FrameLimits",
    "FreeDuration",
    "FromFile",
    "GeneralizedForceActuator",
    "Goal",
    "Ground",
    "HeightMap",
    "Horizon",
    "Initial",
    "JointActuator",
    "Jumps",
    "Limits",
    "Line",
    "Method",
    "Output",
    "Periodic",
    "Plane",
    "PointContact",
    "PointTarget",
    "Reference",
    "Robot",
    "Solver",
    "SpeedOfTime",
    "StandOn",
    "Step",
    "StepEquilibration",
    "Steps",
    "SwingClearance",
    "Task",
    "ThroughWaypoints",
    "Tolerance",
    "TwoBodyContact",
    "Wall",
    "Waypoint",
    "check_names",
    "check_values",
    "evaluate_expression",
    "expression_names",
    "load_task",
    "task_json_schema",
    "task_json_schema_text",
]
