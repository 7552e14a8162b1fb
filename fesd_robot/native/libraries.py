"""The libraries that every plan needs, compiled while the robot is read."""

from __future__ import annotations

from fesd_robot.native.compiler import begin
from fesd_robot.native.linear_solver import build_library
from fesd_robot.native.nlp_compiler import build_loop


def begin_building() -> None:
    """Compile the linear solver and the loop over copies where the cache has none; who needs them meanwhile waits."""
    begin(build_library)
    begin(build_loop)
