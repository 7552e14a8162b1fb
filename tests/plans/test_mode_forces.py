"""Forces of planned modes where several contacts share them, and where a state is no number."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fesd_robot.contact import ContactMode
from fesd_robot.plans.measured import Names
from fesd_robot.plans.mode_forces import ModeForces
from fesd_robot.recovery.between import FRACTIONS, DenseElement, stacked_elements
from fesd_robot.recovery.physics import NumericPhysics

from ..replay.bodies import GRAVITY, body
from .motions import drop, stance

STICK, FLIGHT = ContactMode.STICK, ContactMode.FLIGHT
CORNERS = {"rear": (-0.15, -0.1), "middle": (0.0, -0.1), "front": (0.15, -0.1)}


def resting(modes: list[list[ContactMode]], tilting: float = 0.0) -> ModeForces:
    """A block of 2 kg at rest on three points of a line, in these modes one after the other, in one interval."""
    points = len(FRACTIONS)
    elements = [
        DenseElement(
            time=0.1 * (k + FRACTIONS),
            configuration=np.tile([0.0, 0.1, 0.0], (points, 1)),
            velocity=np.zeros((points, 3)),
            interval=0,
            control=np.array([0.0, 0.0, tilting]),
            mode=mode,
        )
        for k, mode in enumerate(modes)
    ]
    motion = SimpleNamespace(between=stacked_elements(elements, (3, 3, 3, 3)), time=np.zeros(1), impacts=[])
    physics, nothing = body(2.0, 0.02, CORNERS, friction=0.4), {"x": "", "z": "", "pitch": ""}
    return ModeForces(motion, physics, Names(list(CORNERS), nothing, nothing, nothing))  # type: ignore[arg-type]


def test_a_contact_whose_load_others_can_bear_may_open() -> None:
    """Of three points on a line the middle one need not carry anything, so that its opening changes no motion."""
    opening = resting([[STICK] * 3, [STICK, FLIGHT, STICK]])
    assert opening.openings().value == pytest.approx(0.0, abs=1e-9)
    assert (opening.pulling().value, opening.cone().value) == (0, 0)


def test_a_contact_that_others_cannot_stand_in_for_may_not() -> None:
    """With two points under it a block cannot lose one of them: half of its weight is there."""
    found = resting([[STICK, FLIGHT, STICK], [STICK, FLIGHT, FLIGHT]]).openings()
    assert found.value == pytest.approx(GRAVITY)
    assert (found.subject, found.time, found.interval) == ("front", pytest.approx(0.1), 0)


def test_a_torque_that_lifts_one_side() -> None:
    """Modes that hold both ends down against a torque of 3 N m need the rear to pull by 10 - 9.81 N."""
    found = resting([[STICK, FLIGHT, STICK]], tilting=3.0).pulling()
    assert found.value == pytest.approx(3.0 / 0.3 - GRAVITY)
    assert found.subject == "rear"


def test_a_landing_is_no_opening(physics: NumericPhysics) -> None:
    """The drop closes its contact once, with an impact."""
    names = {"x": "", "z": "", "pitch": "", "leg": ""}
    assert ModeForces(drop(), physics, Names(["foot"], names, names, names)).openings().value == 0


def test_a_state_that_is_no_number_does_not_pass(physics: NumericPhysics) -> None:
    """NaN between stages of a stance is a force that is no number."""
    motion, names = stance(), {"x": "", "z": "", "pitch": "", "leg": ""}
    velocity = motion.between.velocity.copy()
    velocity[1, 4, 0] = np.nan
    broken = replace(motion, between=replace(motion.between, velocity=velocity))
    forces = ModeForces(broken, physics, Names(["foot"], names, names, names))
    assert np.isnan(forces.pulling().value) and np.isnan(forces.cone().value)
