"""Goals of points, waypoints, references, costs and constraints in the task file: what is read, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from fesd_robot.errors import TaskError
from fesd_robot.task import (
    AvoidBox,
    Clearance,
    ContactWindow,
    FreeDuration,
    FromFile,
    PointTarget,
    Task,
    ThroughWaypoints,
    check_names,
    check_values,
    load_task,
)

Write = Callable[[str], Path]
COORDINATES = ["root_x", "root_z", "root_pitch", "leg"]

TASK = """\
name: hop
robot: {model: hopper.urdf}
contacts:
  foot: {frame: foot}
horizon:
  duration: 2
  intervals: 8
goal:
  frames:
    foot: {position: [1, null, 0.5], tolerance: 0.1}
  center_of_mass: {velocity: {z: 0.5}}
waypoints:
  - time: 0.5
    configuration: {leg: 0.3}
    tolerance:
      configuration: {leg: 0.1}
  - time: 1.25
    frames:
      body: {position: {z: 1}}
reference: {type: waypoints}
costs:
  control_change: {leg: 1}
  acceleration: {leg: 1}
  force: {foot: 1}
  center_of_mass: {z: 4}
  frames: {foot: 3}
constraints:
  knee:
    type: clearance
    frame: body
    distance: 0.1
  rock: {type: avoid_box, frame: foot, center: {x: 1, z: 0}, size: {x: 0.2, z: 0.4}}
  late: {type: contact_window, contact: foot, times: [1, 1.5], touch: forbidden}
  ditch: {type: forbidden_zone, contact: foot, x: [1, null]}
