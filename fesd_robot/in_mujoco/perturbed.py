"""Twenty runs that differ from the plan in one thing each."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fesd_robot.in_mujoco.driving import Disturbance, Noise
from fesd_robot.robot import Robot, velocity_units

MASS, FRICTION, DELAY = 0.1, 0.2, 5e-3
"""Share of all masses, share of all friction coefficients, s."""

LENGTH, ANGLE = 0.01, float(np.radians(2.0))
"""m, rad; by which the start is off."""

LESS = 0.1
"""Share of it by which all of them are off at the start, each in another direction."""

REPETITIONS = 4


@dataclass(frozen=True)
class Perturbation:
    """What is different from the plan in a run.

    Attributes:
        what: in words.
        mass, friction: factors of the scene.
        disturbance: of the run.
    """

    what: str = "as planned"
    mass: float = 1.0
    friction: float = 1.0
    disturbance: Disturbance = field(default_factory=Disturbance)

    def beside(self, other: Perturbation) -> Perturbation:
        """Return this one and another one at once: factors multiply, pushes add up, what only one can be is this one's.

        Args:
            other: what is different, too.
        """
        own, further = self.disturbance, other.disturbance
        disturbance = Disturbance(
            further.offset if own.offset is None else own.offset,
            own.delay or further.delay,
            own.noise or further.noise,
            (*own.pushes, *further.pushes),
        )
        return Perturbation(self.what, self.mass * other.mass, self.friction * other.friction, disturbance)


def perturbations(robot: Robot) -> list[Perturbation]:
    """Return the twenty runs: five kinds, each four times.

    Masses 10 % more and less in turn; friction 20 % less; controls 5 ms late; the start off by 1 cm and 2 degrees;
    noise of the sensors. Every run, number n, begins off in a direction that is drawn with the seed n, by a tenth of
    that where the start is not what differs.
    """
    result = []
    for number in range(5 * REPETITIONS):
        kind, repetition = divmod(number, REPETITIONS)
        mass = 1 + MASS * (1 - 2 * (repetition % 2)) if kind == 0 else 1.0
        friction = 1 - FRICTION if kind == 1 else 1.0
        off = offset(robot, number, 1.0 if kind == 3 else LESS)
        noise = Noise(number) if kind == 4 else None
        words = (
            f"mass {100 * (mass - 1):+.0f} %",
            f"friction -{100 * FRICTION:.0f} %",
            f"{1e3 * DELAY:g} ms late",
            f"start off by {100 * LENGTH:g} cm and {np.degrees(ANGLE):.0f} degrees",
            "sensor noise",
        )[kind]
        disturbance = Disturbance(off, DELAY if kind == 2 else 0.0, noise)
        result.append(Perturbation(words, mass, friction, disturbance))
    return result


def offset(robot: Robot, seed: int, share: float) -> np.ndarray:
    """Return a displacement of the start in a random direction, m and rad, (n_v).

    The root of the robot is moved, of a robot without one its joints: lengths by 1 cm, angles by 2 degrees, each as the
    norm of all of them. Free bodies stay where they are.

    Args:
        robot: of the plan.
        seed: of the direction.
        share: of these displacements.
    """
    units = velocity_units(robot)
    joints = [name for name in robot.velocity_names if robot.body_of(name) is None]
    moved = [name for name in robot.root_names if robot.body_of(name) is None] or joints
    direction = np.random.default_rng(seed).standard_normal(len(robot.velocity_names))
    result = np.zeros(len(direction))
    for unit, size in (("m/s", LENGTH), ("rad/s", ANGLE)):
        rows = [k for k, name in enumerate(robot.velocity_names) if name in moved and units[name] == unit]
        if rows:
            result[rows] = share * size * direction[rows] / np.linalg.norm(direction[rows])
    return result
