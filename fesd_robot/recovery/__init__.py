"""The way back: from finite elements in numerical time to motion in physical time, and its physics in numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fesd_robot.lazy import lazy_exports

__all__ = [
    "FRACTIONS",
    "IN_THE_PLANE",
    "SLIP_VELOCITY",
    "Compliance",
    "DenseElement",
    "DenseSamples",
    "DryFriction",
    "ElementPolynomials",
    "FullModel",
    "FullMotion",
    "ImpactRecord",
    "JointFriction",
    "Kind",
    "ModelMotion",
    "NumericPhysics",
    "PhysicalMotion",
    "SwitchRecord",
    "by_contact",
    "closest",
    "cone_facets",
    "holding_effort",
    "kinds_of_change",
    "normal_rows",
    "recover",
    "split_contact_force",
    "split_forces",
    "stacked_elements",
    "stacked_rows",
    "tangential_rows",
    "tangents_between",
]

if TYPE_CHECKING:
    from fesd_robot.recovery.between import FRACTIONS, DenseElement, DenseSamples, stacked_elements
    from fesd_robot.recovery.between_bodies import closest, tangents_between
    from fesd_robot.recovery.contact_rows import (
        IN_THE_PLANE,
        by_contact,
        cone_facets,
        normal_rows,
        stacked_rows,
        tangential_rows,
    )
    from fesd_robot.recovery.dry_friction import DryFriction
    from fesd_robot.recovery.elements import SLIP_VELOCITY
    from fesd_robot.recovery.full_model import FullModel, FullMotion
    from fesd_robot.recovery.model_motion import ModelMotion
    from fesd_robot.recovery.motion import Compliance, JointFriction, PhysicalMotion, recover
    from fesd_robot.recovery.physics import NumericPhysics, split_contact_force, split_forces
    from fesd_robot.recovery.polynomials import ElementPolynomials
    from fesd_robot.recovery.samples import ImpactRecord
    from fesd_robot.recovery.statics import holding_effort
    from fesd_robot.recovery.switches import Kind, SwitchRecord, kinds_of_change
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "fesd_robot.recovery.between": ["DenseElement", "DenseSamples", "FRACTIONS", "stacked_elements"],
            "fesd_robot.recovery.between_bodies": ["closest", "tangents_between"],
            "fesd_robot.recovery.contact_rows": [
                "IN_THE_PLANE",
                "by_contact",
                "cone_facets",
                "normal_rows",
                "stacked_rows",
                "tangential_rows",
            ],
            "fesd_robot.recovery.elements": ["SLIP_VELOCITY"],
            "fesd_robot.recovery.full_model": ["FullModel", "FullMotion"],
            "fesd_robot.recovery.model_motion": ["ModelMotion"],
            "fesd_robot.recovery.motion": ["Compliance", "JointFriction", "PhysicalMotion", "recover"],
            "fesd_robot.recovery.dry_friction": ["DryFriction"],
            "fesd_robot.recovery.physics": ["NumericPhysics", "split_contact_force", "split_forces"],
            "fesd_robot.recovery.polynomials": ["ElementPolynomials"],
            "fesd_robot.recovery.samples": ["ImpactRecord"],
            "fesd_robot.recovery.statics": ["holding_effort"],
            "fesd_robot.recovery.switches": ["Kind", "SwitchRecord", "kinds_of_change"],
        },
    )
