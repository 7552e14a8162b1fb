"""What a task requires besides physics, measured on motions in closed form."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fesd_robot.ocp import MotionProblem
from fesd_robot.ocp.judged import numeric_physics
from fesd_robot.plans.requirements import requirements
from fesd_robot.recovery import PhysicalMotion
from fesd_robot.task import load_task

from .motions import FRICTION, Segment, collision, drop, motion_of, stance, tumble

TASK = Path(__file__).parents[2] / "tasks" / "published_hopper_five_jumps.yaml"
SAME = ["horizon.duration=0.3", "horizon.intervals=2", "reference={type: line}", "goal.configuration={}"]


def missed(hopper: MotionProblem, motion: PhysicalMotion, *overrides: str) -> dict[str, float]:
    """What a motion misses of the requirements in these overrides; its own start and end are start and goal."""
    task = load_task(TASK, ["method.grid=uniform", *SAME, *overrides])
    start = (motion.configuration[0], motion.velocity[0])
    found = requirements(task, hopper.robot, numeric_physics(hopper), motion, start, (np.zeros(4), np.zeros(4)))
    assert found["max_simultaneous_control"].value == 0
    own = {key: one.value for key, one in found.items() if key.endswith("_violation")}
    return {key.removeprefix("max_").removesuffix("_violation"): value for key, value in own.items()}


# The drop: the foot falls from 0.2 m to the ground in 0.2019 s; its body is 0.5 m above it until then.
CONSTRAINTS = [
    ("{type: clearance, frame: foot, distance: 0.05}", 0.05),
    ("{type: clearance, frame: foot, offset: [0, 0, 0.4], distance: 0.3}", 0.0),
    ("{type: avoid_sphere, frame: foot, center: {x: 0.1, z: 0.2}, radius: 0.15}", 0.05),
    ("{type: avoid_box, frame: foot, center: {x: 0.05, z: 0.2}, size: {x: 0.3, z: 0.02}}", 0.01),
    ("{type: avoid_box, frame: foot, center: {x: 0.2, z: 0.2}, size: {x: 0.3, z: 9}}", 0.0),
    ("{type: avoid_ellipse, frame: foot, center: {x: 0, z: 0.2}, semi_axes: {x: 0.3, z: 0.01}}", 0.01),
    ("{type: frame_limits, frame: body, z: [null, 0.69]}", 0.01),
    ("{type: frame_limits, frame: body, x: [0.25, 1]}", 0.25),
    ("{type: forbidden_zone, contact: foot, x: [-0.02, 0.1]}", 0.02 - 1e-3),
    ("{type: forbidden_zone, contact: foot, x: [0.01, null]}", 0.0),
    ("{type: contact_window, contact: foot, times: [0.15, 0.3], touch: forbidden, clearance: 0.03}", 0.03),
    ("{type: contact_window, contact: foot, times: [0, 0.15], touch: forbidden, clearance: 0.03}", 0.0),
    ("{type: swing_clearance, contacts: [foot], height: 0.05, speed: 0.5}", 0.03 - 5e-4),
    ("{type: swing_clearance, contacts: [foot], height: 0.05, speed: 1.5}", 0.0),
    ("{type: contact_window, contact: foot, times: [0.15, 0.3], touch: required}", 0.2 - 9.81 / 2 * 0.15**2 - 1e-3),
]


@pytest.mark.parametrize(("constraint", "size"), CONSTRAINTS, ids=[str(i) for i in range(len(CONSTRAINTS))])
def test_constraints(hopper: MotionProblem, constraint: str, size: float) -> None:
    """Each constraint is missed by its distance in m, or not at all.

    For those of a swing the drop is seen from a train at 1 m/s, with its foot closed in stance: there the gap that is
    asked for is missing as a whole.
    """
    seen = drop()
    if "swing" in constraint:
        seen = replace(seen, velocity=seen.velocity + np.array([1.0, 0, 0, 0]))
    found = missed(hopper, seen, f"constraints={{one: {constraint}}}")
    assert found == pytest.approx(
        {"slip": 0, "slip_distance": 0, "reserve": 0, "constraint": size, "goal": 0, "waypoint": 0}, abs=1e-9
    )


def test_constraints_hold_between_stages(hopper: MotionProblem) -> None:
    """A body thrown up has its apex after 0.05 s; stages are at 0.0333 s and 0.1 s, and the limit is 1 mm lower."""
    rise, fall = 0.05 * 9.81, np.array([0, -9.81, 0, 0])
    motion = motion_of(np.array([0, 1.0, 0, 0.3]), np.array([0, rise, 0, 0]), [Segment(0, 0.1, fall)])
    apex = 1.0 + 0.025 * rise
    text = f"{{type: frame_limits, frame: body, z: [null, {apex - 1e-3}]}}"
    assert motion.configuration[:, 1].max() < apex - 1.3e-3
    assert missed(hopper, motion, f"constraints={{one: {text}}}")["constraint"] == pytest.approx(1e-3, abs=1e-9)


@pytest.mark.parametrize(("slipping", "size"), [("forbidden", 0.02), ("allowed", 0.0)])
def test_slipping(hopper: MotionProblem, slipping: str, size: float) -> None:
    """A foot that stands on the ground and moves along it slips by its velocity, if it may not."""
    still = drop()
    gliding = replace(still, velocity=still.velocity + np.array([0.02, 0, 0, 0]))
    assert missed(hopper, still, f"contacts.foot.slipping={slipping}")["slip"] == pytest.approx(0, abs=1e-12)
    assert missed(hopper, gliding, f"contacts.foot.slipping={slipping}")["slip"] == pytest.approx(size)


@pytest.mark.parametrize(("limit", "excess"), [(0.05, 0.01), (0.07, 0.0)])
def test_slip_distance(hopper: MotionProblem, limit: float, excess: float) -> None:
    """A foot that slides at 0.6 m/s, forth or back, for 0.1 s slips 6 cm: so much too far as its limit is less."""
    for speed in (0.6, -0.6):
        found = missed(hopper, stance(speed=speed), f"contacts.foot.slipping={limit}")
        assert found["slip_distance"] == pytest.approx(excess, abs=1e-9)


@pytest.mark.parametrize(("reserve", "excess"), [("reserve.friction=0.1", 0.05), ("contacts.foot.reserve=0.04", 0.0)])
def test_reserve(hopper: MotionProblem, reserve: str, excess: float) -> None:
    """A foot that sticks with 95 % of its friction uses so much of its reserve; one that slides uses none."""
    assert missed(hopper, stance(0.95 * FRICTION), reserve)["reserve"] == pytest.approx(excess, abs=1e-9)
    assert missed(hopper, stance(FRICTION, 0.6), reserve)["reserve"] == 0


GOALS = [
    (drop, "goal.configuration={root_z: 0.5}", 0.0),
    (tumble, "goal.tolerance={configuration: {root_x: 0.01}}", 0.3 - 0.01),
    (tumble, "goal.tolerance={velocity: {leg: 0.05}}", 0.2 - 0.05),
    (tumble, "goal.frames={body: {position: {x: 0.25}, tolerance: 0.01}}", 0.05 - 0.01),
    (tumble, "goal.frames={body: {velocity: {x: 0.25}, velocity_tolerance: 0}}", 0.75),
    (tumble, "goal.center_of_mass={position: [0.3, null, 1.2], tolerance: 0}", 9.81 * 0.02),
    (tumble, "goal={periodic: {stride: {root_x: 0.15}}}", 9.81 * 0.2),
    (tumble, "goal={periodic: {mirror: {root_z: -root_z}}}", 2.2 - 9.81 / 2 * 0.2**2),
    (tumble, "goal={periodic: {mirror: {root_pitch: leg, root_z: root_x}}}", np.nan),
]


@pytest.mark.parametrize(("make", "goal", "size"), GOALS, ids=[goal[1] for goal in GOALS])
def test_goals(hopper: MotionProblem, make: object, goal: str, size: float) -> None:
    """Hard goals are missed by what lies outside their tolerance, the largest over all of them."""
    costs = ["costs.terminal_configuration=null", "costs.terminal_velocity=null"]
    found = missed(hopper, make(), *(costs if "periodic" in goal else []), goal)  # type: ignore[operator]
    if goal.startswith("goal.center"):
        size = abs(1 + 0.2 - 9.81 / 2 * 0.04 - 1.2)
    if np.isnan(size):  # both pairs change places, in position and in velocity; the fall is the largest change
        motion = make()  # type: ignore[operator]
        pairs = [(0, 1), (1, 0), (2, 3), (3, 2)]
        ends = (motion.configuration, motion.velocity)
        size = max(abs(values[-1, i] - values[0, j]) for values in ends for i, j in pairs)
    assert found == pytest.approx(
        {"slip": 0, "slip_distance": 0, "reserve": 0, "constraint": 0, "goal": size, "waypoint": 0}, abs=1e-9
    )


def test_a_start_that_is_not_the_tasks(hopper: MotionProblem) -> None:
    """A motion that begins elsewhere misses by the distance."""
    motion, task = drop(), load_task(TASK, ["method.grid=uniform", *SAME])
    start = (motion.configuration[0] + [0, 0.25, 0, 0], motion.velocity[0])
    found = requirements(task, hopper.robot, numeric_physics(hopper), motion, start, (np.zeros(4), np.zeros(4)))
    assert found["max_goal_violation"].value == pytest.approx(0.25)


def test_bounds_of_a_free_duration(hopper: MotionProblem) -> None:
    """A motion longer or shorter than its bounds misses by the time."""
    for bounds, size in (("0.1, upper: 0.25", 0.05), ("0.4, upper: 1", 0.1), ("0.1, upper: 1", 0.0)):
        assert missed(hopper, drop(), f"horizon.duration={{lower: {bounds}}}")["goal"] == pytest.approx(size)


def test_waypoints(hopper: MotionProblem) -> None:
    """Hard targets are compared at the end of the interval; targets that are only weighted are never missed."""
    height = 0.7 - 9.81 / 2 * 0.15**2
    for waypoint, size in (
        (f"configuration: {{root_z: {height - 0.1}}}, tolerance: {{configuration: {{root_z: 0.02}}}}", 0.08),
        ("configuration: {root_z: 0.1}", 0.0),
        ("frames: {foot: {position: {z: 0}, tolerance: 0}}", height - 0.5),
        (f"velocity: {{root_z: {-9.81 * 0.15}}}, tolerance: {{velocity: {{root_z: 0}}}}", 0.0),
        ("velocity: {root_z: 0}, tolerance: {velocity: {root_z: 0}}", 9.81 * 0.15),
    ):
        for time in ("time: 0.15, ", ""):
            found = missed(hopper, drop(), f"waypoints=[{{{time}{waypoint}}}]")
            assert found["waypoint"] == pytest.approx(size, abs=1e-9), waypoint


def test_a_resting_contact_in_a_zone(hopper: MotionProblem) -> None:
    """A force inside a zone is a violation, also without an impact."""
    zone = "constraints={one: {type: forbidden_zone, contact: foot, x: [-0.2, 0.3]}}"
    assert missed(hopper, stance(), zone)["constraint"] == pytest.approx(0.2 - 1e-3)
    assert missed(hopper, collision(0.0), zone)["constraint"] == 0


def test_numbers_that_are_none_do_not_pass(hopper: MotionProblem) -> None:
    """A NaN in the motion is a NaN in what it misses."""
    motion = drop()
    motion.configuration[3, 0] = np.nan
    zone = "constraints={one: {type: avoid_sphere, frame: foot, center: {x: 0.1, z: 0.2}, radius: 0.15}}"
    assert np.isnan(missed(hopper, motion, zone)["constraint"])
