"""Plan robot motion through contact with finite elements with switch detection (FESD).

A task file says what a robot is to do: its model, the ground, what may touch, the goal, costs and limits. Planning
finds when contact happens, and returns the motion in physical time with forces, impulses, an audit and a status.

    >>> from fesd_robot import explain, export_plan, load_task, plan, render_plan, report, write_plan
    >>> task = load_task("tasks/hopper_one_jump.yaml")
    >>> text = explain(task)                        # what will be solved, and likely mistakes
    >>> jump = plan(task)
    >>> jump.status.solved                          # whether it can be relied on; .message says why
    True
    >>> folder = write_plan(jump, "runs/jump")      # plan.json, trajectory, report
    >>> files = render_plan(jump, folder)           # plan.html and figures
    >>> file = export_plan(jump, "jump.csv")
    >>> print(report(jump).splitlines()[0])
    # hopper_one_jump

Tasks: `load_task` -> `Task`, `explain`, `draw_task`. Planning: `plan` -> `Plan`. Files: `write_plan`, `read_plan`,
`export_plan`, `render_plan`, `report`. Following a plan: `tracking_gains`, `Tracker`; planning again on the way:
`Replanner`. Simulating: `simulate`, of a task, a plan, or a system. Every error that a user can meet is a
`FesdRobotError`, and its message says what to change.

Four rooms are a library without robots: `dcs` (nonsmooth systems and their complementarity form), `fesd`
(discretisation with switch detection, `simulate`), `mpcc` (mathematical programs with complementarity constraints) and
`optimal_control` (`optimize`: optimal control of systems with switches).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from fesd_robot.lazy import lazy_exports

__version__ = "0.2.0"
__all__ = [
    "CompilationError",
    "DimensionError",
    "ExpressionError",
    "FesdRobotError",
    "FolderInUseError",
    "GroundError",
    "JointError",
    "ModelError",
    "MotionFileError",
    "NotCompiledYet",
    "OptionError",
    "OutOfTime",
    "Plan",
    "PlanFileError",
    "Replanner",
    "RobotError",
    "SimulationError",
    "SolverError",
    "SweepError",
    "SweepSettings",
    "SweepTable",
    "Task",
    "TaskError",
    "Tracker",
    "dcs",
    "draw_task",
    "explain",
    "export_plan",
    "fesd",
    "load_task",
    "mpcc",
    "optimal_control",
    "plan",
    "read_plan",
    "read_sweep",
    "render_plan",
    "report",
    "simulate",
    "sweep",
    "tracking_gains",
    "write_plan",
]

if TYPE_CHECKING:
    from fesd_robot import dcs, fesd, mpcc, optimal_control
    from fesd_robot.actions import draw_task, explain, export_plan, render_plan
    from fesd_robot.errors import (
        DimensionError,
        ExpressionError,
        FesdRobotError,
        FolderInUseError,
        GroundError,
        JointError,
        ModelError,
        MotionFileError,
        OptionError,
        PlanFileError,
        RobotError,
        SolverError,
        SweepError,
        TaskError,
    )
    from fesd_robot.fesd import SimulationError
    from fesd_robot.native import CompilationError, NotCompiledYet
    from fesd_robot.planning import plan
    from fesd_robot.plans import Plan, read_plan, report, write_plan
    from fesd_robot.replanning import Replanner
    from fesd_robot.running import OutOfTime
    from fesd_robot.simulation import simulate
    from fesd_robot.sweeps import SweepSettings, SweepTable, read_sweep, sweep
    from fesd_robot.task import Task, load_task
    from fesd_robot.tracking import Tracker, tracking_gains
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "fesd_robot.dcs": ["dcs"],
            "fesd_robot.fesd": ["fesd", "SimulationError"],
            "fesd_robot.mpcc": ["mpcc"],
            "fesd_robot.optimal_control": ["optimal_control"],
            "fesd_robot.actions": ["draw_task", "explain", "export_plan", "render_plan"],
            "fesd_robot.errors": [
                "DimensionError",
                "ExpressionError",
                "FesdRobotError",
                "FolderInUseError",
                "GroundError",
                "JointError",
                "ModelError",
                "MotionFileError",
                "OptionError",
                "PlanFileError",
                "RobotError",
                "SolverError",
                "SweepError",
                "TaskError",
            ],
            "fesd_robot.native": ["CompilationError", "NotCompiledYet"],
            "fesd_robot.planning": ["plan"],
            "fesd_robot.plans": ["Plan", "read_plan", "report", "write_plan"],
            "fesd_robot.replanning": ["Replanner"],
            "fesd_robot.running": ["OutOfTime"],
            "fesd_robot.simulation": ["simulate"],
            "fesd_robot.sweeps.folder": ["read_sweep"],
            "fesd_robot.sweeps.run": ["sweep"],
            "fesd_robot.sweeps.settings": ["SweepSettings"],
            "fesd_robot.sweeps.table": ["SweepTable"],
            "fesd_robot.task": ["Task", "load_task"],
            "fesd_robot.tracking": ["Tracker", "tracking_gains"],
        },
    )
