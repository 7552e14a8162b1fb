"""The task file: what a user writes, loaded and checked.

from fesd_robot.task import load_task
task = load_task("tasks/hopper_one_jump.yaml", ["horizon.intervals=30"])
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from fesd_robot.lazy import lazy_exports

__all__ = [
    "AXES",
    "COST_TERMS",
    "DEFAULT_TOLERANCE",
    "EXAMPLE_ROBOT_PREFIX",
    "GROUND",
    "PACKAGE_PREFIX",
    "SCHEMA_FILE",
    "Actuator",
    "AvoidBox",
    "AvoidEllipse",
    "AvoidSphere",
    "BallBody",
    "BodyContact",
    "BodyDistance",
    "BodyPoint",
    "BoxBody",
    "BoxObstacle",
    "BoxSurface",
    "CapsuleObstacle",
    "CircleBoxContact",
    "CircleCircleContact",
    "CircleContact",
    "Clearance",
    "Configured",
    "Constraint",
    "Contact",
    "ContactWindow",
    "Costs",
    "CylinderBody",
    "CylinderSurface",
    "DistanceConstraint",
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
    "GroundShape",
    "HeightMap",
    "Horizon",
    "Initial",
    "JointActuator",
    "Jumps",
    "KeyPath",
    "Limits",
    "Line",
    "Method",
    "ModelBody",
    "NameKind",
    "Obstacle",
    "ObstacleDistance",
    "Origin",
    "Origins",
    "Output",
    "Periodic",
    "PlacedContact",
    "Plane",
    "PointContact",
    "PointTarget",
    "Reference",
    "Renaming",
    "Reserve",
    "Robot",
    "SingleContact",
    "SolidSurface",
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
    "TwoNamesError",
    "Wall",
    "Waypoint",
    "along_axes",
    "check_names",
    "check_orientations",
    "check_values",
    "coarser_intervals",
    "enumerated",
    "evaluate_expression",
    "expression_names",
    "listed",
    "load_task",
    "override_keys",
    "rename_keys",
    "task_json_schema",
    "task_json_schema_text",
    "today",
    "validation_error",
]

if TYPE_CHECKING:
    from fesd_robot.task.bodies import BallBody, BoxBody, CylinderBody, ModelBody
    from fesd_robot.task.consistency import coarser_intervals
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
        PlacedContact,
        PointContact,
        SingleContact,
        TwoBodyContact,
    )
    from fesd_robot.task.costs import COST_TERMS, Costs
    from fesd_robot.task.distances import (
        BodyDistance,
        BoxObstacle,
        CapsuleObstacle,
        DistanceConstraint,
        Obstacle,
        ObstacleDistance,
    )
    from fesd_robot.task.document import override_keys
    from fesd_robot.task.endpoints import FreeDuration, Horizon, Initial
    from fesd_robot.task.expression import evaluate_expression, expression_names
    from fesd_robot.task.fields import AXES, NameKind
    from fesd_robot.task.goal import DEFAULT_TOLERANCE, Goal, Periodic, PointTarget, Tolerance, Waypoint
    from fesd_robot.task.ground import GROUND, Ground, GroundShape, HeightMap, Plane, Step, Steps, Wall
    from fesd_robot.task.json_schema import SCHEMA_FILE, task_json_schema, task_json_schema_text
    from fesd_robot.task.limits import Limits, Reserve, SpeedOfTime
    from fesd_robot.task.load import load_task
    from fesd_robot.task.messages import validation_error
    from fesd_robot.task.method import (
        FigureFormat,
        FigureWidth,
        Formulation,
        Method,
        Output,
        Solver,
        StepEquilibration,
    )
    from fesd_robot.task.names import check_names, check_values
    from fesd_robot.task.orientations import check_orientations
    from fesd_robot.task.origins import KeyPath, Origin, Origins
    from fesd_robot.task.reference import FromFile, Jumps, Line, Reference, ThroughWaypoints
    from fesd_robot.task.renamed_keys import Renaming, TwoNamesError, rename_keys, today
    from fesd_robot.task.robot import (
        EXAMPLE_ROBOT_PREFIX,
        PACKAGE_PREFIX,
        Actuator,
        GeneralizedForceActuator,
        JointActuator,
        Robot,
    )
    from fesd_robot.task.schema import Task
    from fesd_robot.task.standing import Configured, StandOn
    from fesd_robot.task.surfaces import BoxSurface, CylinderSurface, SolidSurface
    from fesd_robot.task.words import along_axes, enumerated, listed
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "fesd_robot.task.bodies": ["BallBody", "BoxBody", "CylinderBody", "ModelBody"],
            "fesd_robot.task.consistency": ["coarser_intervals"],
            "fesd_robot.task.constraints": [
                "AvoidBox",
                "AvoidEllipse",
                "AvoidSphere",
                "BodyPoint",
                "Clearance",
                "Constraint",
                "ContactWindow",
                "ForbiddenZone",
                "FrameLimits",
                "SwingClearance",
            ],
            "fesd_robot.task.contacts": [
                "BodyContact",
                "CircleBoxContact",
                "CircleCircleContact",
                "CircleContact",
                "Contact",
                "PlacedContact",
                "PointContact",
                "SingleContact",
                "TwoBodyContact",
            ],
            "fesd_robot.task.costs": ["COST_TERMS", "Costs"],
            "fesd_robot.task.distances": [
                "BodyDistance",
                "BoxObstacle",
                "CapsuleObstacle",
                "DistanceConstraint",
                "Obstacle",
                "ObstacleDistance",
            ],
            "fesd_robot.task.document": ["override_keys"],
            "fesd_robot.task.endpoints": ["FreeDuration", "Horizon", "Initial"],
            "fesd_robot.task.expression": ["evaluate_expression", "expression_names"],
            "fesd_robot.task.fields": ["AXES", "NameKind"],
            "fesd_robot.task.goal": ["DEFAULT_TOLERANCE", "Goal", "Periodic", "PointTarget", "Tolerance", "Waypoint"],
            "fesd_robot.task.ground": [
                "GROUND",
                "Ground",
                "HeightMap",
                "Plane",
                "GroundShape",
                "Step",
                "Steps",
                "Wall",
            ],
            "fesd_robot.task.json_schema": ["SCHEMA_FILE", "task_json_schema", "task_json_schema_text"],
            "fesd_robot.task.limits": ["Limits", "Reserve", "SpeedOfTime"],
            "fesd_robot.task.load": ["load_task"],
            "fesd_robot.task.messages": ["validation_error"],
            "fesd_robot.task.method": [
                "FigureFormat",
                "FigureWidth",
                "Formulation",
                "Method",
                "Output",
                "Solver",
                "StepEquilibration",
            ],
            "fesd_robot.task.names": ["check_names", "check_values"],
            "fesd_robot.task.orientations": ["check_orientations"],
            "fesd_robot.task.origins": ["KeyPath", "Origin", "Origins"],
            "fesd_robot.task.reference": ["FromFile", "Jumps", "Line", "Reference", "ThroughWaypoints"],
            "fesd_robot.task.renamed_keys": ["Renaming", "TwoNamesError", "rename_keys", "today"],
            "fesd_robot.task.robot": [
                "Actuator",
                "EXAMPLE_ROBOT_PREFIX",
                "GeneralizedForceActuator",
                "JointActuator",
                "PACKAGE_PREFIX",
                "Robot",
            ],
            "fesd_robot.task.schema": ["Task"],
            "fesd_robot.task.standing": ["Configured", "StandOn"],
            "fesd_robot.task.surfaces": ["BoxSurface", "CylinderSurface", "SolidSurface"],
            "fesd_robot.task.words": ["along_axes", "enumerated", "listed"],
        },
    )
