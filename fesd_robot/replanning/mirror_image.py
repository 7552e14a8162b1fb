"""The image of a gait that changes left and right: of states, controls, contacts and finite elements."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fesd_robot.complementarity import Branch, Label
from fesd_robot.errors import PlanFileError
from fesd_robot.fesd import AddedRows, Element
from fesd_robot.fesd.element import SystemFunctions
from fesd_robot.fesd.polishing import BranchMotion
from fesd_robot.ocp import MotionProblem, contact_images, mirrored

SAME = 1e-9
"""Difference of controls' directions up to which they are each other's image."""


@dataclass(frozen=True)
class MirrorImage:
    """What changes places when a gait goes on as its own mirror image; nothing does without a mirror.

    The image of values y is ``signs * y[sources]``.

    Attributes:
        states, controls, velocities: sources and signs of x, (n_x), of the system's controls, (n_u), and of v, (n_v).
        algebraic: sources of z, (n_z); -1 for products of other ones.
        contacts: sources of contacts, (n_c).
        names: of contacts and coordinates -> those whose place they take.
    """

    states: tuple[np.ndarray, np.ndarray]
    controls: tuple[np.ndarray, np.ndarray]
    velocities: tuple[np.ndarray, np.ndarray]
    algebraic: np.ndarray
    contacts: np.ndarray
    names: Mapping[str, str]

    @classmethod
    def of(cls, motion: MotionProblem) -> MirrorImage:
        """Return the image that the periodic goal of a task says.

        Raises:
            PlanFileError: a mirror that is none of the robot's contacts or motors.
        """
        task, robot, system = motion.task, motion.robot, motion.ocp.system
        q, v = (_signed(mirrored(task, each, np.arange(1.0, 1 + len(each))))
                for each in (robot.configuration_names, robot.velocity_names))  # fmt: skip
        contacts = _contacts(motion)
        of_controls = _controls(motion, v)
        names = {robot.configuration_names[i]: robot.configuration_names[k] for i, k in enumerate(q[0])}
        names |= {motion.contacts[i].name: motion.contacts[k].name for i, k in enumerate(contacts)}
        begin = len(q[0]) + len(v[0])
        behind = [_renamed_first(name, names) for name in system.state_names[begin:]]
        further = np.array([list(system.state_names).index(name) for name in behind], dtype=int)
        states = (
            np.concatenate([q[0], len(q[0]) + v[0], further]),
            np.concatenate([q[1], v[1], np.ones(len(further))]),
        )
        count = len(of_controls[0])
        controls = np.append(of_controls[0], count), np.append(of_controls[1], 1.0)
        own = list(system.algebraic_names)
        algebraic = [own.index(_renamed_in_brackets(name, names)) if "[" in name else -1 for name in own]
        return cls(states, controls, v, np.array(algebraic, dtype=int), contacts, names)

    def state(self, x: np.ndarray) -> np.ndarray:
        """Return the image of states, (..., n_x)."""
        return np.asarray(x[..., self.states[0]] * self.states[1])

    def gain(self, gain: np.ndarray) -> np.ndarray:
        """Return the image of gains, (m, n_u, 2 n_v)."""
        (rows, of_rows), (v, of_v) = self.controls, self.velocities
        columns, signs = np.concatenate([v, len(v) + v]), np.concatenate([of_v, of_v])
        return gain[:, rows[:-1]][:, :, columns] * of_rows[:-1, None] * signs

    def cost(self, cost: np.ndarray) -> np.ndarray:
        """Return the image of a quadratic cost of the departure from the gait, (2 n_v, 2 n_v)."""
        v, signs = self.velocities
        rows, of_rows = np.concatenate([v, len(v) + v]), np.concatenate([signs, signs])
        return cost[np.ix_(rows, rows)] * np.outer(of_rows, of_rows)

    def elements(self, elements: Sequence[Element], motion: BranchMotion) -> list[Element]:
        """Return the image of elements.

        Args:
            elements: in time order.
            motion: to whose transcription they belong.
        """
        ocp = motion.transcription.ocp
        residual, parameters = SystemFunctions.of(ocp.system).residual, motion.transcription.parameters
        products = np.flatnonzero(self.algebraic < 0)

        def algebraic(x: np.ndarray, u: np.ndarray, z: np.ndarray, k: int) -> np.ndarray:
            image = np.where(self.algebraic < 0, z, z[self.algebraic])
            for i, product in enumerate(products):  # the last rows are product - definition, in their order
                rows = np.asarray(residual(x, u, image, parameters[:, k % parameters.shape[1]])).ravel()
                image[product] -= rows[len(rows) - len(products) + i]
            return image

        result = []
        for one in elements:
            x, x_left = self.state(one.x), self.state(one.x_left)
            u, k = one.u[self.controls[0]] * self.controls[1], one.interval
            z = np.array([algebraic(*pair) for pair in zip(x, [u] * len(x), one.z, [k] * len(x), strict=False)])
            z_left = algebraic(x_left, u, one.z_left, k)
            slopes = self.state(one.slopes) if one.slopes.size else one.slopes
            result.append(replace(one, x_left=x_left, z_left=z_left, x=x, z=z, u=u, slopes=slopes))
        return result

    def branch(self, branch: Branch) -> Branch:
        """Return the image of a branch."""
        numbers = {label: i for i, label in enumerate(branch.conditions)}
        sources = [numbers[self._label(label)] for label in branch.conditions]
        factors = tuple(tuple(own[i] for i in sources) for own in branch.factors)
        return replace(branch, factors=factors)

    def added(self, added: AddedRows, motion: BranchMotion) -> AddedRows:
        """Return the image of rows that refinement added to a motion's transcription."""
        constraints = motion.transcription.constraints
        numbers = {one.name: i for i, one in enumerate(constraints)}
        n_x, images = len(self.states[0]), {}
        for i, (source, sign) in enumerate(zip(*self.states, strict=True)):
            images[int(source)] = i, int(sign)
        for i, source in enumerate(self.algebraic):
            if source >= 0:
                images[n_x + int(source)] = n_x + i, 1
        bounds = []
        for bound in added.bounds:
            variable, sign = images.get(bound.variable, (bound.variable, 1))
            bounds.append(replace(bound, variable=variable, sign=sign * bound.sign, limit=sign * bound.limit))
        paths = []
        for path in added.paths:
            name = " ".join(self.names.get(word, word) for word in constraints[path.constraint].name.split(" "))
            paths.append(replace(path, constraint=numbers.get(name, path.constraint)))
        return AddedRows(tuple(bounds), tuple(paths))

    def _label(self, label: Label) -> Label:
        contact = None if label.contact is None else self.names[label.contact]
        joint = None if label.joint is None else self.names.get(label.joint, label.joint)
        return replace(label, contact=contact, joint=joint)


