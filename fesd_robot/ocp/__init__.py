"""From a task in names to an optimal control problem in vectors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fesd_robot.lazy import lazy_exports

__all__ = [
    "AUTOMATIC_AUXILIARY_FORCE",
    "TOUCHING",
    "Actuation",
    "DeterminacyConstraint",
    "MotionProblem",
    "Setup",
    "StateLimits",
    "TimeGrid",
    "apex_in_place",
    "assembled_plan",
    "build_actuation",
    "columns_of_csv",
    "conflict_of",
    "contact_images",
    "endpoints_of",
    "formulate",
    "friction_of",
    "gap_function",
    "ground_of",
    "homotopy_options",
    "is_plan",
    "limits_of",
    "load_task_robot",
    "mirrored",
    "model_motion_of",
    "motion_audit",
    "motion_outcome",
    "numeric_physics",
    "physical_motion",
    "posture_of",
    "reference_of",
    "restitution_of",
    "scene_of",
    "solid_of",
    "standings_of",
    "surfaces_of",
    "time_grid",
    "touching_configuration",
    "waypoint_times",
    "with_default_tolerances",
    "with_full_model",
    "with_gaps",
    "with_hard_goal",
]

if TYPE_CHECKING:
    from fesd_robot.ocp.actuation import Actuation, build_actuation
    from fesd_robot.ocp.assembled import assembled_plan, model_motion_of, with_full_model, with_gaps
    from fesd_robot.ocp.default_costs import apex_in_place
    from fesd_robot.ocp.default_tolerances import with_default_tolerances
    from fesd_robot.ocp.determinacy import DeterminacyConstraint
    from fesd_robot.ocp.formulation import AUTOMATIC_AUXILIARY_FORCE, MotionProblem, formulate
    from fesd_robot.ocp.judged import (
        conflict_of,
        motion_audit,
        motion_outcome,
        numeric_physics,
        physical_motion,
        with_hard_goal,
    )
    from fesd_robot.ocp.mirror import contact_images
    from fesd_robot.ocp.reference_file import columns_of_csv, is_plan
    from fesd_robot.ocp.reference_types import reference_of
    from fesd_robot.ocp.scene import friction_of, ground_of, restitution_of, scene_of, solid_of, surfaces_of
    from fesd_robot.ocp.setup import Setup, gap_function
    from fesd_robot.ocp.solver_options import homotopy_options
    from fesd_robot.ocp.standing import posture_of, standings_of, touching_configuration
    from fesd_robot.ocp.start import TOUCHING
    from fesd_robot.ocp.targets import waypoint_times
    from fesd_robot.ocp.task_robot import load_task_robot
    from fesd_robot.ocp.timing import TimeGrid, time_grid
    from fesd_robot.ocp.vectors import StateLimits, endpoints_of, limits_of, mirrored
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "fesd_robot.ocp.actuation": ["Actuation", "build_actuation"],
            "fesd_robot.ocp.assembled": ["assembled_plan", "model_motion_of", "with_full_model", "with_gaps"],
            "fesd_robot.ocp.determinacy": ["DeterminacyConstraint"],
            "fesd_robot.ocp.formulation": ["AUTOMATIC_AUXILIARY_FORCE", "MotionProblem", "formulate"],
            "fesd_robot.ocp.judged": [
                "conflict_of",
                "motion_audit",
                "motion_outcome",
                "numeric_physics",
                "physical_motion",
                "with_hard_goal",
            ],
            "fesd_robot.ocp.default_costs": ["apex_in_place"],
            "fesd_robot.ocp.default_tolerances": ["with_default_tolerances"],
            "fesd_robot.ocp.mirror": ["contact_images"],
            "fesd_robot.ocp.reference_file": ["columns_of_csv", "is_plan"],
            "fesd_robot.ocp.reference_types": ["reference_of"],
            "fesd_robot.ocp.scene": [
                "friction_of",
                "ground_of",
                "restitution_of",
                "scene_of",
                "solid_of",
                "surfaces_of",
            ],
            "fesd_robot.ocp.setup": ["Setup", "gap_function"],
            "fesd_robot.ocp.solver_options": ["homotopy_options"],
            "fesd_robot.ocp.standing": ["posture_of", "standings_of", "touching_configuration"],
            "fesd_robot.ocp.start": ["TOUCHING"],
            "fesd_robot.ocp.targets": ["waypoint_times"],
            "fesd_robot.ocp.task_robot": ["load_task_robot"],
            "fesd_robot.ocp.timing": ["TimeGrid", "time_grid"],
            "fesd_robot.ocp.vectors": ["StateLimits", "endpoints_of", "limits_of", "mirrored"],
        },
    )
