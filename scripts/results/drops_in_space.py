"""Random boxes and quadrupeds dropped in space: no penetration, no energy from nowhere, and impacts by their law.

    python scripts/results/drops_in_space.py                # writes docs/results/drops_in_space.md; 40 minutes

Two hundred boxes (seed 0) of random sides, mass, friction, orientation and velocity, up to 0.3 m above the floor, are
let go and simulated for 0.5 s. Every impact of a single corner is compared with the law worked out here: with the
normal impulse as time, the velocity of the corner obeys an ordinary differential equation, integrated in 20000 steps of
the classical Runge-Kutta method until the approach ends. The first twenty are compared with `moreau_in_space`, steps of
1e-5 s. Fifty postures of Solo12 (seed 1) with four feet, whose joints nothing drives, are let go in the same way.
"""

from __future__ import annotations

import argparse
import itertools
import tempfile
from pathlib import Path

import numpy as np
import pinocchio as pin

from fesd_robot import FesdRobotError, Plan, load_task, simulate
from fesd_robot.robot import load_robot
from scripts.results.moreau_in_space import stepped

REPORT = Path(__file__).resolve().parents[2] / "docs" / "results" / "drops_in_space.md"
DURATION, HIGHEST, STEPS, MOREAU_STEP = 0.5, 0.3, 20000, 1e-5  # s, m, 1, s
TASK = """name: box
robot: {{model: box.urdf, root: free_flyer}}
ground: {{type: plane, friction: {friction}}}
contacts: {{{contacts}}}
horizon: {{duration: {duration}, intervals: 5}}
initial: {{configuration: {{{configuration}}}, velocity: {{{velocity}}}}}
goal: {{configuration: {{}}, soft: true}}
"""
COORDINATES = [f"root_joint.{name}" for name in ("x", "y", "z", "qx", "qy", "qz", "qw")]
RATES = [f"root_joint.{name}" for name in ("vx", "vy", "vz", "wx", "wy", "wz")]


class Box:
    """One random box and how it is let go.

    Args:
        random: source of its numbers.
    """

    def __init__(self, random: np.random.Generator) -> None:
        self.half, self.mass, self.friction = (
            random.uniform(0.04, 0.15, 3),
            random.uniform(0.3, 3),
            random.uniform(0, 1),
        )
        quaternion = random.normal(size=4)
        self.quaternion = quaternion / np.linalg.norm(quaternion)
        self.velocity = np.concatenate([random.uniform(-1, 1, 3), random.uniform(-4, 4, 3)])
        self.corners = np.array(list(itertools.product((-1, 1), repeat=3))) * self.half
        turned = self.corners @ pin.Quaternion(self.quaternion).toRotationMatrix().T
        self.height = random.uniform(0, HIGHEST) - float(turned[:, 2].min())
        squares = self.half**2
        self.inertia = self.mass / 3 * (squares.sum() - squares)

    def task(self, folder: Path) -> Path:
        """Write model and task, and return the task's file."""
        corners = "".join(
            f"<link name='c{n}'/><joint name='c{n}' type='fixed'><parent link='box'/><child link='c{n}'/>"
            f"<origin xyz='{x!r} {y!r} {z!r}'/></joint>"
            for n, (x, y, z) in enumerate(self.corners.tolist())
        )
        ixx, iyy, izz = self.inertia.tolist()
        (folder / "box.urdf").write_text(
            f"<robot name='box'><link name='box'><inertial><mass value='{self.mass!r}'/><inertia ixx='{ixx!r}' "
            f"iyy='{iyy!r}' izz='{izz!r}' ixy='0' ixz='0' iyz='0'/></inertial></link>{corners}</robot>",
            encoding="utf-8",
        )
        places = [0.0, 0.0, self.height, *self.quaternion.tolist()]
        text = TASK.format(
            friction=self.friction,
            duration=DURATION,
            contacts=", ".join(f"c{n}: {{frame: c{n}}}" for n in range(8)),
            configuration=", ".join(f"{name}: {value!r}" for name, value in zip(COORDINATES, places, strict=True)),
            velocity=", ".join(f"{n}: {value!r}" for n, value in zip(RATES, self.velocity.tolist(), strict=True)),
        )
        (folder / "task.yaml").write_text(text, encoding="utf-8")
        return folder / "task.yaml"

    def impulse(self, corner: int, rotation: np.ndarray, twist: np.ndarray) -> np.ndarray | None:
        """Return the impulse of an impact of one corner, N s, in the world, (3); None if it is not worked out.

        Args:
            rotation: of the box, (3, 3).
            twist: its velocity before, in its own axes, (6).
        """
        arm = rotation @ self.corners[corner]
        inverse_inertia = rotation @ np.diag(1 / self.inertia) @ rotation.T
        inverse = np.eye(3) / self.mass - pin.skew(arm) @ inverse_inertia @ pin.skew(arm)
        v = rotation @ twist[:3] + np.cross(rotation @ twist[3:], arm)
        total = np.zeros(3)
        step = -v[2] / (STEPS * inverse[2, 2])
        sticking = False
        for _ in range(100 * STEPS):
            if v[2] >= -1e-14:
                break
            speed = float(np.linalg.norm(v[:2]))
            if sticking or speed < 1e-12:
                rate = np.array([0.0, 0.0, 1.0])
                rate[:2] = -np.linalg.solve(inverse[:2, :2], inverse[:2, 2])
                sticking = bool(np.linalg.norm(rate[:2]) <= self.friction)
                if not sticking:
                    return None  # it begins to slide again, in a direction that is not worked out here
            else:
                rate = self._mean_rate(inverse, v, step)
            slope = inverse @ rate
            taken = min(step, -v[2] / slope[2]) if slope[2] > 0 else step
            slowing = -float(v[:2] @ slope[:2]) / max(speed, 1e-300)
            if not sticking and slowing > 0 and speed / slowing < taken:
                taken = speed / slowing
                v = np.array([0.0, 0.0, (v + taken * slope)[2]])
            else:
                v = v + taken * slope
            total = total + taken * rate
        return total

    def _mean_rate(self, inverse: np.ndarray, v: np.ndarray, step: float) -> np.ndarray:
        """Return impulse by normal impulse in one Runge-Kutta step of a slide."""

        def rate(velocity: np.ndarray) -> np.ndarray:
            along = velocity[:2] / max(float(np.linalg.norm(velocity[:2])), 1e-300)
            return np.array([*(-self.friction * along), 1.0])

        first = rate(v)
        second = rate(v + 0.5 * step * inverse @ first)
        third = rate(v + 0.5 * step * inverse @ second)
        last = rate(v + step * inverse @ third)
        return (first + 2 * second + 2 * third + last) / 6


