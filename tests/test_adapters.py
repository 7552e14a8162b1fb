"""What the rooms hand to each other fits."""

from __future__ import annotations

from fesd_robot.mpcc import HomotopyOptions
from fesd_robot.ocp.solver_options import homotopy_options
from fesd_robot.task import Method, Solver, Task


def test_a_task_and_the_library_have_the_same_defaults(short_task: Task) -> None:
    """A task that says nothing about its solver is solved with the options that `mpcc.solve` has without any."""
    silent = short_task.model_copy(update={"solver": Solver(), "method": Method()})
    assert homotopy_options(silent) == HomotopyOptions()
