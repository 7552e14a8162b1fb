"""The kinematic tree as plain links: what the recursions need of a `pin.Model`, with composite joints unfolded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np
import pinocchio as pin

from fesd_robot.errors import RobotError
from fesd_robot.robot.algebra import clean
from fesd_robot.robot.joints import (
    FreeFlyer,
    Joint,
    Planar,
    Prismatic,
    Revolute,
    Spherical,
    Translation,
    UnboundedRevolute,
)


@dataclass(frozen=True, eq=False)
class Link:
    """One joint and the body it carries.

    Attributes:
        name: name of the joint.
        joint: its kind.
        parent: index of the link it stands on, -1 for the world.
        rotation, translation: placement of the joint on the parent, 3 × 3 and 3 (m).
        q_indices, v_indices: its entries of q and v; those of the leader if it mimics another joint.
        mimics: whether the joint follows another one instead of having its own entries of q and v.
        multiplier, offset: a follower's position is multiplier · q + offset (1 and 0 for all others).
        linear, angular: the motion subspace, 3 × nv each, in body coordinates, times the multiplier.
        parent_linear, parent_angular: the same in parent coordinates if constant there, else None.
        mass: of the body and everything it carries, kg.
        first_moment: mass times centre of mass of the augmented body, kg m, shape 3.
        second_moment: ∫ r rᵀ dm of the augmented body about the joint's origin, kg m², 3 × 3.
        inertia: of the augmented body about the joint's origin, kg m², 3 × 3.

    The augmented body is the body together with the masses its children carry, each concentrated at the child's origin
    if that does not move on the body. It is what a body's own rotation has to turn.
    """

    name: str
    joint: Joint
    parent: int
    rotation: ca.DM
    translation: ca.DM
    q_indices: slice
    v_indices: slice
    mimics: bool
    multiplier: float
    offset: float
    linear: ca.DM
    angular: ca.DM
    parent_linear: ca.DM | None
    parent_angular: ca.DM | None
    mass: float
    first_moment: ca.DM
    second_moment: ca.DM
    inertia: ca.DM

    @property
    def turns_nothing(self) -> bool:
        """Whether the augmented body is without extent."""
        return self.first_moment.nnz() == 0 and self.inertia.nnz() == 0

    def motion(self, q: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Return the rotation and the position of the link in its parent at the configuration q of the robot."""
        own = q[self.q_indices]
        if self.mimics:
            own = self.multiplier * own + self.offset
        return self.joint.motion(self.rotation, self.translation, own)


@dataclass(frozen=True, eq=False)
class Tree:
    """All links, parents before children.

    Attributes:
        links: the links.
        last_link: for each Pinocchio joint, the index of the link its body and frames are fixed to; -1: the world.
    """

    links: tuple[Link, ...]
    last_link: tuple[int, ...]

    def path(self, link: int) -> list[Link]:
        """Return the links from the world to `link`, both included."""
        chain: list[Link] = []
        while link >= 0:
            chain.append(self.links[link])
            link = self.links[link].parent
        return chain[::-1]


def build_tree(model: pin.Model, composite_names: Mapping[str, Sequence[str]]) -> Tree:
    """Return the tree of a Pinocchio model.

    Args:
        model: the model.
        composite_names: name of a composite joint -> names of the joints it is made of.

    Raises:
        RobotError: for a joint type that has no counterpart here, naming the joint.
    """
    placed: list[_Placed] = []
    last_link = [-1]
    for index in range(1, model.njoints):
        name, joint, parent = model.names[index], model.joints[index], last_link[model.parents[index]]
        placement, inertia = model.jointPlacements[index], model.inertias[index]
        if joint.shortname() == "JointModelComposite":
            composite = joint.extract()
            parts, placements = list(composite.joints), list(composite.jointPlacements)
            names = composite_names.get(name, [f"{name}.{k}" for k in range(len(parts))])
            for part, shift, part_name in zip(parts[:-1], placements, names, strict=False):
                placed.append(_Placed(part_name, part, parent, placement * shift, pin.Inertia.Zero()))
                parent, placement = len(placed) - 1, pin.SE3.Identity()
            name, joint, placement = names[-1], parts[-1], placement * placements[-1]
        placed.append(_Placed(name, joint, parent, placement, inertia))
        last_link.append(len(placed) - 1)
    return Tree(_links(placed), tuple(last_link))


