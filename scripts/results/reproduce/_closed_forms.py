"""Small systems with closed forms: what a case is, and what the cases are built from."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from fesd_robot.dcs import ComplementaritySystem, Model, Subsystem, heaviside_from_regions, stewart
from fesd_robot.fesd import Simulation

Values = Mapping[str, float]
Systems = Mapping[str, ComplementaritySystem]


def order(scheme: str, stages: int) -> int:
    """Return the order of a scheme of the two families used here."""
    return 2 * stages - (scheme == "radau_iia")


def oscillation_error(scheme: str, stages: int, time: float, frequency: float, step: float) -> float:
    """Estimate the relative error after integrating x' = i w x over a time with steps h.

    The stability function differs from exp(z) by C z^(p+1), in time/h steps: time w C (w h)^p.

    Source: Hairer & Wanner, Solving ODEs II, IV.3 (Pade approximations and their error constants).
    """
    s, factorial = stages, math.factorial
    if scheme == "radau_iia":
        constant = factorial(s) * factorial(s - 1) / (factorial(2 * s - 1) * factorial(2 * s))
    else:
        constant = factorial(s) ** 2 / (factorial(2 * s) * factorial(2 * s + 1))
    return time * frequency * constant * (frequency * step) ** order(scheme, stages)


@dataclass(frozen=True)
class Case:
    """A system with closed forms.

    Attributes:
        name: heading and panel title.
        about: the system in a line.
        systems: the system in each form.
        initial: x(0).
        duration: numerical time.
        steps: simulation steps.
        exact: name -> closed form of every quantity that is compared.
        measure: the same quantities of a simulation.
        estimate: (scheme, stages) -> name -> estimated error; names left out, or no estimate, are exact.
        elements: finite elements a step.
        clock: index of the state that is physical time, if time is frozen in some phases.
        curves: label -> index of the states in the figure.
    """

    name: str
    about: str
    systems: Systems
    initial: Sequence[float]
    duration: float
    steps: int
    exact: Values
    measure: Callable[[Simulation], Values]
    estimate: Callable[[str, int], Values] = field(default=lambda scheme, stages: {})
    elements: int = 2
    clock: int | None = None
    curves: Mapping[str, int] = field(default_factory=lambda: {"x": 0})


def both_forms(state: ca.SX, subsystems: Subsystem | list[Subsystem]) -> dict[str, ComplementaritySystem]:
    """Return a system given by regions in both forms."""
    return {
        "Stewart": stewart(Model(state), subsystems),
        "step functions": heaviside_from_regions(Model(state), subsystems),
    }


def by_sign(switching: ca.SX, positive: ca.SX, negative: ca.SX, name: str = "regions") -> Subsystem:
    """Return the two regions on both sides of a switching function."""
    return Subsystem(
        switching=switching,
        sign_matrix=np.array([[1], [-1]]),
        fields=ca.horzcat(positive, negative),
        region_names=["positive", "negative"],
        name=name,
    )


def sliding_weights(simulation: Simulation) -> np.ndarray:
    """Return the weight of the field of the positive side and the state at all stages on x = 0, (m, 1 + n_x)."""
    names = list(simulation.system.algebraic_names)
    index = names.index("theta[positive]" if "theta[positive]" in names else "alpha[c1]")
    stages = simulation.tableau.stages
    rows = [
        np.append(z[index], x)
        for element in simulation.elements
        for x, z in zip(element.x[:stages], element.z[:stages], strict=True)
        if element.step > 0 and max(abs(element.x_left[0]), *np.abs(element.x[:, 0])) < 1e-9
    ]
    return np.array(rows)


def switches(simulation: Simulation, *names: str) -> dict[str, float]:
    """Return the switch times under the names they should have; NaN throughout if there are more or fewer."""
    times = simulation.switch_times
    if len(times) != len(names):
        return dict.fromkeys(names, math.nan)
    return dict(zip(names, times.tolist(), strict=True))
