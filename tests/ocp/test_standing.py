"""Where a robot stands: coordinates that inverse kinematics finds, compared with closed forms."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fesd_robot.errors import TaskError
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.ocp.judged import numeric_physics
from fesd_robot.planning.planner import plan
from fesd_robot.plans import task_of
from fesd_robot.task import Task, load_task

from .cart import TASK as CART
from .cart import URDF

Load = Callable[[str], Task]
TASKS = Path(__file__).parents[2] / "tasks"
EXACT = 1e-9
LEGS = {"FL": 1, "FR": 1, "HL": -1, "HR": -1}
"""Leg of Solo12 -> sign of its upper joint as it stands with knees inwards."""


def formulated(name: str, *overrides: str) -> MotionProblem:
    return formulate(load_task(TASKS / f"{name}.yaml", ["method.grid=uniform", *overrides]))


def start_gaps(motion: MotionProblem) -> np.ndarray:
    """Return the gaps at the start by the numeric kinematics, which share no expression with the search."""
    return numeric_physics(motion).gaps(motion.endpoints.initial_configuration)


@pytest.mark.parametrize("slope", [-0.3, 0.0, 0.2])
def test_a_hopper_on_a_slope(short: str, load: Load, slope: float) -> None:
    """The height is that of the ground below the foot plus the leg, whatever height the search starts from."""
    ground = f"ground: {{slope: {slope}, height: 0.05}}\n"
    for given in ("root_z: 0.6", "root_z: 0.0", "root_z: 1.4"):
        text = short.replace("root_z: 0.6", f"{given}, root_x: 0.4").replace("0.5}}", "0.5}, stand_on: [foot]}")
        motion = formulate(load(text + "  stand_on: [foot]\n" + ground))
        expected = [0.05 + x * math.tan(slope) + 0.5 for x in (0.4, 1.0)]
        assert motion.task.initial.configuration["root_z"] == pytest.approx(expected[0], abs=EXACT)
        assert motion.task.goal.configuration == {"root_x": 1, "root_z": pytest.approx(expected[1], abs=EXACT)}
        np.testing.assert_allclose(motion.endpoints.goal_configuration, [1, expected[1], 0, 0.5], atol=EXACT)
        assert start_gaps(motion) == pytest.approx(0, abs=EXACT)


def test_a_hopper_in_space_on_a_tilted_plane_and_on_hills(tmp_path: Path) -> None:
    """Its height is that of the ground below the foot, which varies along y, plus that of the leg."""
    x, y = 0.3, -0.4
    points = [
        (a, b, 0.1 * math.sin(3 * a) * math.cos(2 * b)) for a in np.linspace(-1, 1, 21) for b in np.linspace(-1, 1, 21)
    ]
    (tmp_path / "map.csv").write_text("x,y,z\n" + "\n".join(f"{a},{b},{z}" for a, b, z in points), encoding="utf-8")
    text = (TASKS / "hopper_in_space.yaml").read_text(encoding="utf-8")
    text = text.replace("../models", str(TASKS.parent / "models")).replace("root_x: 0 #", f"root_x: {x} #")
    text = text.replace("    root_y: 0\n", f"    root_y: {y}\n")
    plane, hills = "plane\n  lateral_slope: 0.2\n  slope: -0.1", "height_map\n  file: map.csv"
    for ground, height, exact in (
        (plane, y * math.tan(0.2) - x * math.tan(0.1), EXACT),
        (hills, 0.1 * math.sin(3 * x) * math.cos(2 * y), 1e-5),
    ):
        (tmp_path / "task.yaml").write_text(text.replace("type: plane", f"type: {ground}"), encoding="utf-8")
        motion = formulate(load_task(tmp_path / "task.yaml", ["method.grid=uniform"]))
        assert motion.task.initial.configuration["root_z"] == pytest.approx(height + 0.5, abs=exact)
        assert start_gaps(motion) == pytest.approx(0, abs=EXACT)


@pytest.mark.parametrize("size", ["[0.4, 0.8, 0.1]", "[0.4, null, 0.1]"])
def test_a_quadruped_stands_with_its_fore_feet_on_a_box(tmp_path: Path, size: str) -> None:
    """From the floor, where all feet stand, the goal has the fore feet 0.1 m up on the box, the others on the floor."""
    knees = ", ".join(f"{leg}_HFE: {sign * 0.8}, {leg}_KFE: {-sign * 1.6}" for leg, sign in LEGS.items())
    adjusted = ", ".join(f"{leg}_{joint}" for leg in LEGS for joint in ("HFE", "KFE"))
    feet = "".join(f"  {leg}: {{frame: {leg}_FOOT}}\n" for leg in LEGS)
    (tmp_path / "task.yaml").write_text(
        "name: step_up\nrobot: {model: 'example-robot-data:solo12', root: free_flyer}\n"
        f"surfaces:\n  step: {{type: box, center: [0.5, 0, 0.05], size: {size}}}\n"
        f"contacts:\n{feet}"
        "  FL_step: {frame: FL_FOOT, surface: step}\n  FR_step: {frame: FR_FOOT, surface: step}\n"
        "horizon: {duration: 1, intervals: 5}\n"
        f"initial: {{configuration: {{{knees}}}, stand_on: [FL, FR, HL, HR]}}\n"
        "goal:\n  configuration: {root_joint.x: 0.35}\n"
        f"  stand_on: {{contacts: [FL_step, FR_step, HL, HR], adjust: [root_joint.z, {adjusted}]}}\n",
        encoding="utf-8",
    )
    motion = formulate(load_task(tmp_path / "task.yaml", ["method.grid=uniform"]))
    physics, ends = numeric_physics(motion), motion.endpoints
    assert [contact.name for contact in motion.contacts] == [*LEGS, "FL_step", "FR_step"]
    start, goal = (physics.contact_points(q)[:, 2] for q in (ends.initial_configuration, ends.goal_configuration))
    assert start[:4] == pytest.approx(0, abs=EXACT)
    assert goal[:4] == pytest.approx([0.1, 0.1, 0, 0], abs=EXACT)


def test_the_start_is_exactly_closed(short: str, load: Load) -> None:
    """A contact that was brought to touch has the gap 0 at the start of the problem, without rounding."""
    text = short.replace("0.5}}", "0.5}, stand_on: [foot]}") + "  stand_on: [foot]\nground: {slope: 0.3}\n"
    assert formulate(load(text)).ocp.initial_lower[-1] == 0.0


def test_a_hopper_on_steps() -> None:
    """In the middle of a step the height is the step's plus the leg, before the first the ground's."""
    for x, height in ((0.1, 0.0), (0.6, 0.15), (1.2, 0.3)):
        motion = formulated("hopper_stairs", f"initial.configuration.root_x={x}", "initial.stand_on=[foot]")
        assert motion.task.initial.configuration["root_z"] == pytest.approx(height + 0.5, abs=EXACT)


def test_on_the_edge_of_a_step() -> None:
    """On the smoothed edge, where no closed form is at hand, the gap that the audit measures is zero."""
    motion = formulated("hopper_stairs", "initial.configuration.root_x=0.42", "initial.stand_on=[foot]")
    assert 0.5 < motion.task.initial.configuration["root_z"] < 0.65
    assert start_gaps(motion)[0] == pytest.approx(0, abs=EXACT)


def test_a_circle_on_a_slope_and_on_hills() -> None:
    """The centre of a wheel is r / cos(slope) above a slope; on a height map the circle touches, too."""
    wheel = ("initial.configuration={root_x: 0.5}", "initial.stand_on=[rim]")
    slope = formulated("wheel_hills", *wheel, "ground={slope: 0.2}", "goal.stand_on=[rim]")
    expected = [x * math.tan(0.2) + 0.2 / math.cos(0.2) for x in (0.5, 2.4)]
    assert slope.endpoints.initial_configuration[1] == pytest.approx(expected[0], abs=EXACT)
    assert slope.endpoints.goal_configuration[1] == pytest.approx(expected[1], abs=EXACT)
    hills = formulated("wheel_hills", *wheel)
    assert hills.endpoints.initial_configuration[1] > 0.21
    assert start_gaps(hills) == pytest.approx(0, abs=EXACT)


def test_at_a_wall() -> None:
    """A body of radius 0.1 m that leans on a wall at x = 1.4 m is at 1.3 m, and its foot stands on the upper step."""
    stand = "initial.stand_on={contacts: [body, foot], adjust: [root_x, root_z]}"
    motion = formulated("hopper_stairs", "initial.configuration={root_x: 1.25, leg: 0.5}", stand)
    found = motion.task.initial.configuration
    assert (found["root_x"], found["root_z"]) == pytest.approx((1.3, 0.8), abs=EXACT)


def test_knees_that_are_adjusted() -> None:
    """With thigh and shank of 0.16 m, cos(hip) + cos(hip + knee) = height / 0.16 m gives the knees of Solo12."""
    stand = "initial.stand_on={contacts: [front, hind], adjust: [FL_KFE, HL_KFE]}"
    motion = formulated("solo12_jump", stand, "initial.configuration.root_z=0.2")
    knee = -math.acos(0.2 / 0.16 - math.cos(0.7)) - 0.7
    found = motion.task.initial.configuration
    assert (found["FL_KFE"], found["HL_KFE"]) == pytest.approx((knee, knee), abs=1e-8)
    assert (found["root_z"], found["FL_HFE"]) == (0.2, 0.7)
    assert "root_pitch" not in found


@pytest.mark.parametrize("slope", [-0.15, 0.1])
def test_two_feet_with_pitch(slope: float) -> None:
    """A biped that stands level on level ground stands on a slope pitched by it: root_z = h / cos(slope)."""
    level = formulated("biped_step", "initial.stand_on=[left, right]").task.initial.configuration
    assert level["root_pitch"] == pytest.approx(0, abs=EXACT) and level["root_z"] == pytest.approx(0.7545, abs=2e-5)
    motion = formulated("biped_step", "initial.stand_on=[left, right]", f"ground.slope={slope}", "goal.stand_on=[left]")
    found = motion.task.initial.configuration
    assert found["root_pitch"] == pytest.approx(-slope, abs=1e-8)
    assert found["root_z"] == pytest.approx(level["root_z"] / math.cos(slope), abs=1e-8)
    assert (
        motion.task.goal.configuration.keys()
        - load_task(TASKS / "biped_step.yaml", ["method.grid=uniform"]).goal.configuration
        == set()
    )


def test_more_coordinates_than_contacts() -> None:
    """Of all configurations in which one foot touches, one near the start is found, within the limits."""
    stand = "initial.stand_on={contacts: [foot], adjust: [root_z, leg]}"
    motion = formulated(
        "published_hopper_one_jump", stand, "initial.configuration.root_z=0.8", "initial.configuration.leg=0.4",
        "limits.position.root_z=[0.42, null]",
    )  # fmt: skip
    found = motion.task.initial.configuration
    assert found["root_z"] == pytest.approx(found["leg"], abs=EXACT)
    assert 0.42 <= found["root_z"] <= 0.5
    assert start_gaps(motion) == pytest.approx(0, abs=EXACT)


WAYPOINTS = """\
waypoints:
  - configuration: {root_x: 0.5, leg: 0.3}
    stand_on: [foot]
    tolerance: {configuration: {root_z: 0.01}}
  - posture: crouch
    configuration: {root_x: 0.7}
