"""The hopper as the audit sees it, and a whole plan of its drop."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.ocp.assembled import with_full_model
from fesd_robot.ocp.judged import motion_outcome, names_of, numeric_physics
from fesd_robot.plans import Plan, assemble
from fesd_robot.plans.audit import MotionLimits, audit
from fesd_robot.plans.plan import HomotopyStep, Provenance, Statistics, Status, Units
from fesd_robot.plans.replay_record import replay_entries, replay_summary
from fesd_robot.plans.requirements import requirements
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.replay.intervals import replay_intervals
from fesd_robot.robot.units import configuration_units, velocity_units
from fesd_robot.task import load_task

from .motions import drop

TASK = Path(__file__).parents[2] / "tasks" / "published_hopper_five_jumps.yaml"


@pytest.fixture(scope="session")
def hopper() -> MotionProblem:
    """The hopper benchmark with duration and intervals of `drop`."""
    return formulate(load_task(TASK, ["horizon.duration=0.3", "horizon.intervals=2", "reference.count=1"]))


@pytest.fixture(scope="session")
def physics(hopper: MotionProblem) -> NumericPhysics:
    return numeric_physics(hopper)


@pytest.fixture(scope="session")
def plan(hopper: MotionProblem, physics: NumericPhysics) -> Plan:
    """The drop as a plan, with numbers that are hard to write down."""
    motion, robot, names = drop(), hopper.robot, hopper.actuation.names
    infinity = np.full(4, np.inf)
    replay = replay_intervals(motion, physics)
    all_names = names_of(hopper)
    found = audit(
        motion,
        physics,
        names=all_names,
        interval_ends=motion.clock,
        limits=MotionLimits(
            position=(-infinity, infinity),
            velocity=(-infinity, infinity),
            control=(hopper.actuation.lower, hopper.actuation.upper),
        ),
        others={
            **requirements(
                hopper.task,
                hopper.robot,
                numeric_physics(hopper),
                motion,
                (motion.configuration[0], motion.velocity[0]),
                (motion.configuration[-1], motion.velocity[-1]),
            ),
            **replay_entries(replay, motion, all_names),
        },
    )
    status = Status(
        solved=True,
        nlp="converged",
        complementarity=1 / 3 * 1e-8,
        natural_residual=1e-5,
        constraint_violation=5e-324,
        stationarity="unknown",
        audit_passed=True,
        message="Solved to complementarity 3.3e-09; the physics audit passed.",
    )
    step = HomotopyStep(
        sigma=1.0,
        velocity_level_sigma=1000.0,
        status="converged",
        iterations=7,
        objective=0.1 + 0.2,
        complementarity=1.0,
        constraint_violation=0.0,
        seconds=0.5,
    )
    plan = Plan(
        name="drop",
        status=status,
        audit=found,
        units=Units(
            configuration=configuration_units(robot),
            velocity=velocity_units(robot),
            controls=dict(zip(names, hopper.actuation.units, strict=True)),
        ),
        trajectory=assemble.trajectory_of(motion, robot.configuration_names, robot.velocity_names),
        controls=assemble.controls_of(np.array([[0.1 + 0.2, -0.0], [np.pi, 5e-324]]), names, np.array([0.0, 0.15])),
        contacts=assemble.contacts_of(motion, ["foot"], physics),
        switches=assemble.switches_of(motion, ["foot"]),
        impulses=assemble.impulses_of(motion, ["foot"]),
        statistics=Statistics(
            variables=10,
            constraints=9,
            pairs=4,
            iterations=7,
            build_seconds=0.1,
            solve_seconds=0.5,
            objective=4.0,
            cost_terms={"configuration": 3.0, "control": 1.0},
            homotopy=[step],
        ),
        provenance=Provenance(versions={"python": "3"}, git="none", created="2024-01-01T00:00:00+00:00"),
        task=hopper.task.model_dump(mode="json"),
        outcome=motion_outcome(hopper, motion, physics),
        replay=replay_summary(replay, robot.velocity_names),
    )
    return with_full_model(plan, hopper, physics)
