"""Robot models: Pinocchio reads the file, CasADi gets its equations of motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fesd_robot.lazy import lazy_exports

__all__ = [
    "Robot",
    "center_of_mass",
    "configuration_derivative",
    "damping_force",
    "difference",
    "example_robots",
    "frame_jacobian",
    "frame_placement",
    "frame_velocity",
    "integrate",
    "kinetic_energy",
    "load_robot",
    "mass_matrix",
    "nonlinear_effects",
    "potential_energy",
    "rnea",
    "spring_force",
    "with_joint_properties",
]

if TYPE_CHECKING:
    from fesd_robot.robot.dynamics import (
        damping_force,
        kinetic_energy,
        mass_matrix,
        nonlinear_effects,
        potential_energy,
        rnea,
        spring_force,
    )
    from fesd_robot.robot.kinematics import center_of_mass, frame_jacobian, frame_placement, frame_velocity
    from fesd_robot.robot.library import example_robots
    from fesd_robot.robot.load import load_robot, with_joint_properties
    from fesd_robot.robot.manifold import configuration_derivative, difference, integrate
    from fesd_robot.robot.robot import Robot
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "fesd_robot.robot.dynamics": [
                "damping_force",
                "kinetic_energy",
                "mass_matrix",
                "nonlinear_effects",
                "potential_energy",
                "rnea",
                "spring_force",
            ],
            "fesd_robot.robot.kinematics": [
                "center_of_mass",
                "frame_jacobian",
                "frame_placement",
                "frame_velocity",
            ],
            "fesd_robot.robot.library": ["example_robots"],
            "fesd_robot.robot.load": ["load_robot", "with_joint_properties"],
            "fesd_robot.robot.manifold": ["configuration_derivative", "difference", "integrate"],
            "fesd_robot.robot.robot": ["Robot"],
        },
    )
