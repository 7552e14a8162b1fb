"""Exports opened by the programs that they are for, and the motion between the samples of a plan."""

from __future__ import annotations

import io
import json
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from fesd_robot import FesdRobotError, Plan, PlanFileError, load_task, read_plan, simulate
from fesd_robot.actions import exported
from fesd_robot.ocp import formulate
from fesd_robot.ocp.judged import numeric_physics
from fesd_robot.plans import task_of
from fesd_robot.recovery.contact_rows import stacked_rows
from fesd_robot.robot import load_robot

TESTS = Path(__file__).parents[1]
TASKS = TESTS.parent / "tasks"
SLED = """
<mujoco>
  <worldbody>
    <body name="sled">
      <joint name="x" type="slide" axis="1 0 0"/>
      <joint name="z" type="slide" axis="0 0 1"/>
      <geom type="box" size="0.1 0.1 0.05" mass="2"/>
      <body name="mast" pos="0 0 0.1">
        <joint name="tilt" type="hinge" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 0 0 0.3" size="0.02" mass="0.5"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="x" gear="5" ctrlrange="-1 1"/></actuator>
</mujoco>
"""


@pytest.fixture(scope="module")
def solo12() -> Plan:
    """A jump of Solo12, with its task's files where they are."""
    plan = read_plan(TESTS / "render" / "plans" / "solo12_jump.json")
    provenance = plan.provenance.model_copy(update={"folder": str(TASKS)})
    return plan.model_copy(update={"provenance": provenance, "full_model": None})


def test_between_samples_the_equations_of_motion_hold(short_plan: Plan) -> None:
    """At random times M a + h = B u + J^T f by Pinocchio, to a thousandth of a newton."""
    motion = formulate(task_of(short_plan))
    physics, robot = numeric_physics(motion), motion.robot
    at = short_plan.at(np.random.default_rng(0).uniform(0, short_plan.trajectory.time[-1], 40))
    for k in range(40):
        q, v, a = (
            np.array([np.asarray(values[name])[k] for name in names])
            for values, names in (
                (at.configuration, robot.configuration_names),
                (at.velocity, robot.velocity_names),
                (at.acceleration, robot.velocity_names),
            )
        )
        u = np.array([np.asarray(at.controls[name])[k] for name in motion.actuation.names])
        force = np.array([[np.asarray(c.normal)[k], np.asarray(c.tangential)[k]] for c in at.contacts.values()])
        missing = physics.required_force(q, v, a, u) - physics.contact_jacobian(q).T @ stacked_rows(force)
        assert np.abs(missing).max() <= 1e-3


def test_a_time_outside_of_the_motion_is_refused(short_plan: Plan) -> None:
    """The sentence names the time and the motion's."""
    with pytest.raises(PlanFileError, match=r"0\.3"):
        short_plan.at(0.3)


def test_at_a_rate_the_samples_are_those_of_the_plan(short_plan: Plan) -> None:
    """A table at 100 Hz has the motion's states at equal times, and its end."""
    archive = np.load(io.BytesIO(exported(short_plan, "npz", rate=100.0)))
    assert np.allclose(np.unique(archive["time"]), np.linspace(0, 0.2, 21), atol=1e-9)
    names = list(short_plan.trajectory.configuration)
    for name, values in zip(names, archive["configuration"].T, strict=True):
        assert values[-1] == pytest.approx(short_plan.trajectory.configuration[name][-1], abs=1e-9)


def test_parquet_is_read_by_arrow(short_plan: Plan) -> None:
    """It has the columns of the CSV file."""
    parquet = pytest.importorskip("pyarrow.parquet")
    table = parquet.read_table(io.BytesIO(exported(short_plan, "parquet")))
    np.testing.assert_allclose(table["time [s]"].to_numpy(), short_plan.trajectory.time)
    np.testing.assert_allclose(table["leg [m]"].to_numpy(), short_plan.trajectory.configuration["leg"])


def test_a_recording_has_joints_transforms_and_wrenches(solo12: Plan) -> None:
    """ROS 2's decoder reads all twelve joints, a transform for every link, and a wrench for each of four feet."""
    reader = pytest.importorskip("mcap.reader")
    decoder = pytest.importorskip("mcap_ros2.decoder")
    recording = reader.make_reader(io.BytesIO(exported(solo12, "mcap")), decoder_factories=[decoder.DecoderFactory()])
    topics: dict[str, list] = {}
    for schema, channel, message, content in recording.iter_decoded_messages():
        topics.setdefault(channel.topic, []).append((schema.name, message.log_time, content))
    by_type = {schema: topic for topic, ((schema, _, _), *_) in topics.items()}
    states = topics[by_type["sensor_msgs/msg/JointState"]]
    assert len(states) == len(solo12.trajectory.time) and len(states[0][2].name) == 12
    knee = list(states[0][2].name).index("FL_KFE")
    assert states[-1][2].position[knee] == pytest.approx(solo12.trajectory.configuration["FL_KFE"][-1])
    frames = {one.child_frame_id for one in topics[by_type["tf2_msgs/msg/TFMessage"]][0][2].transforms}
    assert {"base_link", "FL_FOOT", "HR_FOOT"} <= frames
    wrenches = [topic for topic, messages in topics.items() if messages[0][0] == "geometry_msgs/msg/WrenchStamped"]
    assert len(wrenches) == 4
    last = sum(topics[topic][-1][2].wrench.force.z for topic in wrenches)
    expected = sum(contact.normal_force[-1] for contact in solo12.contacts.values())
    assert last == pytest.approx(expected, abs=1e-6)
    assert "trajectory_msgs/msg/JointTrajectory" in by_type


