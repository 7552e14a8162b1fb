"""Joints that move in unison: the model in which the bodies they carry are one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from fesd_robot.errors import JointError
from fesd_robot.exactness import ROUNDED
from fesd_robot.robot.followers import Follower, common_range, set_entries
from fesd_robot.robot.lock import find_joint

_PROBE_VALUES = (0.0, 0.7, -1.3)
"""m or rad; joint values at which the poses of two bodies are compared."""


def couple_joints(model: pin.Model, coupled: Mapping[str, str]) -> pin.Model:
    """Return the model in which every follower's body is a part of its leader's.

    Two joints on the same body that turn about one line (or slide along parallel ones), at equal angles, carry two
    bodies that never move against each other. These are rigidly one body: their inertias add up, and the equations of
    motion of the result are those of the model under the constraint q_follower = ± q_leader, exactly,

        M_r = Cᵀ M C,   h_r = Cᵀ h(C q, C v)   with   q = C q_r

    where the sign is the one that makes both turn the same way in space. Armature, damping, dry friction and effort
    limits of the pair add up; of position and velocity limits the narrower ones hold. All frames stay.

    Args:
        model: the model.
        coupled: name of a joint that follows -> name of the joint it moves in unison with.

    Raises:
        JointError: for an unknown name, a leader that follows itself, position limits that share no value or that the
            leader cannot have, two joints whose bodies move against each other, and a model with <mimic> joints;
            naming the follower.
    """
    return in_unison(model, coupled)[0]


def coupling_signs(model: pin.Model, coupled: Mapping[str, str]) -> dict[str, float]:
    """Return by which sign every follower of `couple_joints` moves with its leader.

        q_follower = sign q_leader,   q = 0 being the neutral value of both

    Args:
        model: the model before coupling, with the locked joints held.
        coupled: name of a joint that follows -> name of the joint it moves in unison with.

    Returns:
        name of the follower -> 1.0, or -1.0 where the axes are opposite.

    Raises:
        JointError: as `couple_joints`.
    """
    return in_unison(model, coupled)[1]


def in_unison(model: pin.Model, coupled: Mapping[str, str]) -> tuple[pin.Model, dict[str, float]]:
    """Return the results of `couple_joints` and `coupling_signs`, from one model that is built."""
    if any(joint.shortname() == "JointModelMimic" for joint in model.joints):
        raise JointError(
            "found a model file with <mimic> joints, expected one without; couple these joints by <mimic>, too",
            option="coupled",
            joint=next(iter(coupled)),
        )
    followers = {find_joint(model, name, "coupled"): _leader(model, name, leader) for name, leader in coupled.items()}
    for follower, leader in followers.items():
        if leader in followers:
            raise JointError(
                f"found joint '{model.names[leader]}', which follows another one itself, expected one that does not",
                option="coupled",
                joint=model.names[follower],
            )
    builder = _Builder(model, followers)
    builder.add_joints()
    builder.add_bodies()
    return builder.result, {model.names[index]: sign for index, sign in builder.signs.items()}


def _leader(model: pin.Model, follower: str, leader: str) -> int:
    try:
        return find_joint(model, leader, "coupled")
    except JointError as error:
        raise JointError(str(error), option="coupled", joint=follower) from error


class _Place(NamedTuple):
    """The joint of the result that carries a body of the model, and the pose of the body on it."""

    joint: int
    pose: pin.SE3


class _Builder:
    """Builds the result joint by joint, and keeps each body's place in it and the sign of every follower."""

    def __init__(self, model: pin.Model, followers: Mapping[int, int]) -> None:
        self.result = pin.Model()
        self.result.name, self.result.gravity = model.name, model.gravity
        self._model, self._followers = model, followers
        self._places = {0: _Place(0, pin.SE3.Identity())}
        self.signs: dict[int, float] = {}

    def add_joints(self) -> None:
        """Place all joints, each branch of the tree as a whole, as Pinocchio's algorithms expect it."""
        self._add_children(0)
        for index in self._followers:
            if index not in self._places:
                raise self._apart(index)

    def add_bodies(self) -> None:
        """Give the bodies their inertias and frames."""
        model, result = self._model, self.result
        for index, place in self._places.items():
            result.appendBodyToJoint(place.joint, model.inertias[index], place.pose)
        for frame in list(model.frames)[1:]:
            place = self._places[frame.parentJoint]
            merged = frame.type == pin.FrameType.JOINT and frame.parentJoint in self._followers
            kind = pin.FrameType.FIXED_JOINT if merged else frame.type
            pose = place.pose * frame.placement
            result.addFrame(pin.Frame(frame.name, place.joint, frame.parentFrame, pose, kind, frame.inertia), False)

    def _add_children(self, parent: int) -> None:
        model = self._model
        for index in range(1, model.njoints):
            if index in self._followers or self._carrier(index) != parent:
                continue
            self._places[index] = self._add(index)
            for follower, leader in self._followers.items():
                if leader == index:
                    self._places[follower] = self._merge(follower)
            self._add_children(index)

    def _carrier(self, index: int) -> int:
        """Return the joint of the model that carries a joint in the result."""
        parent = self._model.parents[index]
        return self._followers.get(parent, parent)

    def _add(self, index: int) -> _Place:
        model, result = self._model, self.result
        joint, parent = model.joints[index], self._places[model.parents[index]]
        q, v = slice(joint.idx_q, joint.idx_q + joint.nq), slice(joint.idx_v, joint.idx_v + joint.nv)
        added = result.addJoint(
            parent.joint,
            joint,
            parent.pose * model.jointPlacements[index],
            model.names[index],
            model.lowerEffortLimit[v],
            model.upperEffortLimit[v],
            # Pinocchio 4.1 gives the upper limit under the name of the lower one, too.
            -model.upperVelocityLimit[v],
            model.upperVelocityLimit[v],
            model.lowerPositionLimit[q],
            model.upperPositionLimit[q],
            model.lowerDryFrictionLimit[v],
            model.upperDryFrictionLimit[v],
            model.damping[v],
        )
        set_entries(result, "armature", result.joints[added].idx_v, model.armature[v])
        return _Place(added, pin.SE3.Identity())

    def _merge(self, index: int) -> _Place:
        """Make a follower's body a part of its leader's."""
        leader = self._followers[index]
        if self._carrier(index) != self._carrier(leader):
            raise self._apart(index)
        for sign in (1.0, -1.0):
            poses = [self._pose(leader, probe).inverse() * self._pose(index, sign * probe) for probe in _PROBE_VALUES]
            if all(np.abs(pose.homogeneous - poses[0].homogeneous).max() <= ROUNDED for pose in poses):
                self._merge_limits(index, leader, sign)
                self.signs[index] = sign
                place = self._places[leader]
                return _Place(place.joint, place.pose * poses[0])
        raise self._apart(index)

    def _pose(self, index: int, value: float) -> pin.SE3:
        """Return the pose of a joint's body on the joint of the result that carries its parent."""
        model, joint = self._model, self._model.joints[index]
        step = np.zeros(model.nv)
        step[joint.idx_v] = value
        data = joint.createData()
        joint.calc(data, pin.integrate(model, pin.neutral(model), step))
        return self._places[model.parents[index]].pose * model.jointPlacements[index] * data.M

    def _merge_limits(self, index: int, leader: int, sign: float) -> None:
        model, result = self._model, self.result
        follower, led = model.joints[index], result.joints[self._places[leader].joint]
        v, own = follower.idx_v, led.idx_v
        for name in ("armature", "damping", "lowerDryFrictionLimit", "upperDryFrictionLimit"):
            set_entries(result, name, own, [getattr(result, name)[own] + getattr(model, name)[v]])
        efforts = sorted([sign * model.lowerEffortLimit[v], sign * model.upperEffortLimit[v]])
        set_entries(result, "lowerEffortLimit", own, [result.lowerEffortLimit[own] + efforts[0]])
        set_entries(result, "upperEffortLimit", own, [result.upperEffortLimit[own] + efforts[1]])
        slower = min(result.upperVelocityLimit[own], model.upperVelocityLimit[v])
        set_entries(result, "upperVelocityLimit", own, [slower])
        if follower.nq == 1:
            if led.nq != 1:
                raise JointError(
                    f"found joint '{model.names[leader]}' without limits leading '{model.names[index]}' with limits, "
                    "expected them the other way round",
                    option="coupled",
                    joint=model.names[index],
                )
            q, own = follower.idx_q, led.idx_q
            one = Follower(model.names[index], model.names[leader], sign, 0.0)
            limits = float(model.lowerPositionLimit[q]), float(model.upperPositionLimit[q])
            kept = common_range(
                (float(result.lowerPositionLimit[own]), float(result.upperPositionLimit[own])), one.leader_range(limits)
            )
            if kept is None:
                raise JointError(
                    f"found joint '{model.names[index]}' with position limits that share no value with those of "
                    f"'{model.names[leader]}', expected limits that overlap",
                    option="coupled",
                    joint=model.names[index],
                )
            set_entries(result, "lowerPositionLimit", own, [kept[0]])
            set_entries(result, "upperPositionLimit", own, [kept[1]])

    def _apart(self, index: int) -> JointError:
        name, leader = self._model.names[index], self._model.names[self._followers[index]]
        return JointError(
            f"found joints '{name}' and '{leader}', whose bodies move against each other at equal angles, expected two "
            "joints on the same body that turn about the same line or slide in the same direction (joints between "
            "them and that body must be locked or coupled, too)",
            option="coupled",
            joint=name,
        )
