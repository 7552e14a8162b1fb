"""The robots that every expression is compared on, each with all its expressions compiled into one function."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.robot import (
    Robot,
    center_of_mass,
    configuration_derivative,
    difference,
    frame_jacobian,
    frame_placement,
    frame_velocity,
    integrate,
    kinetic_energy,
    load_robot,
    mass_matrix,
    nonlinear_effects,
    potential_energy,
    rnea,
)

MODELS = Path(__file__).parent / "models"
HOPPER = Path(__file__).parents[2] / "models" / "hopper" / "hopper.urdf"

LEGS: dict[str, tuple[str, str, tuple[str, ...], tuple[str, ...]]] = {
    "solo12": ("{}_HAA", "{}_HFE {}_KFE", ("FL", "HL"), ("FR", "HR")),
    "a1": ("{}_hip_joint", "{}_thigh_joint {}_calf_joint", ("FL", "RL"), ("FR", "RR")),
    "go2": ("{}_hip_joint", "{}_thigh_joint {}_calf_joint", ("FL", "RL"), ("FR", "RR")),
    "bolt": ("{}_HAA", "{}_HFE {}_KFE", ("FR",), ("FL",)),
    "hyq": ("{}_haa_joint", "{}_hfe_joint {}_kfe_joint", ("lf", "lh"), ("rf", "rh")),
    "biped.xml": ("", "{}_hip {}_knee", ("left",), ("right",)),
}
"""Robots with legs: joints that step sideways, joints that swing, leading and following legs."""


def planar_legs(name: str) -> tuple[str | Path, str, dict[str, float], dict[str, float], dict[str, str]]:
    """Return how to load a robot with legs in the plane, left and right in unison."""
    sideways, swinging, leaders, followers = LEGS[name]
    source = MODELS / name if name.endswith(".xml") else f"example-robot-data:{name}"
    locked = {sideways.format(leg): 0.0 for leg in (*leaders, *followers) if sideways}
    coupled = {
        joint.format(follower): joint.format(leader)
        for leader, follower in zip(leaders, followers, strict=True)
        for joint in swinging.split()
    }
    return source, "sagittal", {}, locked, coupled


ROBOTS: dict[str, tuple[Any, ...]] = {
    "hopper": (HOPPER, "fixed", {"leg": 0.1}),
    "ur5": ("example-robot-data:ur5", "fixed", {"shoulder_pan_joint": 0.3}),
    "panda (mimic)": ("example-robot-data:panda", "fixed", {}),
    "kinova (unbounded)": ("example-robot-data:kinova", "fixed", {}),
    "double_pendulum_continuous": ("example-robot-data:double_pendulum_continuous", "fixed", {}),
    "baxter (mimic, sliding)": ("example-robot-data:baxter", "fixed", {}),
    "solo12 (free)": ("example-robot-data:solo12", "free_flyer", {}),
    "solo8 (planar)": ("example-robot-data:solo8", "planar", {"root_joint.wz": 0.2}),
    "anymal_c (free, unaligned)": ("example-robot-data:anymal_c", "free_flyer", {}),
    "talos (free)": ("example-robot-data:talos", "free_flyer", {}),
    "icub (free, unaligned)": ("example-robot-data:icub_reduced", "free_flyer", {}),
    "tiago_no_hand (planar, unbounded)": ("example-robot-data:tiago_no_hand", "planar", {}),
    "crawler (MJCF)": (MODELS / "crawler.xml", "fixed", {}),
    "walker (MJCF)": (MODELS / "walker.xml", "fixed", {}),
    "zoo (every URDF joint)": (MODELS / "zoo.urdf", "fixed", {"finger": 0.05}),
    "walker (MJCF, locked)": (MODELS / "walker.xml", "fixed", {}, {"foot_joint": 0.3}),
    "panda (mimic, locked)": ("example-robot-data:panda", "fixed", {}, {"panda_joint1": 0.3, "panda_joint4": -1.0}),
    "kinova (sagittal, unbounded locked)": (
        "example-robot-data:kinova",
        "sagittal",
        {"root_pitch": 0.1},
        {"j2s6s200_joint_1": 4.0},
    ),
    "talos (sagittal)": ("example-robot-data:talos", "sagittal", {}),
    **{f"{name} (sagittal, coupled)": planar_legs(name) for name in LEGS},
}


@dataclass(frozen=True)
class State:
    """A random point: configuration, velocity, acceleration."""

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray


@dataclass(frozen=True)
class Case:
    """A robot, frames to look at, random states, and the values of all expressions there."""

    robot: Robot
    frames: list[str]
    states: list[State]
    values: list[dict[str, np.ndarray]]

    @property
    def has_mimic(self) -> bool:
        """Whether Pinocchio refuses some of its algorithms for this robot."""
        return any(link.mimics for link in self.robot.tree.links)


def random_state(model: pin.Model, rng: np.random.Generator) -> State:
    """Return a configuration on the manifold within a metre and a radian of neutral, and any velocity."""
    q = pin.integrate(model, pin.neutral(model), rng.uniform(-1.0, 1.0, model.nv))
    return State(q, rng.normal(size=model.nv), rng.normal(size=model.nv))


@pytest.fixture(scope="session")
def hopper() -> Robot:
    """The hopper with the armature that makes its mass matrix regular."""
    return load_robot(HOPPER, armature={"leg": 0.1})


@pytest.fixture(scope="session", params=ROBOTS.values(), ids=ROBOTS.keys())
def case(request: pytest.FixtureRequest) -> Case:
    """One robot after the other."""
    source, root, armature, locked, coupled = (*request.param, {}, {})[:5]
    robot = load_robot(source, root=root, armature=armature, locked=locked, coupled=coupled)
    names = robot.frame_names
    frames = list(dict.fromkeys([names[0], names[1], names[len(names) // 2], names[-1]]))
    q, v, a = (
        ca.SX.sym(name, size) for name, size in (("q", robot.model.nq), ("v", robot.model.nv), ("a", robot.model.nv))
    )
    expressions = {
        "rnea": rnea(robot, q, v, a),
        "nonlinear_effects": nonlinear_effects(robot, q, v),
        "mass_matrix": mass_matrix(robot, q),
        "center_of_mass": center_of_mass(robot, q),
        "kinetic_energy": kinetic_energy(robot, q, v),
        "potential_energy": potential_energy(robot, q),
        "configuration_derivative": configuration_derivative(robot, q, v),
        "integrate": integrate(robot, q, v),
        "difference": difference(robot, q, integrate(robot, q, a)),
    }
    for frame in frames:
        expressions[f"rotation {frame}"], expressions[f"position {frame}"] = frame_placement(robot, q, frame)
        expressions[f"linear {frame}"], expressions[f"angular {frame}"] = frame_velocity(robot, q, v, frame)
        expressions[f"jacobian {frame}"] = frame_jacobian(robot, q, frame)
    function = ca.Function("all", [q, v, a], list(expressions.values()))
    rng = np.random.default_rng(7)
    states = [random_state(robot.model, rng) for _ in range(3)]
    values = [
        {name: value.full() for name, value in zip(expressions, function(s.q, s.v, s.a), strict=True)} for s in states
    ]
    return Case(robot, frames, states, values)


def assert_close(actual: np.ndarray, expected: np.ndarray | float, tolerance: float = 1e-10) -> None:
    """Assert agreement relative to the largest entry, or to one if that is smaller."""
    reference = np.asarray(expected, dtype=float)
    scale = max(1.0, float(np.abs(reference).max(initial=0.0)))
    assert np.abs(actual.reshape(reference.shape) - reference).max(initial=0.0) <= tolerance * scale


@pytest.fixture(scope="session", name="assert_close")
def assert_close_fixture():
    """The comparison that all tests share."""
    return assert_close


@pytest.fixture(scope="session", params=LEGS)
def legs(request: pytest.FixtureRequest) -> tuple[Robot, Robot, dict[str, str]]:
    """A robot with legs in the plane: as planned, in space with all its joints, and which joints are coupled."""
    source, root, _, locked, coupled = planar_legs(request.param)
    return load_robot(source, root=root, locked=locked, coupled=coupled), load_robot(source, root="free_flyer"), coupled
