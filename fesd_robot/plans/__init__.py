"""The result: a checked trajectory in physical time, its files and its report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fesd_robot.lazy import lazy_exports

__all__ = [
    "ANIMATION_FILE",
    "COMPARISON_FILE",
    "EXPORTS",
    "FIGURES_FOLDER",
    "FILES",
    "ORDER_MATTERS",
    "PAGE_FILE",
    "REPLAY",
    "Attempt",
    "Audit",
    "BranchNlpRecord",
    "ContactHistory",
    "FiniteElements",
    "LocalSearch",
    "MotionLimits",
    "Multipliers",
    "Names",
    "Outcome",
    "Plan",
    "PlanFileError",
    "ReferenceSegment",
    "Refinement",
    "SimulationNote",
    "SimulationSummary",
    "SolveEffort",
    "Statistics",
    "Status",
    "TrackingGains",
    "TriedSequence",
    "Units",
    "check_output_folder",
    "check_task_and_robot",
    "compliant_outcomes",
    "contact_outcomes",
    "contact_words",
    "control_interval",
    "controls_of",
    "count",
    "export",
    "findings_of_notes",
    "full_model_of",
    "goal_entries",
    "goal_words",
    "joint_friction_of",
    "joint_switches_of",
    "joint_trajectory",
    "landing_orders",
    "obstacle_geometry",
    "overlaps_of_motion",
    "place",
    "read_plan",
    "replay_entries",
    "replay_summary",
    "report",
    "resampled",
    "settings_line",
    "statistics_of",
    "status_of",
    "task_of",
    "task_to_improve",
    "task_to_refine",
    "use_warnings",
    "write_into",
    "write_or_keep",
    "write_plan",
]

if TYPE_CHECKING:
    from fesd_robot.errors import PlanFileError
    from fesd_robot.plans.assemble import controls_of
    from fesd_robot.plans.audit import MotionLimits
    from fesd_robot.plans.audit_record import Audit
    from fesd_robot.plans.body_distances import obstacle_geometry
    from fesd_robot.plans.columns import control_interval
    from fesd_robot.plans.consistency import check_task_and_robot
    from fesd_robot.plans.contact_outcome import compliant_outcomes, contact_outcomes
    from fesd_robot.plans.continued import task_to_improve, task_to_refine
    from fesd_robot.plans.exports import EXPORTS, export
    from fesd_robot.plans.exports.joint_trajectory import joint_trajectory
    from fesd_robot.plans.files import read_plan, write_into, write_or_keep, write_plan
    from fesd_robot.plans.findings import REPLAY, findings_of_notes
    from fesd_robot.plans.finite_elements import BranchNlpRecord, FiniteElements, Multipliers
    from fesd_robot.plans.full_model import full_model_of
    from fesd_robot.plans.gains import ReferenceSegment, TrackingGains
    from fesd_robot.plans.goal_outcome import goal_entries
    from fesd_robot.plans.joint_friction import joint_friction_of, joint_switches_of
    from fesd_robot.plans.landing_order import ORDER_MATTERS, landing_orders
    from fesd_robot.plans.measured import Names
    from fesd_robot.plans.origin import task_of
    from fesd_robot.plans.outcome import Outcome
    from fesd_robot.plans.outcome_words import contact_words, count, goal_words
    from fesd_robot.plans.overlaps import overlaps_of_motion
    from fesd_robot.plans.plan import (
        Attempt,
        ContactHistory,
        LocalSearch,
        Plan,
        Refinement,
        SimulationNote,
        SimulationSummary,
        Statistics,
        Status,
        TriedSequence,
        Units,
    )
    from fesd_robot.plans.replay_record import replay_entries, replay_summary
    from fesd_robot.plans.report_text import report
    from fesd_robot.plans.resample import resampled
    from fesd_robot.plans.results_folder import (
        ANIMATION_FILE,
        COMPARISON_FILE,
        FIGURES_FOLDER,
        FILES,
        PAGE_FILE,
        check_output_folder,
        place,
    )
    from fesd_robot.plans.statistics import SolveEffort, statistics_of
    from fesd_robot.plans.tables import settings_line
    from fesd_robot.plans.use_words import use_warnings
    from fesd_robot.plans.verdict import status_of
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "fesd_robot.errors": ["PlanFileError"],
            "fesd_robot.plans.assemble": ["controls_of"],
            "fesd_robot.plans.audit": ["MotionLimits"],
            "fesd_robot.plans.audit_record": ["Audit"],
            "fesd_robot.plans.body_distances": ["obstacle_geometry"],
            "fesd_robot.plans.columns": ["control_interval"],
            "fesd_robot.plans.consistency": ["check_task_and_robot"],
            "fesd_robot.plans.contact_outcome": ["compliant_outcomes", "contact_outcomes"],
            "fesd_robot.plans.continued": ["task_to_improve", "task_to_refine"],
            "fesd_robot.plans.exports": ["EXPORTS", "export"],
            "fesd_robot.plans.exports.joint_trajectory": ["joint_trajectory"],
            "fesd_robot.plans.files": ["read_plan", "write_into", "write_or_keep", "write_plan"],
            "fesd_robot.plans.findings": ["REPLAY", "findings_of_notes"],
            "fesd_robot.plans.finite_elements": ["BranchNlpRecord", "FiniteElements", "Multipliers"],
            "fesd_robot.plans.full_model": ["full_model_of"],
            "fesd_robot.plans.gains": ["ReferenceSegment", "TrackingGains"],
            "fesd_robot.plans.goal_outcome": ["goal_entries"],
            "fesd_robot.plans.joint_friction": ["joint_friction_of", "joint_switches_of"],
            "fesd_robot.plans.landing_order": ["ORDER_MATTERS", "landing_orders"],
            "fesd_robot.plans.measured": ["Names"],
            "fesd_robot.plans.origin": ["task_of"],
            "fesd_robot.plans.outcome": ["Outcome"],
            "fesd_robot.plans.outcome_words": ["contact_words", "count", "goal_words"],
            "fesd_robot.plans.overlaps": ["overlaps_of_motion"],
            "fesd_robot.plans.plan": [
                "Attempt",
                "ContactHistory",
                "LocalSearch",
                "Plan",
                "Refinement",
                "SimulationNote",
                "SimulationSummary",
                "Statistics",
                "Status",
                "TriedSequence",
                "Units",
            ],
            "fesd_robot.plans.replay_record": ["replay_entries", "replay_summary"],
            "fesd_robot.plans.report_text": ["report"],
            "fesd_robot.plans.resample": ["resampled"],
            "fesd_robot.plans.results_folder": [
                "ANIMATION_FILE",
                "COMPARISON_FILE",
                "FIGURES_FOLDER",
                "FILES",
                "PAGE_FILE",
                "check_output_folder",
                "place",
            ],
            "fesd_robot.plans.statistics": ["SolveEffort", "statistics_of"],
            "fesd_robot.plans.tables": ["settings_line"],
            "fesd_robot.plans.use_words": ["use_warnings"],
            "fesd_robot.plans.verdict": ["status_of"],
        },
    )