method: {grid: uniform}
"""


def test_everything_is_read(write: Write) -> None:
    """Each key arrives as a value, points by axis or as a list, and survives JSON."""
    task = load_task(write(TASK))
    assert task.goal.frames["foot"] == PointTarget(position=(1.0, None, 0.5), tolerance=0.1)
    assert task.goal.center_of_mass is not None and task.goal.center_of_mass.velocity == (None, None, 0.5)
    assert [waypoint.time for waypoint in task.waypoints] == [0.5, 1.25]
    assert task.waypoints[0].tolerance.configuration == {"leg": 0.1}
    assert isinstance(task.reference, ThroughWaypoints)
    assert task.costs.center_of_mass == {"z": 4.0} and task.costs.frames == {"foot": {"x": 3.0, "y": 3.0, "z": 3.0}}
    knee, rock, late = (task.constraints[name] for name in ("knee", "rock", "late"))
    assert isinstance(knee, Clearance) and (knee.distance, knee.offset) == (0.1, (0.0, 0.0, 0.0))
    assert isinstance(rock, AvoidBox) and (rock.center, rock.size, rock.power) == ((1, None, 0), (0.2, None, 0.4), 8)
    assert isinstance(late, ContactWindow) and late.times == (1.0, 1.5)
    dumped = task.model_dump(mode="json")
    assert Task.model_validate(dumped) == task and Task.model_validate_json(task.model_dump_json()) == task


def test_a_free_duration_is_a_range(write: Write) -> None:
    """A duration with lower and upper is chosen by the planner, and may cost."""
    task = load_task(write(TASK), FREE[:-1])
    assert task.horizon.duration == FreeDuration(lower=1, upper=3)
    assert Task.model_validate(task.model_dump(mode="json")) == task
    reference = load_task(write(TASK), ["reference={type: file, path: a.csv}"]).reference
    assert reference == FromFile(type="file", path="a.csv")


FREE = [
    "horizon.duration={lower: 1, upper: 3}",
    "waypoints=[{configuration: {leg: 0.3}}]",
    "constraints={}",
    "costs={time: 2}",
    "costs.acceleration={leg: 1}",
]

# (text of the valid task, its replacement, line, key, fragments of the message)
EDITS: list[tuple[str, str, int, str, list[str]]] = [
    # values
    ("[1, null, 0.5]", "[1, 0.5]", 10, "goal.frames.foot.position", ["[1, 0.5]", "[x, y, z] or a mapping"]),
    ("[1, null, 0.5]", "[null, null, null]", 10, "goal.frames.foot.position", ["at least one number"]),
    ("[1, null, 0.5]", "{w: 1}", 10, "goal.frames.foot.position", ["a mapping with w", "[x, y, z]"]),
    ("position: [1, null, 0.5], ", "", 10, "goal.frames.foot", ["neither a position nor a velocity"]),
    ("position: [1, null, 0.5]", "velocity: {x: 1}", 10, "goal.frames.foot.tolerance", ["without a position"]),
    ("{velocity: {z: 0.5}}", "{}", 11, "goal.center_of_mass", ["neither a position nor a velocity"]),
    ("{velocity: {z", "{tolerance: 1, velocity: {z", 11, "goal.center_of_mass.tolerance", ["without a position"]),
    ("tolerance: 0.1", "tolerance: -1", 10, "goal.frames.foot.tolerance", ["found -1", "at least 0"]),
    ("{z: 4}", "{z: -4}", 25, "costs.center_of_mass", ["mapping of x, y and z"]),
    ("{z: 4}", "{q: 4}", 25, "costs.center_of_mass", ["mapping of x, y and z"]),
    ("frames: {foot: 3}", "frames: {foot: much}", 26, "costs.frames.foot", ["'much'"]),
    ("  acceleration:", "  acceleraton:", 23, "costs.acceleraton", ["did you mean 'acceleration'?"]),
    # waypoints
    ("time: 1.25", "time: 1.3", 17, "waypoints.1.time", ["found 1.3", "the nearest are 1.25 or 1.5 s"]),
    ("time: 0.5", "time: 0.1", 13, "waypoints.0.time", ["from 0.25 to 1.75 s"]),
    ("time: 1.25", "time: 2", 17, "waypoints.1.time", ["found 2", "from 0.25 to 1.75 s"]),
    ("time: 1.25", "time: -1", 17, "waypoints.1.time", ["found -1", "at least 0"]),
    ("  - time: 1.25\n    frames", "  - frames", 17, "waypoints.1", ["for all of them or for none"]),
    ("{leg: 0.1}", "{root_z: 0.1}", 16, "waypoints.0.tolerance.configuration.root_z", ["gives no configuration"]),
    ("    frames:\n      body: {position: {z: 1}}\n", "", 17, "waypoints.1", ["without a target"]),
    ("    configuration: {leg: 0.3}", "    config: {leg: 0.3}", 14, "waypoints.0.config", ["'configuration'"]),
    ("  - time: 0.5\n", "  - 3\n  - time: 0.5\n", 13, "waypoints.0", ["found 3", "a mapping of keys"]),
    ("{leg: 0.3}", "{leg: long}", 14, "waypoints.0.configuration.leg", ["'long'", "a number"]),
    ("intervals: 8", "intervals: 2", 13, "waypoints.0.time", ["from 1 to 1 s", "1.25"][:1]),
    # constraints
    ("type: clearance", "type: clearence", 29, "constraints.knee.type", ["did you mean 'clearance'?"]),
    ("    distance: 0.1\n", "", 28, "constraints.knee.distance", ["missing", "from the ground"]),
    ("distance: 0.1", "distance: low", 31, "constraints.knee.distance", ["'low'", "a number"]),
    ("distance: 0.1", "radius: 0.1", 28, "constraints.knee.distance", ["missing", "; and 1 more error"]),
    ("z: 0.4}}", "y: 0.4}}", 32, "constraints.rock.size", ["found y in only one of center and size"]),
    ("z: 0.4}}", "z: 0}}", 32, "constraints.rock.size", ["found 0 along z", "greater than 0"]),
    ("[1, 1.5]", "[1.5, 1]", 33, "constraints.late.times", ["[from, to]"]),
    ("[1, 1.5]", "[1, 1.6]", 33, "constraints.late.times", ["found 1.6", "1.5 or 1.75 s"]),
    ("forbidden}", "forbidden, tolerance: 0.1}", 33, "constraints.late.tolerance", ["no meaning"]),
    ("[1, null]", "[2, 1]", 34, "constraints.ditch.x", ["lower < upper"]),
    # sections that contradict each other
    ("duration: 2", "duration: {lower: 1}", 6, "horizon.duration.upper", ["missing", "longest"]),
    ("duration: 2", "duration: {lower: 1, uper: 2}", 6, "horizon.duration.uper", ["did you mean 'upper'?"]),
    ("duration: 2", "duration: {lower: 1, upper: 2}", 13, "waypoints.0.time", ["a fixed horizon.duration"]),
    ("  force:", "  time: 1\n  force:", 24, "costs.time", ["which is fixed"]),
    ("  frames:\n    foot", "  periodic: {}\n  tolerance: {velocity: {leg: 0}}\n  frames:\n    foot", 10,
     "goal.tolerance", ["beside 'periodic'"]),
    ("  frames:\n    foot", "  periodic: {}\n  configuration: {leg: 0.2}\n  frames:\n    foot", 10,
     "goal.configuration", ["beside 'periodic'"]),
    ("costs:", "costs:\n  terminal_velocity: {leg: 1}", 22, "costs.terminal_velocity", ["goal.periodic"]),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "line", "key", "fragments"), EDITS, ids=[f"{e[3]} {e[1]}" for e in EDITS])
def test_a_mistake_is_located(write: Write, old: str, new: str, line: int, key: str, fragments: list[str]) -> None:
    """Each mistake is one error with file, line and key that says what was found and what would be valid."""
    assert TASK.count(old) >= 1
    text = TASK.replace(old, new, 1)
    overrides = ["goal.periodic={}"] if "goal.periodic" in fragments else []
    with pytest.raises(TaskError) as caught:
        load_task(write(text), overrides)
    assert (caught.value.line, caught.value.key) == (line, key), str(caught.value)
    for fragment in fragments:
        assert fragment in caught.value.message


def test_overrides_that_contradict_each_other(write: Write) -> None:
    """Mean accelerations need intervals of known length, splines a waypoint with a configuration."""
    with pytest.raises(TaskError, match=r"costs\.acceleration: .* free length"):
        load_task(write(TASK), FREE)
    with pytest.raises(TaskError, match=r"reference\.type: .* no waypoint has a configuration"):
        load_task(write(TASK), ["waypoints=[]"])
    with pytest.raises(TaskError, match="found 2 waypoints, expected less than"):
        load_task(
            write(TASK),
            ["horizon.intervals=2", "constraints={}", f"waypoints=[{', '.join(['{velocity: {leg: 0}}'] * 2)}]"],
        )


@pytest.mark.parametrize("intervals", [7, 12, 60, 300])
def test_the_nearest_times_are_accepted(write: Write, intervals: int) -> None:
    """Times of endless digits, which a message names rounded, are valid as it names them."""
    short = ["horizon.duration=0.8", f"horizon.intervals={intervals}", "constraints={}"]
    spread = "waypoints=[{{time: {}, configuration: {{leg: 0.3}}}}]"
    between = 0.8 * (round(0.6 * intervals) + 0.5) / intervals
    with pytest.raises(TaskError, match="nearest are") as caught:
        load_task(write(TASK), [*short, spread.format(between)])
    named = caught.value.message.split("nearest are ")[1].split(" s")[0].split(" or ")
    assert len(named) == 2
    for time in named:
        load_task(write(TASK), [*short, spread.format(time)])


NAMES = [
    ("    foot: {position", "    food: {position", 10, "goal.frames.food", "did you mean 'foot'?"),
    ("{leg: 0.3}\n", "{leg: 0.3}\n    velocity: {lag: 1}\n", 15, "waypoints.0.velocity.lag", "did you mean 'leg'?"),
    ("      body:", "      bodi:", 19, "waypoints.1.frames.bodi", "did you mean 'body'?"),
    ("change: {leg", "change: {lag", 22, "costs.control_change.lag", "a control"),
    ("acceleration: {leg", "acceleration: {lag", 23, "costs.acceleration.lag", "a velocity coordinate"),
    ("force: {foot", "force: {food", 24, "costs.force.food", "a contact (did you mean 'foot'?)"),
    ("frames: {foot", "frames: {food", 26, "costs.frames.food", "a frame"),
    ("frame: body", "frame: bodi", 30, "constraints.knee.frame", "did you mean 'body'?"),
    ("contact: foot, x", "contact: food, x", 34, "constraints.ditch.contact", "did you mean 'foot'?"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "line", "key", "fragment"), NAMES, ids=[name[3] for name in NAMES])
def test_an_unknown_name_is_located(write: Write, old: str, new: str, line: int, key: str, fragment: str) -> None:
    """Names of frames, contacts, coordinates and controls are compared with the robot's."""
    check_names(load_task(write(TASK)), COORDINATES, COORDINATES, COORDINATES, ["body", "foot"])
    with pytest.raises(TaskError) as caught:
        check_names(
            load_task(write(TASK.replace(old, new, 1))), COORDINATES, COORDINATES, COORDINATES, ["body", "foot"]
        )
    assert (caught.value.line, caught.value.key) == (line, key), str(caught.value)
    assert fragment in caught.value.message


def test_a_waypoint_outside_its_limits(write: Write) -> None:
    """The configuration of a waypoint lies within the limits, like that of a goal."""
    task = load_task(write(TASK))
    check_values(task, {"leg": (0.1, 0.5)}, {})
    with pytest.raises(TaskError) as caught:
        check_values(task, {"leg": (0.4, 0.5)}, {})
    assert (caught.value.line, caught.value.key) == (14, "waypoints.0.configuration.leg")