def _signed(numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return sources and signs of numbers that begin with one."""
    return np.abs(numbers).astype(int) - 1, np.sign(numbers)


def _contacts(motion: MotionProblem) -> np.ndarray:
    """Return the contact whose gap every contact has in a mirrored configuration."""
    images = contact_images(motion)
    if without := [contact.name for contact, image in zip(motion.contacts, images, strict=True) if image < 0]:
        raise PlanFileError(f"found contact '{without[0]}' without an image in the mirror of the goal")
    return images


def _controls(motion: MotionProblem, v: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return sources and signs of the controls, which push in mirrored directions."""
    matrix, found = motion.actuation.numeric(motion.robot.neutral), []
    image = v[1][:, None] * matrix[v[0]]
    for i in range(matrix.shape[1]):
        pairs = [(k, sign) for k in range(matrix.shape[1]) for sign in (1.0, -1.0)
                 if np.abs(sign * image[:, k] - matrix[:, i]).max() <= SAME]  # fmt: skip
        if not pairs:
            raise PlanFileError(
                f"found control '{motion.actuation.names[i]}' without an image in the mirror of the goal"
            )
        found.append(next((pair for pair in pairs if pair[0] == i), pairs[0]))
    return np.array([k for k, _ in found], dtype=int), np.array([sign for _, sign in found])


def _renamed_first(name: str, names: Mapping[str, str]) -> str:
    """Return a name such as 'left integrated gap' with the image of its first words."""
    for own in sorted(names, key=len, reverse=True):
        if name.startswith(f"{own} "):
            return names[own] + name[len(own) :]
    return name


def _renamed_in_brackets(name: str, names: Mapping[str, str]) -> str:
    """Return a name such as 'theta_+[left]' with the image of what is in its brackets."""
    return re.sub(r"\[([^\]]+)\]", lambda match: f"[{names.get(match[1], match[1])}]", name)
