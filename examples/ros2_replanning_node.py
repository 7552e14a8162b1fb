"""A ROS 2 node that drives a robot along a plan, and solves the rest of the plan again while it moves.

    ros2 run PACKAGE ros2_replanning_node --ros-args -p plan:=runs/solo12_jump -p period:=0.01
    ros2 service call /replanning/start std_srvs/srv/Trigger

It listens to ``joint_states``, ``odom`` (twists in the frame of the body, as Odometry says) and ``contacts`` (an entry
a contact, in the order of the task, 1 where it touches), and once it is started publishes efforts on
``effort_controller/commands`` every millisecond, in the order of the plan's controls. With ``-p trajectory:=true`` it
publishes every new motion on ``joint_trajectory_controller/joint_trajectory`` instead, with ``-p effort:=true`` also
the efforts, which that controller refuses where it commands none.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import rclpy
from builtin_interfaces.msg import Duration
from nav_msgs.msg import Odometry
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, UInt8MultiArray
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from fesd_robot import Plan, Replanner, read_plan
from fesd_robot.ocp import MotionProblem
from fesd_robot.replanning import Policy

State = tuple[np.ndarray, np.ndarray]
"""q, (n_q), and v, (n_v), in Pinocchio's order."""


def state_of(motion: MotionProblem, joints: JointState, odometry: Odometry | None) -> State:
    """Return q and v: joints by their names, the root by the last part of its names, as x, qw, pitch or vx."""
    places = dict(zip(joints.name, joints.position, strict=True))
    speeds = dict(zip(joints.name, joints.velocity, strict=True))
    if odometry is not None:
        at, turn = odometry.pose.pose.position, odometry.pose.pose.orientation
        linear, angular = odometry.twist.twist.linear, odometry.twist.twist.angular
        pitch = 2.0 * float(np.arctan2(turn.y, turn.w))
        cosine, sine = np.cos(pitch), np.sin(pitch)
        places |= {"x": at.x, "y": at.y, "z": at.z, "pitch": pitch}
        places |= {"qx": turn.x, "qy": turn.y, "qz": turn.z, "qw": turn.w}
        speeds |= {"vx": linear.x, "vy": linear.y, "vz": linear.z, "wx": angular.x, "wy": angular.y, "wz": angular.z}
        # A root in the plane has velocities along the axes of the world.
        speeds |= {"x": cosine * linear.x + sine * linear.z, "z": cosine * linear.z - sine * linear.x}
        speeds["pitch"] = angular.y

    def named(names: list[str], values: dict[str, float]) -> np.ndarray:
        return np.array([values[name] if name in values else values[_last_part(name)] for name in names], dtype=float)

    return named(motion.robot.configuration_names, places), named(motion.robot.velocity_names, speeds)


def _last_part(name: str) -> str:
    return name.replace("_", ".").rpartition(".")[2]


@dataclass(frozen=True)
class TrajectoryFields:
    """The fields of a trajectory_msgs/JointTrajectory: s from its start, m or rad, N or N m, (points, joints)."""

    names: list[str]
    times: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    efforts: np.ndarray


def joint_trajectory(motion: MotionProblem, what: Plan | Policy, times: np.ndarray) -> TrajectoryFields:
    """Return joints with one coordinate, but for those of the root, along a plan or a policy.

    Args:
        motion: of the plan.
        what: the plan, or the policy from now on.
        times: since the start of the plan, s, increasing.
    """
    robot, rows = motion.robot, []
    names = [name for name in robot.configuration_names if name in set(robot.velocity_names) - set(robot.root_names)]
    for time in times:
        if isinstance(what, Policy):
            q, v = what.reference(time)
            u = what.action(time, q, v)
        else:
            at = what.at(min(time, what.trajectory.time[-1]))
            q = np.array([at.configuration[name] for name in robot.configuration_names])
            v = np.array([at.velocity[name] for name in robot.velocity_names])
            u = np.array([at.controls[name] for name in motion.actuation.names])
        rows.append((q, v, motion.actuation.numeric(q) @ u))
    q, v, force = (np.array(column) for column in zip(*rows, strict=True))
    places = [robot.configuration_names.index(name) for name in names]
    speeds = [robot.velocity_names.index(name) for name in names]
    return TrajectoryFields(names, times - times[0], q[:, places], v[:, speeds], force[:, speeds])


