"""The motors of a task in a scene."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca
import mujoco
import numpy as np

from fesd_robot.in_mujoco.coordinates import Coordinates
from fesd_robot.ocp import Actuation, MotionProblem


class Motors:
    """The controls of a plan in a scene, by their names.

    A control that pushes one joint is a motor with its factor as gear, one that pushes several a motor of a tendon with
    the factors as coefficients. One whose directions depend on the configuration, or that pushes a joint with several
    degrees of freedom, is no motor of the scene: its forces are applied to the joints.

    Args:
        spec: the scene.
        motion: the task, formulated.

    Attributes:
        names, lower, upper: of all controls, and their limits, N or N m.
        note: which of them are applied to the joints, empty if none is.
    """

    def __init__(self, spec: mujoco.MjSpec, motion: MotionProblem) -> None:
        drive = motion.actuation
        self.names, self.lower, self.upper = list(drive.names), drive.lower, drive.upper
        single = {
            link.v_indices.start: link.name
            for link in motion.robot.tree.links
            if not link.mimics and len(link.joint.velocity_suffixes) == 1
        }
        self._matrix = drive.numeric
        constant, changing = self._matrix(motion.robot.neutral), _changing(drive)
        self._motors: list[int] = []
        for k, name in enumerate(self.names):
            rows = np.flatnonzero(constant[:, k])
            if not changing[k] and all(row in single for row in rows):
                factors = {single[row]: float(constant[row, k]) for row in rows}
                _add_motor(spec, name, factors, (float(self.lower[k]), float(self.upper[k])))
                self._motors.append(k)
        self._applied = [k for k in range(len(self.names)) if k not in self._motors]
        applied = ", ".join(self.names[k] for k in self._applied)
        self.note = f"no motor of MuJoCo pushes as {applied}; its forces are applied to the joints" if applied else ""

    def drive(self, data: mujoco.MjData, coordinates: Coordinates, control: np.ndarray) -> None:
        """Let the controls, (n_u), act in the next time step."""
        data.ctrl[:] = control[self._motors]
        if self._applied:
            q, _ = coordinates.to_plan(data.qpos, data.qvel)
            generalized = self._matrix(q)[:, self._applied] @ control[self._applied]
            data.qfrc_applied[:] = coordinates.force(q, generalized)


def _changing(drive: Actuation) -> list[bool]:
    """Return of every control whether its directions depend on the configuration."""
    q = ca.SX.sym("q", drive.matrix.size1_in(0))
    return [ca.depends_on(column, q) for column in ca.horzsplit(drive.matrix(q))]


def _add_motor(spec: mujoco.MjSpec, name: str, factors: Mapping[str, float], limits: tuple[float, float]) -> None:
    (first, gear), *more = factors.items()
    kind = mujoco.mjtTrn.mjTRN_JOINT
    if more:
        tendon = spec.add_tendon(name=name)
        for joint, factor in factors.items():
            tendon.wrap_joint(joint, factor)
        kind, first, gear = mujoco.mjtTrn.mjTRN_TENDON, name, 1.0
    motor = spec.add_actuator(
        name=name,
        trntype=kind,
        target=first,
        ctrllimited=mujoco.mjtLimited.mjLIMITED_TRUE,
        ctrlrange=limits,
        gear=[gear, 0, 0, 0, 0, 0],
    )
    motor.set_to_motor()