class Quadruped:
    """Postures of Solo12 and how it is let go.

    Args:
        random: source of numbers.
    """

    def __init__(self, random: np.random.Generator) -> None:
        self._random, self._robot = random, load_robot("example-robot-data:solo12", root="free_flyer")

    def task(self, folder: Path) -> Path:
        """Write the task of another posture, and return its file."""
        model, random = self._robot.model, self._random
        data, q = model.createData(), pin.neutral(model)
        q[3:7] = pin.Quaternion(pin.rpy.rpyToMatrix(random.uniform(-0.5, 0.5, 3))).coeffs()
        q[7:] = np.tile([0, 0.7, -1.4], 4) + random.uniform(-0.4, 0.4, 12)
        velocity = np.concatenate([random.uniform(-1, 1, 3), random.uniform(-2, 2, 3)])
        pin.framesForwardKinematics(model, data, q)
        feet = [f"{leg}_FOOT" for leg in ("FL", "FR", "HL", "HR")]
        q[2] = random.uniform(0, HIGHEST) - min(data.oMf[model.getFrameId(foot)].translation[2] for foot in feet)
        names = self._robot.configuration_names
        text = TASK.replace("box.urdf", "example-robot-data:solo12").format(
            friction=random.uniform(0.2, 1),
            duration=DURATION,
            contacts=", ".join(f"{foot[:2]}: {{frame: {foot}}}" for foot in feet),
            configuration=", ".join(f"{name}: {value!r}" for name, value in zip(names, q.tolist(), strict=True)),
            velocity=", ".join(f"{n}: {value!r}" for n, value in zip(RATES, velocity.tolist(), strict=True)),
        )
        (folder / "task.yaml").write_text(text, encoding="utf-8")
        return folder / "task.yaml"

    def energies(self, plan: Plan) -> np.ndarray:
        """Return kinetic and potential energy at every sample, J."""
        model, data = self._robot.model, self._robot.model.createData()
        motion = plan.trajectory
        states = (np.column_stack(list(values.values())) for values in (motion.configuration, motion.velocity))
        return np.array([pin.computeMechanicalEnergy(model, data, q, v) for q, v in zip(*states, strict=True)])


def distance_from_steps(box: Box, plan: Plan) -> float:
    """Return how far a corner is at the end from where Moreau's steps take it, m."""
    start = np.array([0.0, 0.0, box.height])
    x, turn = stepped(box, start, box.quaternion, box.velocity, DURATION, MOREAU_STEP)
    end = np.array([plan.trajectory.configuration[name][-1] for name in COORDINATES])
    turned = pin.Quaternion(end[3:] / np.linalg.norm(end[3:])).toRotationMatrix()
    off = x + box.corners @ turn.T - end[:3] - box.corners @ turned.T
    return float(np.linalg.norm(off, axis=1).max())


def energies(box: Box, plan: Plan) -> np.ndarray:
    """Return kinetic and potential energy at every sample, J."""
    motion = plan.trajectory
    twist = np.column_stack([motion.velocity[name] for name in RATES])
    kinetic = 0.5 * (box.mass * (twist[:, :3] ** 2).sum(axis=1) + twist[:, 3:] ** 2 @ box.inertia)
    return np.asarray(kinetic + box.mass * 9.81 * motion.configuration["root_joint.z"])