class ReplanningNode(Node):
    """Replans in one timer, and controls in another one, which goes on meanwhile with the last policy."""

    def __init__(self) -> None:
        super().__init__("replanning")
        plan = read_plan(self.declare_parameter("plan", "").value)
        period = self.declare_parameter("period", 0.01).value
        self.sends_trajectories = self.declare_parameter("trajectory", False).value
        self.sends_efforts = self.declare_parameter("effort", False).value
        self.replanner, self.end = Replanner(plan, period=period), float(plan.trajectory.time[-1])
        self.joints: JointState | None = None
        self.odometry: Odometry | None = None
        self.contacts: np.ndarray | None = None
        self.policy: Policy | None = None
        self.start: float | None = None
        self.create_subscription(JointState, "joint_states", lambda message: setattr(self, "joints", message), 1)
        self.create_subscription(Odometry, "odom", lambda message: setattr(self, "odometry", message), 1)
        self.create_subscription(UInt8MultiArray, "contacts", self.touch, 1)
        self.efforts = self.create_publisher(Float64MultiArray, "effort_controller/commands", 1)
        self.motions = self.create_publisher(JointTrajectory, "joint_trajectory_controller/joint_trajectory", 1)
        self.create_service(Trigger, "~/start", self.begin)
        self.create_timer(period, self.replan, callback_group=MutuallyExclusiveCallbackGroup())
        self.create_timer(1e-3, self.control, callback_group=MutuallyExclusiveCallbackGroup())

    def touch(self, message: UInt8MultiArray) -> None:
        """Keep which contacts touch."""
        self.contacts = np.array(list(message.data), dtype=bool)

    def begin(self, request: Any, response: Any) -> Any:
        """Let the plan begin now."""
        response.success, response.message = self.joints is not None, "found no joint_states, expected them first"
        if self.joints is not None:
            try:
                state_of(self.replanner.motion, self.joints, self.odometry)
                self.start, response.message = self.now(), "begins"
            except KeyError as missing:
                response.success, response.message = False, f"found no {missing}, expected it in joint_states or odom"
        return response

    def now(self) -> float:
        """Return the time of the node's clock, s."""
        return float(self.get_clock().now().nanoseconds) * 1e-9

    def measured(self) -> tuple[float, State]:
        """Return the time since the start, s, and the state."""
        assert self.start is not None and self.joints is not None
        return self.now() - self.start, state_of(self.replanner.motion, self.joints, self.odometry)

    def replan(self) -> None:
        """Solve the rest of the plan again from where the robot is, then prepare for the next measurement."""
        if self.start is None:
            return
        time, (q, v) = self.measured()
        if time > self.end:
            return
        self.policy = self.replanner.update(time, q, v, self.contacts)
        if self.policy.status == "old":
            self.get_logger().warning(f"at {time:.3f} s the earlier motion goes on: {self.policy.reason}")
        if self.sends_trajectories:
            self.motions.publish(self.message(self.policy, time))
        self.replanner.prepare()

    def control(self) -> None:
        """Publish the controls of the last policy for the state as it is now."""
        if self.policy is not None and not self.sends_trajectories:
            time, (q, v) = self.measured()
            self.efforts.publish(Float64MultiArray(data=self.policy.action(time, q, v, self.contacts).tolist()))

    def message(self, policy: Policy, time: float) -> JointTrajectory:
        """Return the motion from now to the end of the plan; at its end, the robot rests."""
        times = np.append(np.arange(time, self.end, self.replanner.period), self.end + 1e-3)
        fields = joint_trajectory(self.replanner.motion, policy, times)
        message = JointTrajectory(joint_names=fields.names)  # its stamp is zero: it begins when it arrives
        for when, *values in zip(fields.times, fields.positions, fields.velocities, fields.efforts, strict=True):
            seconds, rest = divmod(round(when * 1e9), 1_000_000_000)
            places, speeds, forces = (each.tolist() for each in values)
            forces = forces if self.sends_efforts else []
            after = Duration(sec=seconds, nanosec=rest)
            point = JointTrajectoryPoint(positions=places, velocities=speeds, effort=forces, time_from_start=after)
            message.points.append(point)
        return message


def main() -> None:
    """Run the node until it is interrupted; replanning and control have a thread each."""
    rclpy.init()
    executor = MultiThreadedExecutor(num_threads=3)
    executor.add_node(ReplanningNode())
    executor.spin()


if __name__ == "__main__":
    main()
