"""Controls of which one set acts at a time: a tool that can only be in one place."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import casadi as ca
import numpy as np

from fesd_robot.complementarity import Complementarity, HeldAt, Label
from fesd_robot.contact.kinds import ONE_AT_A_TIME
from fesd_robot.contact.model import ContactSystem, MultibodyDynamics


def with_one_at_a_time(contact_system: ContactSystem, dynamics: MultibodyDynamics) -> ContactSystem:
    """Return the contact system in which at most one set of controls of every group acts at a time, exactly.

    Controls u_c >= 0 of a group are split into sets A; every control has a copy z_c = u_c among the algebraic
    variables, and

        max(sum_{c in A} z_c, 0) sum_{c not in A} z_c = 0   for every set A,

    at the stages. Controls are constant on a control interval, so that another set acts from an interval on.

    Args:
        contact_system: in the multiplier form.
        dynamics: whose `one_at_a_time` has groups of sets of controls that are never negative.
    """
    names = [name for group in dynamics.one_at_a_time.values() for controls in group.values() for name in controls]
    if not names:
        return contact_system
    system, rows = contact_system.system, [list(dynamics.control_names).index(name) for name in names]
    copies, count, first = ca.SX.sym("acting", len(names)), len(names), system.algebraic.numel()
    return replace(
        contact_system,
        system=replace(
            system,
            algebraic=ca.vertcat(system.algebraic, copies),
            residual=ca.vertcat(system.residual, copies - system.control[rows]),
            algebraic_lower=np.append(system.algebraic_lower, np.zeros(count)),
            algebraic_upper=np.append(system.algebraic_upper, np.full(count, np.inf)),
            guess=lambda x, u, p: np.append(system.guess(x, u, p), u[rows]),
            control_copies={first + i: row for i, row in enumerate(rows)},
            algebraic_names=[*system.algebraic_names, *(f"acting[{name}]" for name in names)],
            complementarities=[
                *system.complementarities,
                *_conditions(dynamics, dict(zip(names, ca.vertsplit(copies), strict=True))),
            ],
        ),
    )


def _conditions(dynamics: MultibodyDynamics, copies: dict[str, ca.SX]) -> Iterator[Complementarity]:
    """Yield the vanishing constraint of every set.

    Args:
        dynamics: whose groups they are.
        copies: name of a control -> its copy.
    """
    for group, sets in dynamics.one_at_a_time.items():
        for name, controls in sets.items():
            others = [one for other, own in sets.items() if other != name for one in own]
            yield Complementarity(
                Label(ONE_AT_A_TIME, f"{group} {name}"),
                sum((copies[one] for one in controls), ca.SX(0)),
                sum((copies[one] for one in others), ca.SX(0)),
                vanishing=True,
                held_at=HeldAt.STAGES,
            )
