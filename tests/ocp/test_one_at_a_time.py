"""Controls of which one set acts at a time: exact in plans, measured by the audit, refused where they cannot be."""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from fesd_robot import TaskError, plan
from fesd_robot.explanation import explanation
from fesd_robot.fesd import Transcription
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.ocp import formulate
from fesd_robot.ocp.judged import numeric_physics, physical_motion
from fesd_robot.phases import guessed_sequences
from fesd_robot.plans import Plan
from fesd_robot.plans.requirements import requirements
from fesd_robot.task import Task, load_task

FINGER = Path(__file__).parents[2] / "models" / "finger" / "finger.urdf"
MASS = 0.1

TASK = f"""\
name: thrusters
robot:
  model: {FINGER}
  actuators:
    east: {{type: generalized_force, force: {{tip_x: 1}}, lower: 0, upper: 5}}
    west: {{type: generalized_force, force: {{tip_x: -1}}, lower: 0, upper: 5}}
    north: {{type: generalized_force, force: {{tip_z: 1}}, lower: 0, upper: 5}}
    south: {{type: generalized_force, force: {{tip_z: -1}}, lower: 0, upper: 5}}
  one_at_a_time:
    valve: {{along: [east, west], across: [north, south]}}
gravity: [0, 0, 0]
contacts: {{}}
horizon: {{duration: 1, intervals: 8}}
goal:
  velocity: {{tip_x: 1, tip_z: 0.5}}
  tolerance: {{configuration: {{tip_x: 9, tip_z: 9}}, velocity: {{tip_x: 1.0e-9, tip_z: 1.0e-9}}}}
costs: {{configuration: {{}}, velocity: {{}}, control: {{}}, control_sum: {{valve: 3}}, terminal_configuration: {{}}}}
"""
"""A body that is brought to a velocity by thrusters along x and along z behind one valve."""


def load(tmp_path: Path, text: str = TASK, *overrides: str) -> Task:
    file = tmp_path / "thrusters.yaml"
    file.write_text(text)
    return load_task(file, list(overrides))


def strongest(found: Plan) -> np.ndarray:
    """Largest control of every set in every interval, N, (N, 2)."""
    sets = (("east", "west"), ("north", "south"))
    return np.array([np.max([found.controls[name] for name in own], axis=0) for own in sets]).T


def test_time_is_shared_as_a_closed_form_says(tmp_path: Path) -> None:
    """Forces m v / t over times t as v that share T cost 3 m^2 (v_x + v_z)^2 / T; both at once would cost less."""
    found = plan(load(tmp_path))
    assert found.status.solved and found.status.exact
    assert found.statistics.objective == pytest.approx(3 * MASS**2 * 1.5**2, rel=1e-6)
    assert (strongest(found).min(axis=1) == 0).all()
    assert found.audit.max_simultaneous_control == 0


def test_a_grid_that_stands_still_keeps_them_apart_too(tmp_path: Path) -> None:
    """On six intervals the sets take four and two of them."""
    found = plan(load(tmp_path, TASK, "method.grid=uniform", "horizon.intervals=6", "method.elements=1"))
    assert found.status.solved and found.status.exact
    assert (strongest(found).min(axis=1) == 0).all()
    assert found.statistics.objective == pytest.approx(3 * MASS**2 * 1.5**2, rel=1e-6)


def test_the_condition_is_that_one_set_acts(tmp_path: Path) -> None:
    """G H is zero for both sets if the controls of one are zero, and the product of their sums if not."""
    system = formulate(load(tmp_path)).ocp.system
    conditions = [one for one in system.vanishing if one.label.kind == "one set of controls at a time"]
    products = ca.Function("products", [system.algebraic], [ca.vertcat(*[one.G * one.H for one in conditions])])
    copies = sorted(system.control_copies)

    def at(*controls: float) -> list[float]:
        z = np.zeros(system.algebraic.numel())
        z[copies] = controls
        return np.asarray(products(z)).ravel().tolist()

    assert at(1, 2, 0, 0) == at(0, 0, 3, 0) == [0, 0]
    assert at(1, 2, 3, 0) == [9, 9]


def test_the_guess_shows_which_set_moves_along_it(tmp_path: Path) -> None:
    """Towards a goal along z the set along z acts in the first sequence, and each alone in others."""
    motion = formulate(load(tmp_path, TASK.replace("velocity: {tip_x: 1, tip_z: 0.5}", "configuration: {tip_z: 1}")))
    sequences = [str(one) for one in guessed_sequences(motion)]
    assert sequences == ["[across]", "[along]"]


def test_the_audit_measures_a_second_set(tmp_path: Path) -> None:
    """Of a plan in which both sets act the smaller one's control is the violation, whoever has solved it."""
    motion = formulate(load(tmp_path, TASK, "method.grid=uniform"))
    transcription = Transcription(motion.ocp, motion.fesd)
    w = transcription.problem.start.copy()
    w[transcription.indices.control(2)[:4]] = [1, 0, 0, 0.25]
    physical = physical_motion(motion, transcription.unpack(w), BranchTranscription(transcription).branch(w))
    ends = (np.zeros(2), np.zeros(2))
    found = requirements(motion.task, motion.robot, numeric_physics(motion), physical, ends, ends)
    worst = found["max_simultaneous_control"]
    assert (worst.value, worst.interval, worst.subject) == (0.25, 2, "south")


WRONG = [
    ("[east, west]", "[east, vest]", "robot.one_at_a_time.valve.along.1", "a control (did you mean 'west'?)"),
    ("[north, south]", "[north, east]", "robot.one_at_a_time.valve.across.1", "in 'valve.along' already"),
    ("force: {tip_z: 1}, lower: 0", "force: {tip_z: 1}, lower: -1", "valve.across.0", "as low as -1, expected"),
    (", across: [north, south]", "", "robot.one_at_a_time.valve", "expected two sets"),
    ("valve: {along", "a valve: {along", "robot.one_at_a_time", "letters, digits and '_'"),
    ("control_sum: {valve: 3}", "control_sum: {valves: 3}", "costs.control_sum.valves", "did you mean 'valve'?"),
    ("horizon:", "method: {contact: impulses}\nhorizon:", "method.contact", "expected 'freezing'"),
]


@pytest.mark.parametrize(("old", "new", "key", "words"), WRONG, ids=[key for _, _, key, _ in WRONG])
def test_what_cannot_be_is_one_sentence(tmp_path: Path, old: str, new: str, key: str, words: str) -> None:
    """Unknown, repeated and negative controls, single sets and forms without them name file, line and key."""
    assert old in TASK
    with pytest.raises(TaskError) as error:
        formulate(load(tmp_path, TASK.replace(old, new)))
    assert key in str(error.value) and words in str(error.value)
    assert str(error.value).count("\n") == 0


def test_check_says_which_sets_there_are(tmp_path: Path) -> None:
    """The explanation of a task names them with their controls."""
    motion = formulate(load(tmp_path, TASK, "method.grid=uniform"))
    words = " ".join(explanation(motion, Transcription(motion.ocp, motion.fesd).problem).split())
    assert "One at a time acts (valve): along (east, west); across (north, south)." in words
