"""The options of the homotopy that a task asks for."""

from __future__ import annotations

from fesd_robot.mpcc import HomotopyOptions
from fesd_robot.task import Task


def homotopy_options(task: Task) -> HomotopyOptions:
    """Return the solver's options from the task's section `solver`."""
    solver = task.solver
    return HomotopyOptions(
        tolerance=solver.tolerance,
        sigma_start=solver.sigma_start,
        sigma_factor=solver.sigma_factor,
        velocity_level_ratio=solver.velocity_level_ratio,
        max_iterations=solver.max_iterations,
        relaxation=solver.relaxation,
        linear_solver=solver.linear_solver,
        compile=task.method.compile,
        polish=solver.polish,
        loose_iterations=solver.loose_iterations,
    )
