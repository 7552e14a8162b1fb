"""One name for both simulations: of a robot, and of any piecewise smooth system."""

from __future__ import annotations

from typing import Any, overload

from fesd_robot.arguments import checked
from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.fesd import Simulation
from fesd_robot.fesd import simulate as simulate_system
from fesd_robot.plans import Plan
from fesd_robot.simulation.of_robot import Controls, simulate_robot
from fesd_robot.task import Task


@overload
def simulate(what: Task | Plan, controls: Controls | None = None, *, duration: float | None = None) -> Plan: ...
@overload
def simulate(what: ComplementaritySystem, *arguments: Any, **options: Any) -> Simulation: ...


@checked
def simulate(what: Task | Plan | ComplementaritySystem, *arguments: Any, **options: Any) -> Plan | Simulation:
    """Simulate a robot through contact, or a piecewise smooth system.

    ``simulate(task)``, ``simulate(plan)``, ``simulate(plan, controls, duration=2.0)``: rigid bodies under given
    controls, every event located to round-off; all arguments are those of `fesd_robot.simulation.simulate_robot`.
    ``simulate(system, x0, (t0, t1), rtol=1e-6)``: finite elements with switch detection; all arguments are those of
    `fesd_robot.fesd.simulate`.

    Args:
        what: a task, a plan, or a system of `fesd_robot.dcs`.
        arguments, options: of the simulation.

    Returns:
        the motion of a robot as a plan, or the `Simulation` of a system.

    Raises:
        OptionError: none of these.
        FesdRobotError: arguments that do not fit, or a motion that does not go on.
    """
    if isinstance(what, ComplementaritySystem):
        return simulate_system(what, *arguments, **options)
    return simulate_robot(what, *arguments, **options)