def impact_error(box: Box, plan: Plan) -> float:
    """Return by how much impacts of single corners are off their law, as a ratio of the normal impulse."""
    motion, worst = plan.trajectory, 0.0
    for one in plan.impulses[:2]:
        if sum(abs(other.time - one.time) < 1e-9 for other in plan.impulses) > 1 or one.normal < 1e-2 * box.mass:
            continue
        at = int(np.searchsorted(motion.time, one.time - 1e-12))
        quaternion = np.array([motion.configuration[name][at] for name in COORDINATES[3:]])
        twist = np.array([motion.velocity[name][at] for name in RATES])
        rotation = pin.Quaternion(quaternion).toRotationMatrix()
        touching = {name for name, contact in plan.contacts.items() if contact.gap[at] < 1e-8}
        if touching != {one.contact}:
            continue
        expected = box.impulse(int(one.contact[1:]), rotation, twist)
        if expected is None:
            continue
        found = np.array([one.tangential, one.lateral, one.normal])
        worst = max(worst, float(np.abs(found - expected).max()) / one.normal)
    return worst


class Drops:
    """What bodies of one kind do that are let go one after the other.

    Args:
        kind: what a line calls one of them.
    """

    def __init__(self, kind: str) -> None:
        self._kind, self.count, self.notes = kind, 0, 0
        self.failures, self.gaps, self.gains = list[str](), [0.0], [0.0]

    def simulated(self, task: Path) -> Plan | None:
        """Return the motion of the next one, None if it ends with an error."""
        self.count += 1
        try:
            plan = simulate(load_task(task))
        except FesdRobotError as error:
            self.failures.append(f"- {self._kind} {self.count - 1}: {error}")
            print(self.failures[-1], flush=True)
            return None
        self.gaps.append(min(float(contact.gap.min()) for contact in plan.contacts.values()))
        self.notes += "not the only motion" in plan.status.message
        return plan

    def rated(self, energy: np.ndarray) -> None:
        """Note by how much the energy of the last one rises, (n) samples, and say what was found."""
        self.gains.append(float(np.diff(energy).max(initial=0.0)) / abs(energy[0]))
        print(f"{self._kind} {self.count - 1} {self.gaps[-1]:.0e} {self.gains[-1]:.0e}", flush=True)

    def rows(self, part: str) -> list[str]:
        """Return the rows of a table that all kinds have, `part` being what may be below the floor."""
        gain = max(self.gains)
        return [
            "| property | found |",
            "|---|---|",
            f"| finished | {self.count - len(self.failures)} of {self.count} |",
            f"| deepest {part} below the floor, m | {-min(self.gaps):.1e} |",
            f"| largest rise of the energy from one sample to the next, as a ratio of the first | {gain:.1e} |",
            f"| motions that are not the only ones, and say so | {self.notes} |",
        ]


def quadrupeds(count: int) -> list[str]:
    """Return what postures of Solo12 do that are dropped, as lines of the table's page."""
    quadruped, drops = Quadruped(np.random.default_rng(1)), Drops("posture")
    with tempfile.TemporaryDirectory() as name:
        for _ in range(count):
            plan = drops.simulated(quadruped.task(Path(name)))
            if plan is not None:
                drops.rated(quadruped.energies(plan))
    return [
        "",
        "## Solo12",
        f"{count} postures (seed 1) with four feet, whose joints nothing drives, damps or stops.",
        "",
        *drops.rows("foot"),
        "",
        *drops.failures,
    ]


def main() -> None:
    """Simulate, compare and write the table."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--boxes", type=int, default=200)
    arguments.add_argument("--quadrupeds", type=int, default=50)
    arguments.add_argument("--compared", type=int, default=20)
    given = arguments.parse_args()
    boxes = given.boxes
    random, drops = np.random.default_rng(0), Drops("box")
    laws, apart, impacts = list[float](), list[float](), 0
    with tempfile.TemporaryDirectory() as name:
        for number in range(boxes):
            box = Box(random)
            plan = drops.simulated(box.task(Path(name)))
            if plan is None:
                continue
            drops.rated(energies(box, plan))
            laws.append(impact_error(box, plan))
            impacts += len(plan.impulses)
            if number < given.compared:
                apart.append(distance_from_steps(box, plan))
                print(f"{number} {apart[-1]:.1e} m from Moreau's steps", flush=True)
    lines = [
        "# Boxes dropped in space",
        "",
        f"Written by `scripts/results/drops_in_space.py`: {boxes} random boxes (seed 0), eight corners each, "
        "dropped from up",
        "to 0.3 m and simulated for 0.5 s.",
        "",
        *drops.rows("corner"),
        f"| impulses in all | {impacts} |",
        f"| impacts of single corners off the law, as a ratio of the normal impulse: median, worst "
        f"| {np.median(laws):.1e}, {max(laws):.1e} |",
        f"| a corner off Moreau's steps of {MOREAU_STEP:g} s, m: median and worst of {len(apart)}, below 1e-3 "
        f"| {np.median(apart):.1e}, {max(apart):.1e}, {sum(one < 1e-3 for one in apart)} |",
        "",
        "Two corners that hit within microseconds are one impact or two, which leads to different motions: the steps",
        "take another order than the simulation does, and other lengths of the steps yet another one.",
        "",
        *drops.failures,
        *quadrupeds(given.quadrupeds),
    ]
    REPORT.write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