postures: {crouch: {leg: 0.2, root_z: 0.4}}
ground: {slope: 0.2}
reference: {type: waypoints}
"""


def preferring(**prefer: float) -> MotionProblem:
    """The biped that stands on both feet with knees and hips that are preferred."""
    standing = f"{{contacts: [left, right], prefer: {json.dumps(prefer)}}}"
    start = "initial.configuration={left_hip: -0.3, right_hip: 0.2}"
    return formulated("biped_step", start, f"initial.stand_on={standing}", "goal.stand_on=[left, right]")


def test_a_preference_that_can_be_met_is() -> None:
    """Legs bent alike stand level: all four preferred angles are what is found, at the height of the closed form."""
    found = preferring(left_hip=-0.3, right_hip=-0.3, left_knee=0.6, right_knee=0.6).task.initial.configuration
    height = 0.4 * (math.cos(-0.3) + math.cos(0.3))
    expected = {"left_hip": -0.3, "right_hip": -0.3, "left_knee": 0.6, "right_knee": 0.6, "root_z": height}
    assert {name: found[name] for name in expected} == pytest.approx(expected, abs=1e-6)


def test_of_all_postures_the_nearest_to_the_preferred_is_found() -> None:
    """With a pitch that is preferred no other posture nearby in which both feet touch is nearer; numeric kinematics."""
    wanted = {"root_pitch": 0.0, "left_knee": 0.6, "right_knee": 0.6, "left_hip": -0.6}
    motion = preferring(**wanted)
    physics, names = numeric_physics(motion), motion.robot.configuration_names
    q = motion.endpoints.initial_configuration
    assert start_gaps(motion) == pytest.approx(0, abs=EXACT)
    pull = np.array([q[i] - wanted[name] if name in wanted else 0.0 for i, name in enumerate(names)])
    assert np.abs(pull).max() > 0.01
    adjusted = [names.index(name) for name in ("root_z", *wanted)]
    normals = physics.contact_jacobian(q)[::2][:, adjusted]
    along = pull[adjusted] - normals.T @ np.linalg.lstsq(normals.T, pull[adjusted], rcond=None)[0]
    np.testing.assert_allclose(along, 0, atol=1e-5)


def test_preferences_keep_to_limits() -> None:
    """A preferred value that a limit of the task forbids is an error; a straight knee at its limit is allowed."""
    found = preferring(left_knee=0.0, right_knee=0.0).task.initial.configuration
    assert found["left_knee"] >= 0 and found["right_knee"] >= 0
    with pytest.raises(TaskError) as caught:
        preferring(left_knee=-0.1)
    assert caught.value.key == "initial.stand_on.prefer.left_knee"
    assert "found -0.1, expected a value in [0, 2.4]" in caught.value.message
    with pytest.raises(TaskError) as caught:
        preferring(left_kne=0.1)
    assert caught.value.key == "initial.stand_on.prefer.left_kne" and "'left_knee'" in caught.value.message


def test_what_a_waypoint_finds_is_its_target(short: str, load: Load) -> None:
    """The found height may have a tolerance, weighs in the cost and leads the reference; what is left out is free."""
    motion = formulate(load(short.replace("root_z: 0.6", "root_z: 0.8") + WAYPOINTS))
    first, second = motion.task.waypoints
    height = 0.5 * math.tan(0.2) + 0.3
    assert first.configuration == {"root_x": 0.5, "leg": 0.3, "root_z": pytest.approx(height, abs=EXACT)}
    assert second.configuration == {"root_x": 0.7, "leg": 0.2, "root_z": 0.4}
    (bounds,) = [each for each in motion.ocp.constraints if each.name == "waypoint 1"]
    assert bounds.row_names == ["root_z"]
    assert motion.reference.configuration(motion.grid.ends[0])[1] == pytest.approx(height, abs=EXACT)


def test_a_goal_stands_with_the_joints_of_the_start(short: str, load: Load) -> None:
    """What a goal leaves out is as the start was found: a hopper that found its leg keeps it."""
    text = short.replace("root_z: 0.6", "root_z: 0.35").replace(
        "0.5}}", "0.5}, stand_on: {contacts: [foot], adjust: [leg]}}"
    )
    motion = formulate(load(text + "  stand_on: [foot]\nground: {slope: 0.1}\n"))
    assert motion.task.initial.configuration["leg"] == pytest.approx(0.35, abs=EXACT)
    assert motion.endpoints.goal_configuration[1] == pytest.approx(0.35 + math.tan(0.1), abs=EXACT)


def test_own_values_come_before_those_of_a_posture() -> None:
    """A posture gives the coordinates that a section does not give itself; those it adjusts are where it starts."""
    motion = formulated(
        "solo12_jump",
        "postures={low: {root_z: 0.3, FL_HFE: 0.9, FL_KFE: -1.8, HL_HFE: 0.9, HL_KFE: -1.8}}",
        "initial={posture: low, configuration: {HL_HFE: 0.8}, stand_on: [front]}",
        "goal.posture=low",
    )
    start, goal = motion.task.initial.configuration, motion.task.goal.configuration
    assert (start["FL_HFE"], start["HL_HFE"], start["HL_KFE"]) == (0.9, 0.8, -1.8)
    assert start["root_z"] == pytest.approx(0.32 * math.cos(0.9), abs=EXACT)
    assert goal == {"root_x": 0.3, "root_z": 0.3, "FL_HFE": 0.9, "FL_KFE": -1.8, "HL_HFE": 0.9, "HL_KFE": -1.8}


def test_a_formulated_task_stays_as_it_is() -> None:
    """Formulating the formulated task again, also after JSON as in a plan, changes no bit of it."""
    for name, *overrides in (
        ("biped_step", "ground.slope=0.1", "initial.stand_on=[left, right]", "goal.stand_on=[left, right]"),
        ("wheel_hills", "initial.configuration.root_x=0.55", "initial.stand_on=[rim]"),
        ("published_hopper_one_jump", "postures={low: {leg: 0.2}}", "waypoints=[{posture: low, stand_on: [foot]}]"),
    ):
        once = formulated(name, *overrides).task
        stored = Task.model_validate(json.loads(json.dumps(once.model_dump(mode="json")))).with_origins(once.origins)
        assert stored == once
        assert formulate(once).task == formulate(stored).task == once


def test_a_plan_has_what_was_found(load_short: Callable[..., Task]) -> None:
    """Start, outcome and the stored task of a plan have the heights that were found, for the goal as for the start."""
    slope = ("ground.slope=0.1", "limits.position.root_x=[0, 1.1]", "solver.max_iterations=1", "solver.retries=0")
    stand = ("initial.stand_on=[foot]", "goal.stand_on=[foot]", "goal.tolerance={configuration: {root_z: 0.5}}")
    made = plan(load_short(*slope, *stand))
    start, goal = (x * math.tan(0.1) + 0.5 for x in (0.1, 0.12))
    assert made.trajectory.configuration["root_z"][0] == pytest.approx(start, abs=1e-7)
    (entry,) = [each for each in made.outcome.goal if each.name == "root_z" and each.kind == "position"]
    assert entry.goal == pytest.approx(goal, abs=EXACT)
    assert task_of(made).goal.configuration["root_z"] == pytest.approx(goal, abs=EXACT)


@pytest.mark.parametrize("name", ["published_hopper_one_jump", "solo12_jump"])
def test_a_task_without_both_stays_as_it_is(name: str) -> None:
    """The configurations of a task that names no posture and no contacts to stand on are not changed."""
    task = load_task(TASKS / f"{name}.yaml", ["method.grid=uniform"])
    completed = formulate(task).task
    assert (completed.initial, completed.waypoints) == (task.initial, task.waypoints)
    assert completed.goal.configuration == task.goal.configuration


# (text added to the short task, its replacements, line, key, fragments of the message)
MISTAKES: list[tuple[str, list[tuple[str, str]], int, str, list[str]]] = [
    ("", [("0.5}}", "0.5}, stand_on: [fot]}")], 8, "initial.stand_on.0", ["'fot'", "did you mean 'foot'?"]),
    ("  stand_on: {contacts: [foot], adjust: [root_z, lag]}\n", [], 11, "goal.stand_on.adjust.1",
     ["found 'lag', expected a configuration coordinate (did you mean 'leg'?)"]),
    ("waypoints:\n  - stand_on:\n      contacts: [foot, food]\n", [], 13, "waypoints.0.stand_on.contacts.1",
     ["'food'", "did you mean 'foot'?"]),
    ("postures:\n  low: {leg: 0.3}\n", [("0.5}}", "0.5}, posture: lwo}")], 8, "initial.posture",
     ["found 'lwo', expected a posture (did you mean 'low'?)"]),
    ("postures:\n  low: {lg: 0.3}\n", [], 12, "postures.low.lg", ["'lg'", "did you mean 'leg'?"]),
    ("postures:\n  low: {leg: 0.9}\n", [], 12, "postures.low.leg", ["found 0.9", "the limits in the robot"]),
    ("", [("0.5}}", "0.5}, stand_on: {contacts: [foot], adjust: [root_x]}}")], 8, "initial.stand_on",
     ["found contact 'foot' 0.1 m away from what it should touch, however root_x is adjusted; expected foot within"]),
    ("", [("root_z: 0.6", "root_z: 0.9"), ("0.5}}", "0.5}, stand_on: {contacts: [foot], adjust: [leg]}}")], 8,
     "initial.stand_on", ["'foot' 0.4 m away", "(leg is at its limit 0.5)"]),
    ("", [("root_z: 0.6", "root_z: 0.1"), ("0.5}}", "0.5}, stand_on: {contacts: [foot], adjust: [root_x]}}")], 8,
     "initial.stand_on", ["'foot' 0.4 m inside what it should touch"]),
    ("waypoints:\n  - posture: low\n    tolerance:\n      configuration: {root_z: 0.1}\npostures: {low: {leg: 0.2}}\n",
     [], 14, "waypoints.0.tolerance.configuration.root_z", ["gives no configuration"]),
    ("waypoints:\n  - posture: low\npostures: {low: {}}\n", [], 12, "waypoints.0", ["without a target"]),
    ("  frames: {foot: {position: {x: 1}}}\n  stand_on: [foot]\n  tolerance: {configuration: {leg: 0}}\n", [], 13,
     "goal.tolerance.configuration.leg", ["found a tolerance of 'leg'"]),
]  # fmt: skip


@pytest.mark.parametrize(
    ("added", "edits", "line", "key", "fragments"), MISTAKES, ids=[f"{m[3]} {m[4][0]}" for m in MISTAKES]
)
def test_a_mistake_is_located(
    short: str, load: Load, added: str, edits: list[tuple[str, str]], line: int, key: str, fragments: list[str]
) -> None:
    """Each mistake is one error with file, line and key that says what was found and what would be valid."""
    text = short + added
    for old, new in edits:
        assert text.count(old) == 1
        text = text.replace(old, new)
    with pytest.raises(TaskError) as caught:
        formulate(load(text))
    assert caught.value.file is not None and (caught.value.line, caught.value.key) == (line, key), str(caught.value)
    for fragment in fragments:
        assert fragment in caught.value.message


def test_feet_that_cannot_touch_at_once() -> None:
    """With the height alone, feet at heights that differ by 2 d both miss the ground by d, and one is named."""
    stand = "initial.stand_on={contacts: [front, hind], adjust: [root_z]}"
    with pytest.raises(TaskError) as caught:
        formulated("solo12_jump", stand, "initial.configuration.HL_HFE=0.9", "initial.configuration.HL_KFE=-1.8")
    half = 0.16 * (math.cos(0.7) - math.cos(0.9))
    assert f"{half:.4g} m" in caught.value.message
    assert "however root_z is adjusted; expected front and hind within reach at once" in caught.value.message
    assert caught.value.message.endswith(f"or fewer contacts (from --set {stand})")


def test_a_robot_without_a_height_needs_adjust(load: Load, tmp_path: Path) -> None:
    """Where there is no root_z the coordinates to adjust have to be said."""
    (tmp_path / "cart.urdf").write_text(URDF, encoding="utf-8")
    text = CART + "horizon: {duration: 1, intervals: 2}\ninitial:\n  stand_on: [wheel]\n"
    with pytest.raises(TaskError, match=r"without root_z, expected stand_on\.contacts and stand_on\.adjust") as caught:
        formulate(load(text))
    assert (caught.value.line, caught.value.key) == (8, "initial.stand_on")


def test_half_a_coordinate_is_not_adjusted(load: Load, tmp_path: Path) -> None:
    """The cosine of an unlimited joint cannot be adjusted alone."""
    joint = '<joint name="spin" type="continuous"><parent link="cart"/><child link="arm"/><axis xyz="0 1 0"/></joint>'
    link = '<link name="arm"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
    tip = '<link name="tip"/><joint name="end" type="fixed"><parent link="arm"/><child link="tip"/>'
    model = f'{link}</inertial></link>{joint}{tip}<origin xyz="0 0 -1.2"/></joint></robot>'
    (tmp_path / "cart.urdf").write_text(URDF.replace("</robot>", model), encoding="utf-8")
    text = CART.replace("frame: cart", "frame: tip") + "horizon: {duration: 1, intervals: 2}\n"
    text += "initial:\n  stand_on:\n    contacts: [wheel]\n    adjust: [spin.cos]\n"
    with pytest.raises(TaskError, match=r"found 'spin\.cos', which changes together with others") as caught:
        formulate(load(text))
    assert (caught.value.line, caught.value.key) == (10, "initial.stand_on.adjust.0")
