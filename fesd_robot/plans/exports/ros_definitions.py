"""ROS 2 message definitions with all that they depend on, as a recorder writes them into a file."""

from __future__ import annotations

_TIME = ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n")
_DURATION = ("builtin_interfaces/Duration", "int32 sec\nuint32 nanosec\n")
_HEADER = ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n")
_VECTOR = ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n")
_QUATERNION = ("geometry_msgs/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n")
_TRANSFORM = ("geometry_msgs/Transform", "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n")
_TRANSFORM_STAMPED = (
    "geometry_msgs/TransformStamped",
    "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
)
_WRENCH = ("geometry_msgs/Wrench", "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n")
_POINT = (
    "trajectory_msgs/JointTrajectoryPoint",
    "float64[] positions\nfloat64[] velocities\nfloat64[] accelerations\nfloat64[] effort\n"
    "builtin_interfaces/Duration time_from_start\n",
)


_LAYOUT = ("std_msgs/MultiArrayLayout", "std_msgs/MultiArrayDimension[] dim\nuint32 data_offset\n")
_DIMENSION = ("std_msgs/MultiArrayDimension", "string label\nuint32 size\nuint32 stride\n")


def _definition(own: str, *others: tuple[str, str]) -> str:
    return own + "".join(f"{'=' * 80}\nMSG: {name}\n{text}" for name, text in others)


DEFINITIONS = {
    "sensor_msgs/msg/JointState": _definition(
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n",
        _HEADER,
        _TIME,
    ),
    "trajectory_msgs/msg/JointTrajectory": _definition(
        "std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/JointTrajectoryPoint[] points\n",
        _HEADER,
        _TIME,
        _POINT,
        _DURATION,
    ),
    "std_msgs/msg/Float64MultiArray": _definition(
        "std_msgs/MultiArrayLayout layout\nfloat64[] data\n", _LAYOUT, _DIMENSION
    ),
    "tf2_msgs/msg/TFMessage": _definition(
        "geometry_msgs/TransformStamped[] transforms\n",
        _TRANSFORM_STAMPED,
        _HEADER,
        _TIME,
        _TRANSFORM,
        _VECTOR,
        _QUATERNION,
    ),
    "geometry_msgs/msg/WrenchStamped": _definition(
        "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n", _HEADER, _TIME, _WRENCH, _VECTOR
    ),
}
"""Name of a message -> its definition, and behind it those of its parts."""
