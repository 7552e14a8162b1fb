"""From a task or a plan, and controls, to the motion that they lead to."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.errors import MotionFileError
from fesd_robot.ocp import MotionProblem, assembled_plan, formulate, motion_audit, motion_outcome, numeric_physics
from fesd_robot.plans import (
    Audit,
    Plan,
    SimulationNote,
    SimulationSummary,
    Statistics,
    Status,
    check_task_and_robot,
    count,
    task_of,
)
from fesd_robot.recovery import NumericPhysics, PhysicalMotion
from fesd_robot.replay import ReplayNote
from fesd_robot.simulation.drive import SimulatedMotion, drive
from fesd_robot.simulation.motion import driven_motion
from fesd_robot.simulation.schedule import schedule_of
from fesd_robot.task import Task

_NOT_UNIQUE = {
    ReplayNote.NOT_UNIQUE: "rigid bodies may go on in several ways from here, one of which is taken",
    ReplayNote.IMPROPER: "rigid bodies go on in a way in which a force acts in the wrong sense (Painleve)",
    ReplayNote.NO_MODE: "rigid bodies cannot go on without an impact that is none of an approach (Painleve)",
}

Controls = Plan | Path | str | Mapping[str, float | Sequence[float] | np.ndarray]


@checked
def simulate_robot(what: Task | Plan, controls: Controls | None = None, *, duration: float | None = None) -> Plan:
    """Return the motion of a task's robot under given controls, through contact, every event located to round-off.

        M a + h + D v = B u + J^T f,   0 <= f_n ⊥ gap >= 0,   f_t in -mu f_n Sgn(J_t v),   v_n+ = -e v_n

    No optimisation is involved: between events the modes of all contacts are fixed, and the accelerations that follow
    are integrated with DOP853 to 1e-10 (`replay.integrator`). The motion begins where the task, or the plan, does.

    Args:
        what: a task from `load_task`, or a plan, whose task it is then.
        controls: of a plan; a file, which is a plan or a CSV table with a column ``time`` (where a row begins to hold,
            s) and one for every control; or name -> value, or values on equal intervals. Default: those of the plan,
            or zero.
        duration: s; default: that of the plan, or of the task.

    Returns:
        the motion as a plan, so that it can be written, drawn and exported like one. Its `simulation` says where the
        motion was not the only one, `outcome` where it leads, `audit` what its task would not allow; `status.solved`
        is whether it is the only motion.

    Raises:
        TaskError: the task does not fit its robot.
        MotionFileError: controls that do not fit the task.
        SolverError: the motion does not go on.
    """
    begin = time.perf_counter()
    plan = what if isinstance(what, Plan) else None
    task = task_of(plan) if plan else what
    assert isinstance(task, Task)
    motion = formulate(task, driven=False)
    if plan:
        check_task_and_robot(plan, motion.task, motion.robot)
    names, physics = motion.actuation.names, numeric_physics(motion)
    length = _duration(motion, plan, duration)
    given = controls if controls is not None else plan
    schedule = schedule_of(given, names, length, motion.grid.intervals)
    built = time.perf_counter()
    driven = drive(physics, *_start(motion, plan), schedule)
    physical = driven_motion(driven, physics, schedule, len(names))
    audit = motion_audit(motion, physical, physics, replay=None, interval_ends=schedule.times[1:])
    result = assembled_plan(
        motion,
        physical,
        physics,
        {"time": schedule.times[:-1], **dict(zip(names, schedule.controls.T, strict=True))},
        status=_status(driven, physical, physics, audit),
        audit=audit,
        outcome=motion_outcome(motion, physical, physics),
        statistics=_statistics(built - begin, time.perf_counter() - built),
    )
    summary = SimulationSummary(
        events=len(driven.switches) + len(driven.joint_switches) + len(driven.compliant_switches),
        impacts=len(driven.hits),
        steps=len(driven.pieces),
        notes=[SimulationNote(time=at, message=_NOT_UNIQUE[note]) for note, at in driven.notes.items()],
    )
    return result.model_copy(update={"simulation": summary})


def _duration(motion: MotionProblem, plan: Plan | None, duration: float | None) -> float:
    if duration is not None:
        if not 0 < duration < np.inf:
            raise MotionFileError(f"found a duration of {duration:g} s, expected a positive one")
        return float(duration)
    if plan:
        return float(plan.trajectory.time[-1])
    if motion.grid.free:
        raise motion.task.error(
            "horizon.duration",
            f"found a duration between {motion.grid.lower:g} and {motion.grid.upper:g} s, expected one number for a "
            "simulation, or the duration of the simulation beside the task",
        )
    return motion.grid.nominal


def _start(motion: MotionProblem, plan: Plan | None) -> tuple[np.ndarray, np.ndarray]:
    if plan is None:
        return motion.endpoints.initial_configuration, motion.endpoints.initial_velocity
    robot, trajectory = motion.robot, plan.trajectory
    return (
        np.array([trajectory.configuration[name][0] for name in robot.configuration_names]),
        np.array([trajectory.velocity[name][0] for name in robot.velocity_names]),
    )


def _status(driven: SimulatedMotion, physical: PhysicalMotion, physics: NumericPhysics, audit: Audit) -> Status:
    gaps = np.array([physics.gaps(q) for q in physical.configuration])
    normal = physical.force[:, :, 0]
    events = sum(map(len, (driven.switches, driven.joint_switches, driven.compliant_switches)))
    unique = "the only motion there is" if not driven.notes else "not the only motion there is"
    broken = f"; what the task asks of a motion is missed in {_entries(audit)}" if audit.violations else ""
    return Status(
        solved=not driven.notes,
        nlp="none: simulated",
        complementarity=float((np.maximum(gaps, 0.0) * normal).max(initial=0.0)),
        exact=True,
        natural_residual=float(np.minimum(gaps, normal).max(initial=0.0)),
        constraint_violation=float(-gaps.min(initial=0.0)),
        stationarity="unknown",
        audit_passed=not audit.violations,
        message=f"Simulated with given controls, {count(events, 'contact event')}: {unique}{broken}.",
    )


def _entries(audit: Audit) -> str:
    return ", ".join(audit.violations)


def _statistics(build_seconds: float, seconds: float) -> Statistics:
    return Statistics(
        variables=0,
        constraints=0,
        pairs=0,
        iterations=0,
        build_seconds=build_seconds,
        solve_seconds=seconds,
        objective=0.0,
        cost_terms={},
        homotopy=[],
    )
