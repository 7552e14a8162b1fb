"""Large systems in blocks of single stages and elements: one formula for all of them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Literal

import casadi as ca
import numpy as np

from fesd_robot.complementarity import Label, Place
from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.fesd.element import DYNAMICS, SystemFunctions, read_elements
from fesd_robot.fesd.indices import TrajectoryIndices
from fesd_robot.fesd.interval import element_conditions, relaxed_difference, running_costs
from fesd_robot.fesd.layout import layout_of
from fesd_robot.fesd.ocp import OcpEquations
from fesd_robot.fesd.options import FesdOptions
from fesd_robot.fesd.tableau import Tableau
from fesd_robot.mpcc import Block, BlockEquations
from fesd_robot.running import kept_with_first

LARGE_INTERVALS = 15_000
"""Instructions of the dynamics in the formulas of all kinds of intervals from which on stages and elements are blocks
of their own. Derivatives of an interval repeat the dynamics for every stage: for a quadruped in space with three
elements of two stages that is half a million instructions, and a minute of compiling; in the plane a refined one has
intervals of three to eight elements of four stages, and takes as long."""


ELEMENT = "element"
"""Name of the block of the conditions of an element."""


def is_large(system: ComplementaritySystem, stages: int, elements: Iterable[int]) -> bool:
    """Return whether stages and elements of a system are better blocks of their own.

    Args:
        system: the system.
        stages: of an element.
        elements: of every interval.
    """
    return bool(SystemFunctions.of(system).dynamics.n_instructions() * stages * sum(set(elements)) >= LARGE_INTERVALS)


def stages_block(ocp: OcpEquations, tableau: Tableau, indices: TrajectoryIndices, parameters: np.ndarray) -> Block:
    """Return the block of ``E(X_j) sum_r l_r'(c_j) X_r - h f(X_j, u, Z_j) = 0``, a copy for every stage.

    Its cost is ``h b_j L(X_j, u, Z_j)``. The coefficients l_r'(c_j) and b_j are parameters, and X_j is the first of the
    stages: so all stages have the same formula.

    Args:
        ocp: of the problem.
        tableau: of a collocation scheme with s stages, in the integral form.
        indices: where the variables of the trajectory sit.
        parameters: values of the system's parameters on each interval, (n_p, N).
    """
    system, stages, derivative = ocp.system, tableau.stages, np.asarray(tableau.derivative)
    places, index, values = list[Place](), list[np.ndarray](), list[np.ndarray]()
    for e in range(sum(indices.elements)):
        place = indices.place(e)
        assert place.interval is not None
        states = [indices.left_state(e), *(indices.stage(e, j)[: len(indices.left_state(e))] for j in range(stages))]
        for j in range(stages):
            order = [0, j + 1, *(r + 1 for r in range(stages) if r != j)]
            algebraic = indices.stage(e, j)[system.state.numel() :]
            control, step = indices.control(place.interval), np.array([indices.step(e)])
            own = [*(states[r] for r in order), algebraic, control, step]
            places.append(replace(place, stage=j + 1))
            index.append(np.concatenate(own))
            weight = np.append(derivative[j, order], tableau.b[j])
            values.append(np.concatenate([parameters[:, place.interval], weight]))
    return Block(_stage_equations(ocp, stages), places, np.array(index).T, np.array(values).T)


@kept_with_first
def _stage_equations(ocp: OcpEquations, stages: int) -> BlockEquations:
    """Return the equations of a stage of an element with s stages."""
    system = ocp.system
    x = [ca.SX.sym(f"x{r}", system.state.numel()) for r in range(stages + 1)]  # left end, the stage, other stages
    z, u = ca.SX.sym("z", system.algebraic.numel()), ca.SX.sym("u", system.control.numel())
    h, weights, share = ca.SX.sym("h"), ca.SX.sym("weight", stages + 1), ca.SX.sym("b")
    p, sigma = ca.SX.sym("p", system.parameters.numel()), ca.SX.sym("sigma")

    def added(when: Literal["always", "if_exploited"]) -> ca.SX:
        difference = relaxed_difference(ocp, when)
        return ca.SX(0) if difference is None else h * share * difference(x[1], u, z, p, sigma)

    E, f = SystemFunctions.of(system).dynamics(x[1], u, z, p)
    slope = ca.mtimes(ca.horzcat(*x), weights)
    return BlockEquations(
        name="stage",
        variables=ca.vertcat(*x, z, u, h),
        parameters=ca.vertcat(p, weights, share),
        cost=h * share * ca.sum1(running_costs(ocp)(x[1], u, z, p)),
        rows=ca.mtimes(E, slope) - h * f,
        lower=np.zeros(system.state.numel()),
        upper=np.zeros(system.state.numel()),
        constraints=[Label(DYNAMICS, name) for name in system.state_names],
        while_relaxed=added("always"),
        if_exploited=added("if_exploited"),
        sigma=sigma,
    )


def conditions_block(system: ComplementaritySystem, options: FesdOptions, indices: TrajectoryIndices) -> Block:
    """Return the block of the complementarity conditions of an element, a copy for every element.

    Args:
        system: of the problem.
        options: scheme and cross complementarity.
        indices: where the variables of the trajectory sit.
    """
    elements = range(sum(indices.elements))
    return Block(
        equations=_element_equations(system, replace(options, elements=1)),
        places=[indices.place(e) for e in elements],
        index=np.array([indices.element(e) for e in elements]).T,
        values=np.zeros((0, len(elements))),
    )


@kept_with_first
def _element_equations(system: ComplementaritySystem, options: FesdOptions) -> BlockEquations:
    layout = layout_of(system, options, 1)
    left, own = ca.SX.sym("left", system.state.numel() + system.algebraic.numel()), ca.SX.sym("own", layout.step(1))
    part = read_elements(layout, options.tableau, left, own)[0]
    return BlockEquations(
        name=ELEMENT,
        variables=ca.vertcat(left, own),
        parameters=ca.SX(0, 1),
        cost=ca.SX(0),
        rows=ca.SX(0, 1),
        lower=np.zeros(0),
        upper=np.zeros(0),
        constraints=[],
        complementarities=[
            condition
            for conditions in element_conditions(system, options, part, SystemFunctions.of(system), layout.stages)
            for condition in conditions
        ],
    )
