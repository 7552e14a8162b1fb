"""Robot models: Pinocchio reads the file, CasADi gets its equations of motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fesd_robot.lazy import lazy_exports

__all__ = [
    "FLYER_HEIGHT",
    "PACKAGE",
    "PLANAR_VELOCITY_NAMES",
    "PREFIX",
    "ROOT_HEIGHT",
    "ROOT_PITCH",
    "SAGITTAL_NAMES",
    "STANDARD_GRAVITY",
    "BodyShapes",
    "BoxShape",
    "Depth",
    "Entry",
    "Link",
    "Outline",
    "Placed",
    "Prismatic",
    "Robot",
    "Root",
    "RoundShape",
    "SimpleShape",
    "UniformSolid",
    "angle_between",
    "angle_expressions",
    "ball",
    "beside",
    "box",
    "center_of_mass",
    "changes_alone",
    "configuration_derivative",
    "configuration_units",
    "continuous_quaternions",
    "coupling_signs",
    "cylinder",
    "damping_force",
    "deviation",
    "deviation_units",
    "difference",
    "distance_rows",
    "enclosing",
    "example_robots",
    "examples_folder",
    "frame_jacobian",
    "frame_placement",
    "frame_velocity",
    "immovable_joints",
    "integrate",
    "interpolated",
    "is_height",
    "kind_of",
    "kinetic_energy",
    "load_robot",
    "load_scaled",
    "lock_joints",
    "mass_matrix",
    "measured_deviation",
    "name_on",
    "nonlinear_effects",
    "outline_points",
    "placed",
    "potential_energy",
    "propose_sagittal",
    "quaternion_matrix",
    "rnea",
    "root_height",
    "shapes_of_body",
    "simple_shape",
    "slerp",
    "spring_force",
    "square_placements",
    "touching_outlines",
    "turned",
    "turned_by",
    "velocity_units",
    "with_frames",
    "with_gravity",
    "with_joint_properties",
    "with_limit_surfaces",
    "with_turn",
]

if TYPE_CHECKING:
    from fesd_robot.robot.bodies import beside
    from fesd_robot.robot.body_names import name_on
    from fesd_robot.robot.body_shapes import BodyShapes, Depth, outline_points
    from fesd_robot.robot.catalogue import Entry
    from fesd_robot.robot.couple import coupling_signs
    from fesd_robot.robot.distance import Placed, distance_rows, placed
    from fesd_robot.robot.dynamics import (
        damping_force,
        kinetic_energy,
        mass_matrix,
        nonlinear_effects,
        potential_energy,
        rnea,
        spring_force,
    )
    from fesd_robot.robot.immovable import immovable_joints
    from fesd_robot.robot.joints import Prismatic
    from fesd_robot.robot.kinematics import center_of_mass, frame_jacobian, frame_placement, frame_velocity
    from fesd_robot.robot.library import PREFIX, example_robots, examples_folder
    from fesd_robot.robot.load import (
        load_robot,
        load_scaled,
        with_frames,
        with_gravity,
        with_joint_properties,
        with_limit_surfaces,
    )
    from fesd_robot.robot.lock import lock_joints
    from fesd_robot.robot.manifold import configuration_derivative, difference, integrate
    from fesd_robot.robot.orientations import (
        angle_between,
        angle_expressions,
        deviation,
        interpolated,
        measured_deviation,
        slerp,
        turned,
        turned_by,
        with_turn,
    )
    from fesd_robot.robot.outline import Outline, touching_outlines
    from fesd_robot.robot.paths import PACKAGE
    from fesd_robot.robot.right_angles import square_placements
    from fesd_robot.robot.robot import Robot
    from fesd_robot.robot.root import (
        FLYER_HEIGHT,
        PLANAR_VELOCITY_NAMES,
        ROOT_HEIGHT,
        ROOT_PITCH,
        SAGITTAL_NAMES,
        Root,
        changes_alone,
        is_height,
        root_height,
    )
    from fesd_robot.robot.rotations import continuous_quaternions, quaternion_matrix
    from fesd_robot.robot.round_shapes import (
        BoxShape,
        RoundShape,
        SimpleShape,
        enclosing,
        kind_of,
        shapes_of_body,
        simple_shape,
    )
    from fesd_robot.robot.sagittal import propose_sagittal
    from fesd_robot.robot.simple_body import UniformSolid, ball, box, cylinder
    from fesd_robot.robot.tree import Link
    from fesd_robot.robot.units import STANDARD_GRAVITY, configuration_units, deviation_units, velocity_units
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "fesd_robot.robot.bodies": ["beside"],
            "fesd_robot.robot.body_names": ["name_on"],
            "fesd_robot.robot.body_shapes": ["BodyShapes", "Depth", "outline_points"],
            "fesd_robot.robot.catalogue": ["Entry"],
            "fesd_robot.robot.couple": ["coupling_signs"],
            "fesd_robot.robot.distance": ["Placed", "distance_rows", "placed"],
            "fesd_robot.robot.dynamics": [
                "damping_force",
                "kinetic_energy",
                "mass_matrix",
                "nonlinear_effects",
                "potential_energy",
                "rnea",
                "spring_force",
            ],
            "fesd_robot.robot.immovable": ["immovable_joints"],
            "fesd_robot.robot.joints": ["Prismatic"],
            "fesd_robot.robot.kinematics": ["center_of_mass", "frame_jacobian", "frame_placement", "frame_velocity"],
            "fesd_robot.robot.library": ["PREFIX", "example_robots", "examples_folder"],
            "fesd_robot.robot.load": [
                "load_robot",
                "load_scaled",
                "with_frames",
                "with_gravity",
                "with_joint_properties",
                "with_limit_surfaces",
            ],
            "fesd_robot.robot.lock": ["lock_joints"],
            "fesd_robot.robot.manifold": ["configuration_derivative", "difference", "integrate"],
            "fesd_robot.robot.orientations": [
                "angle_between",
                "angle_expressions",
                "deviation",
                "interpolated",
                "measured_deviation",
                "slerp",
                "turned",
                "turned_by",
                "with_turn",
            ],
            "fesd_robot.robot.outline": ["Outline", "touching_outlines"],
            "fesd_robot.robot.paths": ["PACKAGE"],
            "fesd_robot.robot.right_angles": ["square_placements"],
            "fesd_robot.robot.robot": ["Robot"],
            "fesd_robot.robot.root": [
                "FLYER_HEIGHT",
                "ROOT_HEIGHT",
                "ROOT_PITCH",
                "Root",
                "PLANAR_VELOCITY_NAMES",
                "SAGITTAL_NAMES",
                "STANDARD_GRAVITY",
                "changes_alone",
                "is_height",
                "root_height",
            ],
            "fesd_robot.robot.rotations": ["continuous_quaternions", "quaternion_matrix"],
            "fesd_robot.robot.round_shapes": [
                "BoxShape",
                "RoundShape",
                "SimpleShape",
                "enclosing",
                "kind_of",
                "shapes_of_body",
                "simple_shape",
            ],
            "fesd_robot.robot.sagittal": ["propose_sagittal"],
            "fesd_robot.robot.simple_body": ["UniformSolid", "ball", "box", "cylinder"],
            "fesd_robot.robot.tree": ["Link"],
            "fesd_robot.robot.units": ["STANDARD_GRAVITY", "configuration_units", "deviation_units", "velocity_units"],
        },
    )
