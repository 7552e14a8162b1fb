"""Robot models: Pinocchio reads the file, CasADi gets its equations of motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

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
    "with_joint_properties",
]

_HOME = {
    "Robot": "robot",
    "load_robot": "load",
    "with_joint_properties": "load",
    "example_robots": "library",
    "configuration_derivative": "manifold",
    "integrate": "manifold",
    "difference": "manifold",
    "frame_placement": "kinematics",
    "frame_velocity": "kinematics",
    "frame_jacobian": "kinematics",
    "center_of_mass": "kinematics",
    "damping_force": "dynamics",
    "rnea": "dynamics",
    "nonlinear_effects": "dynamics",
    "mass_matrix": "dynamics",
    "kinetic_energy": "dynamics",
    "potential_energy": "dynamics",
}

if TYPE_CHECKING:
    from fesd_robot.robot.dynamics import (
        damping_force,
        kinetic_energy,
        mass_matrix,
        nonlinear_effects,
        potential_energy,
        rnea,
    )
    from fesd_robot.robot.kinematics import center_of_mass, frame_jacobian, frame_placement, frame_velocity
    from fesd_robot.robot.library import example_robots
    from fesd_robot.robot.load import load_robot, with_joint_properties
    from fesd_robot.robot.manifold import configuration_derivative, difference, integrate
    from fesd_robot.robot.robot import Robot


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'fesd_robot.robot' has no attribute '{name}'")
    import importlib

    return getattr(importlib.import_module(f"fesd_robot.robot.{_HOME[name]}"), name)
