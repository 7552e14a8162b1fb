"""Contacts in space that cannot begin to slide, without a search for the directions in which they would."""

from __future__ import annotations

import numpy as np
import pytest

from fesd_robot.recovery import DryFriction
from fesd_robot.replay import modes as replay_modes
from fesd_robot.replay.dynamics import ContactDynamics, JointDynamics
from fesd_robot.replay.modes import rated_modes, slips_are_proper

FRICTION, STATES = 1.2, 40
BOTH = np.array([True, True])


def two_feet(seed: int) -> ContactDynamics:
    """Return two contacts at rest, of a body with nine velocities, any inertia and any forces."""
    random = np.random.default_rng(seed)
    jacobian, root = random.standard_normal((6, 9)), random.standard_normal((9, 9))
    mass = root @ root.T + 0.1 * np.eye(9)
    pushes = np.tile([-10.0, 0.0, 0.0], 2) + 4.0 * random.standard_normal(6)
    response = np.linalg.solve(mass, jacobian.T)
    acceleration = response @ pushes
    nothing = np.zeros(0)
    joints = JointDynamics(
        rows=np.zeros(0, dtype=int),
        limit=nothing,
        velocity=nothing,
        response=np.zeros((9, 0)),
        headings=nothing,
        force=nothing,
        by_contacts=np.zeros((0, 6)),
        rubbing=DryFriction.of_joints(np.zeros(0, dtype=int), nothing),
    )
    return ContactDynamics(
        jacobian=jacobian,
        velocity=np.zeros(6),
        acceleration=acceleration,
        response=response,
        compliance=jacobian @ response,
        free=jacobian @ acceleration,
        friction=np.full(2, FRICTION),
        headings=np.zeros((2, 2)),
        joints=joints,
    )


def test_what_cannot_begin_is_no_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    """Motions that Coulomb's law allows are the same ones when directions of all slides are searched for."""
    states = [one for one in map(two_feet, range(STATES)) if not slips_are_proper(one, BOTH)]
    assert len(states) > STATES / 4
    asked, refused = [0], [0]
    whole = replay_modes.may_begin

    def counted(*arguments: object) -> bool:
        answer = whole(*arguments)  # type: ignore[arg-type]
        asked[0] += 1
        refused[0] += not answer
        return answer

    monkeypatch.setattr(replay_modes, "may_begin", counted)
    screened = [rated_modes(one, BOTH) for one in states]
    monkeypatch.setattr(replay_modes, "may_begin", lambda *_: True)
    for state, found in zip(states, screened, strict=True):
        expected = [one.modes for one in rated_modes(state, BOTH) if one.admissible]
        assert [one.modes for one in found if one.admissible] == expected
    assert refused[0] > 0.5 * asked[0]
