"""The ROS 2 node of examples/, with stand-ins for ROS 2's classes."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fesd_robot.in_mujoco import Deviation, mujoco_scene, run
from fesd_robot.ocp import formulate
from fesd_robot.plans import Plan, task_of, write_plan

ROOT = Path(__file__).parents[2]


class Message(SimpleNamespace):
    """A message with the fields that it is made with; points are a list."""

    def __init__(self, **fields: Any) -> None:
        super().__init__(**{"points": [], **fields})


class Node:
    """Keeps what a node makes, and has a clock that a test sets."""

    parameters: dict[str, Any] = {}  # noqa: RUF012
    seconds = 100.0

    def __init__(self, name: str) -> None:
        self.timers: list[tuple[float, Any]] = []
        self.listens: dict[str, Any] = {}
        self.sent: dict[str, list[Any]] = {}
        self.warnings: list[str] = []

    def declare_parameter(self, name: str, default: Any) -> Any:
        return SimpleNamespace(value=self.parameters.get(name, default))

    def create_subscription(self, kind: type, topic: str, callback: Any, depth: int) -> None:
        self.listens[topic] = callback

    def create_publisher(self, kind: type, topic: str, depth: int) -> Any:
        return SimpleNamespace(publish=self.sent.setdefault(topic, []).append)

    def create_service(self, kind: type, name: str, callback: Any) -> None:
        self.listens[name] = callback

    def create_timer(self, period: float, callback: Any, callback_group: Any) -> None:
        self.timers.append((period, callback))

    def get_clock(self) -> Any:
        return SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=round(self.seconds * 1e9)))

    def get_logger(self) -> Any:
        return SimpleNamespace(warning=self.warnings.append)


@pytest.fixture(scope="module")
def example() -> Any:
    """The module of the example, with stand-ins for the packages of ROS 2."""
    names = {
        "rclpy": [], "rclpy.callback_groups": ["MutuallyExclusiveCallbackGroup"],
        "rclpy.executors": ["MultiThreadedExecutor"], "rclpy.node": ["Node"], "builtin_interfaces.msg": ["Duration"],
        "nav_msgs.msg": ["Odometry"], "sensor_msgs.msg": ["JointState"],
        "std_msgs.msg": ["Float64MultiArray", "UInt8MultiArray"], "std_srvs.srv": ["Trigger"],
        "trajectory_msgs.msg": ["JointTrajectory", "JointTrajectoryPoint"],
    }  # fmt: skip
    with pytest.MonkeyPatch.context() as patched:
        for module, classes in names.items():
            for part in (module.partition(".")[0], module):
                if part not in sys.modules:
                    patched.setitem(sys.modules, part, ModuleType(part))
            for each in classes:
                setattr(sys.modules[module], each, Node if each == "Node" else Message)
        specification = importlib.util.spec_from_file_location("ros2_node", ROOT / "examples/ros2_replanning_node.py")
        assert specification and specification.loader
        loaded = importlib.util.module_from_spec(specification)
        patched.setitem(sys.modules, "ros2_node", loaded)
        specification.loader.exec_module(loaded)
        yield loaded


@pytest.fixture
def node(example: Any, jump: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """A node of the jump, which sends efforts."""
    monkeypatch.setattr(Node, "parameters", {"plan": str(write_plan(jump, tmp_path / "jump")), "period": 0.01})
    return example.ReplanningNode()


def messages(motion: Any, q: np.ndarray, v: np.ndarray) -> tuple[Message, Message]:
    """Return what a robot with a root in the plane says of its state: joints, and the root in its own frame."""
    place, speed = (
        dict(zip(motion.robot.configuration_names, q, strict=True)),
        dict(zip(motion.robot.velocity_names, v, strict=True)),
    )
    cosine, sine = np.cos(place["root_pitch"]), np.sin(place["root_pitch"])
    half = 0.5 * place["root_pitch"]
    turn = Message(x=0.0, y=np.sin(half), z=0.0, w=np.cos(half))
    linear = Message(
        x=cosine * speed["root_x"] - sine * speed["root_z"], y=0.0, z=sine * speed["root_x"] + cosine * speed["root_z"]
    )
    odometry = Message(
        pose=Message(pose=Message(position=Message(x=place["root_x"], y=0.0, z=place["root_z"]), orientation=turn)),
        twist=Message(twist=Message(linear=linear, angular=Message(x=0.0, y=speed["root_pitch"], z=0.0))),
    )
    return Message(name=["leg"], position=[place["leg"]], velocity=[speed["leg"]]), odometry


def test_states_come_from_messages(example: Any, jump: Plan) -> None:
    """Joints by name, a root in the plane with its velocities turned to the axes of the world; in space as it is."""
    motion = formulate(task_of(jump))
    q, v = np.array([0.1, 0.6, 0.4, 0.45]), np.array([1.0, -0.5, 0.3, 0.2])
    for found, wanted in zip(example.state_of(motion, *messages(motion, q, v)), (q, v), strict=True):
        assert found == pytest.approx(wanted)
    joints = Message(name=["knee"], position=[0.7], velocity=[-0.1])
    angular, linear, turn = (Message(x=x, y=x + 0.1, z=x + 0.2, w=0.9) for x in (1.0, 2.0, 0.3))
    odometry = Message(
        pose=Message(pose=Message(position=linear, orientation=turn)),
        twist=Message(twist=Message(linear=linear, angular=angular)),
    )
    parts = [f"root_joint.{each}" for each in ("x", "y", "z", "qx", "qy", "qz", "qw")]
    speeds = [f"root_joint.{each}" for each in ("vx", "vy", "vz", "wx", "wy", "wz")]
    robot = SimpleNamespace(configuration_names=[*parts, "knee"], velocity_names=[*speeds, "knee"])
    q, v = example.state_of(SimpleNamespace(robot=robot), joints, odometry)
    assert q == pytest.approx([2.0, 2.1, 2.2, 0.3, 0.4, 0.5, 0.9, 0.7])
    assert v == pytest.approx([2.0, 2.1, 2.2, 1.0, 1.1, 1.2, -0.1])


class Driven:
    """Lets a node drive a robot in MuJoCo, by messages."""

    def __init__(self, node: Any) -> None:
        self.node, self.started = node, False

    def action(self, time: float, q: np.ndarray, v: np.ndarray, contacts: np.ndarray) -> Any:
        node, motion = self.node, self.node.replanner.motion
        joints, odometry = messages(motion, q, v)
        node.listens["joint_states"](joints)
        node.listens["odom"](odometry)
        node.listens["contacts"](Message(data=contacts.astype(np.uint8).tolist()))
        node.seconds = 100.0 + time
        if not self.started:
            self.started = node.listens["~/start"](None, Message()).success
        (_, replan), (_, control) = node.timers
        if round(1e3 * time) % 10 == 0:
            replan()
        control()
        return node.sent["effort_controller/commands"][-1].data


def test_the_node_drives_the_jump(node: Any, jump: Plan) -> None:
    """Nothing is sent before the start, which waits for a state; then the jump ends at its goal in MuJoCo."""
    for _, callback in node.timers:
        callback()
    assert node.sent["effort_controller/commands"] == []
    answer = node.listens["~/start"](None, Message())
    assert not answer.success and answer.message == "found no joint_states, expected them first"
    node.listens["joint_states"](Message(name=["leg"], position=[0.5], velocity=[0.0]))
    answer = node.listens["~/start"](None, Message())
    assert not answer.success and answer.message == "found no 'x', expected it in joint_states or odom"
    scene = mujoco_scene(formulate(task_of(jump), driven=False))
    assert Deviation(scene, jump, run(scene, jump, Driven(node))).finished


def test_a_joint_trajectory(node: Any, example: Any, jump: Plan) -> None:
    """Plan and policy from its start say the same; a message begins now and ends at rest."""
    motion = node.replanner.motion
    first = jump.at(0.0)
    q = np.array([first.configuration[name] for name in motion.robot.configuration_names])
    v = np.array([first.velocity[name] for name in motion.robot.velocity_names])
    policy = node.replanner.update(0.0, q, v)
    times = np.arange(0.0, 0.1, 0.01)
    planned, replanned = (example.joint_trajectory(motion, each, times) for each in (jump, policy))
    assert planned.names == replanned.names == ["root_x", "root_z", "root_pitch", "leg"]
    assert replanned.positions == pytest.approx(planned.positions, abs=5e-3)
    assert replanned.efforts.shape == planned.efforts.shape == (10, 4)
    message = node.message(policy, 0.25)
    assert message.joint_names == planned.names
    first_point, last = message.points[0], message.points[-1]
    assert (first_point.time_from_start.sec, first_point.time_from_start.nanosec) == (0, 0)
    seconds = last.time_from_start.sec + 1e-9 * last.time_from_start.nanosec
    assert seconds == pytest.approx(jump.trajectory.time[-1] - 0.25 + 1e-3)
    assert last.velocities == [0.0] * 4 and last.effort == []
    node.sends_efforts = True
    assert len(node.message(policy, 0.25).points[0].effort) == 4