def test_pinocchio_gets_its_own_order(solo12: Plan) -> None:
    """The archive's q puts the feet of the model file where the plan has contacts on the ground."""
    archive = np.load(io.BytesIO(exported(solo12, "pinocchio")))
    robot = load_robot("example-robot-data:solo12", root="free_flyer")
    model, data = robot.model, robot.model.createData()
    assert archive["q"].shape[1] == model.nq and archive["v"].shape[1] == model.nv
    for q in archive["q"][:: len(archive["q"]) // 5]:
        assert np.linalg.norm(q[3:7]) == pytest.approx(1, abs=1e-9)
    pin.framesForwardKinematics(model, data, archive["q"][0])
    heights = [data.oMf[model.getFrameId(name)].translation[2] for name in ("FL_FOOT", "HR_FOOT")]
    assert max(map(abs, heights)) < 0.03


def test_drakes_segments_are_one_before_and_one_after_an_impact(solo12: Plan) -> None:
    """Breaks increase strictly, samples have a column for each, and a segment begins where the one before ends."""
    content = json.loads(exported(solo12, "drake", suffix=".json"))
    assert len(content["joint_names"]) == 12 and len(content["segments"]) == 1 + len(
        {round(impulse.time, 9) for impulse in solo12.impulses}
    )
    for segment in content["segments"]:
        assert np.all(np.diff(segment["breaks"]) > 0)
        assert np.shape(segment["samples"]) == np.shape(segment["samples_dot"]) == (12, len(segment["breaks"]))
    first, second = content["segments"][:2]
    np.testing.assert_allclose(np.array(first["samples"])[:, -1], np.array(second["samples"])[:, 0], atol=1e-9)


def test_mujoco_finds_the_bodies_where_the_plan_has_them(tmp_path: Path) -> None:
    """qpos and qvel are in the order of MuJoCo's model, and ctrl is the motor's."""
    (tmp_path / "sled.xml").write_text(SLED)
    (tmp_path / "task.yaml").write_text(
        "name: sled\nrobot: {model: sled.xml}\nground: {friction: 0.2}\n"
        "contacts: {runner: {frame: sled, offset: [0, 0, -0.05]}}\nhorizon: {duration: 0.5, intervals: 5}\n"
        "initial: {configuration: {z: 0.05, tilt: 0.4}}\ngoal: {configuration: {x: 0.1}}\n"
    )
    motion = simulate(load_task(tmp_path / "task.yaml"), {"x": [5, -5, 5, 5, 0]})
    archive = np.load(io.BytesIO(exported(motion, "mujoco")))
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "sled.xml"))
    data, trajectory = mujoco.MjData(model), motion.trajectory
    for k in range(0, len(trajectory.time), 7):
        data.qpos[:] = archive["qpos"][k]
        mujoco.mj_kinematics(model, data)
        assert data.body("sled").xpos[[0, 2]] == pytest.approx(
            [trajectory.configuration["x"][k], trajectory.configuration["z"][k]]
        )
        assert data.joint("tilt").qpos[0] == pytest.approx(trajectory.configuration["tilt"][k])
    assert archive["ctrl"][1, 0] == pytest.approx(1.0) and archive["ctrl"][-1, 0] == pytest.approx(0.0, abs=1e-9)


def test_a_missing_package_names_the_line_that_installs_it(short_plan: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the extra the sentence is the pip line."""
    monkeypatch.setattr("fesd_robot.plans.exports.format.find_spec", lambda name: None)
    with pytest.raises(PlanFileError, match=r'pip install "fesd-robot\[mcap\]" adds it'):
        exported(short_plan, "mcap")


def test_another_model_file_is_no_robot_of_mujoco(short_plan: Plan) -> None:
    """A robot of a URDF file has no order of MuJoCo's, and the sentence names the format that any robot has."""
    with pytest.raises(
        FesdRobotError, match=r"found a robot of a URDF file, hopper\.urdf, expected one of a MuJoCo file"
    ):
        exported(short_plan, "mujoco")
