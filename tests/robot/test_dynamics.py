"""The equations of motion against Pinocchio's numeric algorithms."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.errors import DimensionError, RobotError
from fesd_robot.robot import center_of_mass, load_robot, mass_matrix, nonlinear_effects, potential_energy, rnea


def _mass_matrix(model, q):
    upper = np.triu(pin.crba(model, model.createData(), q))
    return upper + np.triu(upper, 1).T


def test_rnea_agrees_with_pinocchio(case, assert_close):
    """τ(q, v, a) is that of pin.rnea."""
    model = case.robot.model
    for state, values in zip(case.states, case.values, strict=True):
        assert_close(values["rnea"], pin.rnea(model, model.createData(), state.q, state.v, state.a))


def test_nonlinear_effects_agree_with_pinocchio(case, assert_close):
    """h(q, v) is τ without acceleration."""
    model = case.robot.model
    for state, values in zip(case.states, case.values, strict=True):
        assert_close(
            values["nonlinear_effects"], pin.rnea(model, model.createData(), state.q, state.v, np.zeros(model.nv))
        )


def test_mass_matrix_agrees_with_pinocchio(case, assert_close):
    """M(q) is that of pin.crba, both triangles."""
    for state, values in zip(case.states, case.values, strict=True):
        assert_close(values["mass_matrix"], _mass_matrix(case.robot.model, state.q))


def test_kinetic_energy_agrees_with_pinocchio(case, assert_close):
    """T is ½ vᵀ M v, and pin.computeKineticEnergy of the bodies plus the armatures."""
    bodies = pin.Model(case.robot.model)
    bodies.armature = np.zeros(bodies.nv)
    for state, values in zip(case.states, case.values, strict=True):
        assert_close(values["kinetic_energy"], state.v @ _mass_matrix(case.robot.model, state.q) @ state.v / 2)
        if not case.has_mimic:
            # Pinocchio 4.1 forgets the armature of revolute joints about slanted axes in this one algorithm.
            energy = pin.computeKineticEnergy(bodies, bodies.createData(), state.q, state.v)
            assert_close(values["kinetic_energy"], energy + case.robot.model.armature @ state.v**2 / 2)


def test_potential_energy_agrees_with_pinocchio(case, assert_close):
    """V is that of the springs plus pin.computePotentialEnergy, or −gᵀ m c where Pinocchio refuses mimic joints."""
    model = case.robot.model
    mass = sum(inertia.mass for inertia in model.inertias[1:])
    for state, values in zip(case.states, case.values, strict=True):
        stored = sum(k * (state.q[entry] - rest) ** 2 / 2 for _, entry, k, rest in case.robot.springs)
        expected = -mass * model.gravity.linear @ pin.centerOfMass(model, model.createData(), state.q)
        assert_close(values["potential_energy"], expected + stored)
        if not case.has_mimic:
            weight = pin.computePotentialEnergy(model, model.createData(), state.q)
            assert_close(values["potential_energy"], weight + stored)


def test_center_of_mass_agrees_with_pinocchio(case, assert_close):
    """The centre of mass is that of pin.centerOfMass."""
    model = case.robot.model
    for state, values in zip(case.states, case.values, strict=True):
        assert_close(values["center_of_mass"], pin.centerOfMass(model, model.createData(), state.q))


def test_mass_matrix_is_structurally_as_sparse_as_the_tree():
    """Legs that do not carry each other share no entry of M."""
    robot = load_robot("example-robot-data:solo12", root="free_flyer")
    pattern = mass_matrix(robot, ca.SX.sym("q", robot.model.nq)).sparsity()
    for row in range(6, 18):
        for column in range(6, 18):
            assert pattern.has_nz(row, column) == ((row - 6) // 3 == (column - 6) // 3)


@pytest.mark.parametrize(("name", "most"), [("solo12", 1600), ("talos", 4700), ("ur5", 450)])
def test_rnea_is_compact(name, most):
    """The graph of τ stays below that of Pinocchio's own templates."""
    robot = load_robot(f"example-robot-data:{name}", root="fixed" if name == "ur5" else "free_flyer")
    q, v, a = ca.SX.sym("q", robot.model.nq), ca.SX.sym("v", robot.model.nv), ca.SX.sym("a", robot.model.nv)
    assert ca.Function("tau", [q, v, a], [rnea(robot, q, v, a)]).n_instructions() < most


def test_gravity_of_the_model_is_used(hopper):
    """A robot under another gravity weighs accordingly."""
    model = pin.Model(hopper.model)
    model.gravity.linear = np.array([1.0, 0.0, -2.0])
    lighter = replace(hopper, model=model)
    q = ca.SX.sym("q", 4)
    assert ca.evalf(nonlinear_effects(lighter, q, ca.SX(4, 1))).full().ravel() == pytest.approx([-1.1, 2.2, 0.0, 0.0])
    assert float(ca.evalf(ca.substitute(potential_energy(lighter, q), q, ca.DM([3, 1, 0, 0])))) == pytest.approx(-1.1)


def test_a_robot_without_mass_has_no_centre_of_mass(tmp_path):
    """Dividing by a mass of zero is refused."""
    file = tmp_path / "ghost.urdf"
    file.write_text(
        '<robot name="ghost"><link name="a"/><link name="b"/><joint name="j" type="prismatic"><parent link="a"/>'
        '<child link="b"/><axis xyz="1 0 0"/><limit lower="0" upper="1" velocity="1" effort="1"/></joint></robot>'
    )
    with pytest.raises(RobotError, match="no centre of mass"):
        center_of_mass(load_robot(file), ca.SX.sym("q", 1))


def test_arguments_of_the_wrong_length_are_refused(hopper):
    """The message names the argument, its shape and the expected one."""
    with pytest.raises(DimensionError, match=r"v has shape \(3, 1\), expected \(4, 1\)"):
        rnea(hopper, ca.SX.sym("q", 4), ca.SX.sym("v", 3), ca.SX.sym("a", 4))
    with pytest.raises(DimensionError, match="q has shape"):
        mass_matrix(hopper, ca.SX.sym("q", 1, 4))