class _Placed(NamedTuple):
    """A joint of Pinocchio, its parent among the links, its placement there, and the inertia of its body."""

    name: str
    model: pin.JointModel
    parent: int
    placement: pin.SE3
    inertia: pin.Inertia


def _links(placed: list[_Placed]) -> tuple[Link, ...]:
    """Return the links, their bodies augmented by the masses they carry."""
    joints = [_joint(each.name, each.model) for each in placed]
    masses = [each.inertia.mass for each in placed]
    first_moments = [each.inertia.mass * each.inertia.lever for each in placed]
    inertias = [each.inertia.matrix()[3:, 3:] for each in placed]
    second_moments = [np.trace(inertia) / 2 * np.eye(3) - inertia for inertia in inertias]
    for index in reversed(range(len(placed))):
        parent, mass, place = placed[index].parent, masses[index], placed[index].placement.translation
        if parent >= 0:
            masses[parent] += mass
            if joints[index].origin_fixed_in_parent:
                first_moments[parent] = first_moments[parent] + mass * place
                second_moments[parent] = second_moments[parent] + mass * np.outer(place, place)
    return tuple(
        _link(each, joint, mass, first_moment, second_moment)
        for each, joint, mass, first_moment, second_moment in zip(
            placed, joints, masses, first_moments, second_moments, strict=True
        )
    )


def _link(placed: _Placed, joint: Joint, mass: float, first_moment: np.ndarray, second_moment: np.ndarray) -> Link:
    model = placed.model
    mimics = model.shortname() == "JointModelMimic"
    follower = model.extract() if mimics else None
    multiplier, offset = (1.0, 0.0) if follower is None else (follower.scaling, follower.offset)
    nq, nv = (1, 1) if mimics else (model.nq, model.nv)
    linear, angular = joint.subspace()
    turn = placed.placement.rotation if joint.directions_fixed_in_parent else None
    return Link(
        name=placed.name,
        joint=joint,
        parent=placed.parent,
        rotation=clean(placed.placement.rotation),
        translation=clean(placed.placement.translation),
        q_indices=slice(model.idx_q, model.idx_q + nq),
        v_indices=slice(model.idx_v, model.idx_v + nv),
        mimics=mimics,
        multiplier=multiplier,
        offset=offset,
        linear=clean(multiplier * linear),
        angular=clean(multiplier * angular),
        parent_linear=None if turn is None else clean(multiplier * turn @ linear),
        parent_angular=None if turn is None else clean(multiplier * turn @ angular),
        mass=mass,
        first_moment=clean(first_moment),
        second_moment=clean(second_moment),
        inertia=clean(np.trace(second_moment) * np.eye(3) - second_moment),
    )


def _joint(name: str, model: pin.JointModel) -> Joint:
    """Return the counterpart of Pinocchio's joint."""
    kind = model.shortname().removeprefix("JointModel")
    if kind == "Mimic":
        multiplier = model.extract().scaling
        if multiplier == 0.0:
            raise RobotError(f"Joint '{name}' mimics another one with multiplier 0; make it a fixed joint.")
        linear, angular = directions(model)
        return Revolute(angular / multiplier) if np.any(angular) else Prismatic(linear / multiplier)
    if kind in ("RX", "RY", "RZ", "RevoluteUnaligned"):
        return Revolute(directions(model)[1])
    if kind in ("RUBX", "RUBY", "RUBZ", "RevoluteUnboundedUnaligned"):
        return UnboundedRevolute(directions(model)[1])
    if kind in ("PX", "PY", "PZ", "PrismaticUnaligned"):
        return Prismatic(directions(model)[0])
    whole: dict[str, type[Translation | Spherical | Planar | FreeFlyer]] = {
        "Translation": Translation,
        "Spherical": Spherical,
        "Planar": Planar,
        "FreeFlyer": FreeFlyer,
    }
    if kind in whole:
        return whole[kind]()
    raise RobotError(f"Joint '{name}' is of type {kind}, which is not supported.")


def directions(model: pin.JointModel) -> tuple[np.ndarray, np.ndarray]:
    """Return the linear and the angular part of the motion subspace of a joint with one degree of freedom."""
    data = model.createData()
    model.calc(data, np.zeros(model.idx_q + 2), np.zeros(model.idx_v + 1))
    subspace = np.array(data.S).reshape(6)
    return subspace[:3], subspace[3:]
