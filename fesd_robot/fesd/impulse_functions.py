"""The impulses of a system that jumps as CasADi functions, for elements whose modes are prescribed."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from fesd_robot.complementarity import HeldAt
from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.fesd.element import ElementPoints


def jump_function(system: ComplementaritySystem) -> ca.Function:
    """Return (x, y) -> sizes and laws of the impulses, none for a system that does not jump."""
    jump, none = system.jump, ca.SX(0, 1)
    sizes = ca.vertcat(none, *[impulse.size for impulse in system.impulses])
    laws = ca.vertcat(none, *[impulse.law for impulse in system.impulses])
    return ca.Function("jump", [system.state, none if jump is None else jump.symbols], [sizes, laws])


def impulse_function(
    system: ComplementaritySystem, left: ca.SX, own: ca.SX, p: ca.SX, parts: Sequence[ElementPoints]
) -> ca.Function:
    """Return (x_left, own, p) -> sizes, laws, G and H of the conditions that follow an impulse; a column an element.

    Args:
        system: that jumps.
        left, own, p: state the interval starts from, its own variables, parameters.
        parts: its elements as expressions of these; H is summed over the stages.
    """
    jump, after = jump_function(system), [one for one in system.vanishing if one.held_at is HeldAt.LEFT_BOUNDARY]
    G, H = (ca.vertcat(ca.SX(0, 1), *[getattr(one, side) for one in after]) for side in ("G", "H"))
    sides = ca.Function("after", [system.state, system.algebraic], [G, H])
    columns: list[list[ca.SX]] = [[], [], [], []]
    for part in parts:
        held = sum((sides(x, z)[1] for x, z in part.stages), ca.SX.zeros(len(after)))
        for column, value in zip(columns, (*jump(part.before, part.jump), sides(*part.left)[0], held), strict=True):
            column.append(value)
    return ca.Function("impulses", [left, own, p], [ca.horzcat(*column) for column in columns])
