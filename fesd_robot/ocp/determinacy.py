"""Postures in which Coulomb's law decides how a closed contact moves."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from fesd_robot.exactness import NO_LENGTH
from fesd_robot.fesd import TrajectoryConstraint
from fesd_robot.ocp.parts import ProblemParts

MARGIN = 0.02
"""Ratio to which the normal acceleration that a sliding contact's normal force causes must not fall."""

DETERMINACY = "one motion"
"""Beginning of the names of these constraints; the contact's follows."""


@dataclass(frozen=True)
class DeterminacyConstraint(TrajectoryConstraint):
    """Postures in which one motion of a closed contact obeys Coulomb's law; a ``path`` on request.

    Attributes:
        contact: its name.
    """

    contact: str = ""


def determinacy_constraints(parts: ProblemParts) -> list[DeterminacyConstraint]:
    """Return for every contact with friction the postures in which only one motion obeys Coulomb's law.

        1 -+ mu W_nt / W_nn >= MARGIN   with   W = (J_n, J_t) M^-1 (J_n, J_t)^T

    and in space 1 - mu |W_nt| / W_nn >= MARGIN.

    Elsewhere a normal force on a sliding contact accelerates it into the ground, and sticking, sliding and parting may
    be possible at once (Painleve's paradox). They hold on request only: where refinement finds that rigid bodies do not
    decide.

    Source: Genot and Brogliato, New results on Painleve paradoxes, European Journal of Mechanics A 18 (1999).
    """
    system = parts.contact_system.system
    point = ca.vertcat(system.state, system.control, system.algebraic)
    contacts, constraints = [contact for contact in parts.contacts if contact.friction > 0], []
    if not contacts:
        return []
    normals = ca.horzcat(*[ca.SX(contact.normal) for contact in contacts])
    responses = ca.ldl_solve(normals, *ca.ldl(parts.dynamics.mass_matrix, True))  # limbs do not fill each other's rows
    for contact, response in zip(contacts, ca.horzsplit(responses), strict=True):
        normal = ca.dot(contact.normal, response)
        along = [contact.friction * ca.dot(tangent, response) / normal for tangent in contact.directions]
        if contact.in_space:
            rows = {"every direction": 1 - ca.sqrt(ca.sumsqr(ca.vertcat(*along)) + NO_LENGTH**2)}
        else:
            rows = {"forwards": 1 - along[0], "backwards": 1 + along[0]}
        constraints.append(
            DeterminacyConstraint(
                f"{DETERMINACY} {contact.name}",
                "path",
                point,
                parts.grid.everywhere,
                ca.vertcat(*rows.values()),
                np.full(len(rows), MARGIN),
                np.full(len(rows), np.inf),
                [f"{DETERMINACY} [{contact.name}, {direction}]" for direction in rows],
                on_request=True,
                contact=contact.name,
            )
        )
    return constraints
