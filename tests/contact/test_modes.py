"""The modes of a contact, read from the branch of motions that are known exactly."""

from __future__ import annotations

import numpy as np
import pytest

from fesd_robot.complementarity import ActiveFactor, Branch, Label
from fesd_robot.contact import ContactMode, ContactOptions, contact_modes, contact_system

from .motions import AUXILIARY_FORCE, FORMS, FRICTION, GRAVITY, Motion, branch_of, two_contacts

FALL, IMPACT_VELOCITY = np.sqrt(0.2), np.sqrt(20)
BETA = GRAVITY / (AUXILIARY_FORCE + GRAVITY)

each_form = pytest.mark.parametrize("options", FORMS.values(), ids=FORMS.keys())


def _modes(motion: Motion) -> list[ContactMode]:
    """The mode of the foot in every element."""
    branch = branch_of(motion.system(), motion.elements)
    assert branch.contacts == ("foot",) and len(branch.factors) == len(motion.elements)
    return [contact_modes(branch, element)["foot"] for element in range(len(motion.elements))]


def _landing(options: ContactOptions, x_velocity: float, friction: float = FRICTION) -> Motion:
    """A fall from a height of 1 m, its impact, and a stance of 0.2 in which the point goes on."""
    motion = Motion(options, np.array([0, 1, x_velocity, 0, 0], dtype=float), friction=friction)
    plus, minus = (1.0, 0.0) if x_velocity > 0 else (0.0, 1.0)
    motion.add(FALL, settled=True)
    motion.add(IMPACT_VELOCITY / AUXILIARY_FORCE, plus=plus, minus=minus, settled=True)
    motion.add(0.2, plus=BETA * plus, minus=BETA * minus, settled=True)
    return motion


@each_form
@pytest.mark.parametrize(
    ("x_velocity", "slip"), [(4.0, ContactMode.SLIP_FORWARDS), (-4.0, ContactMode.SLIP_BACKWARDS)], ids=["+", "-"]
)
def test_a_landing_flies_hits_and_slips(options: ContactOptions, x_velocity: float, slip: ContactMode) -> None:
    """Flight, impact and sliding stance, whichever way it slides."""
    assert _modes(_landing(options, x_velocity)) == [ContactMode.FLIGHT, ContactMode.IMPACT, slip]


@each_form
@pytest.mark.parametrize("part", [0.2, 0.5, 0.8])
def test_a_resting_contact_sticks(options: ContactOptions, part: float) -> None:
    """Both multipliers act where nothing slides, whatever the friction force that they make together."""
    motion = Motion(options, np.zeros(5))
    motion.add(0.1, plus=BETA * part, minus=BETA * (1 - part))
    motion.elements[0].x[:] = motion.elements[0].x_left
    motion.elements[0].x[:, 4] = motion.elements[0].x_left[4] + 0.1 * (1 - BETA)
    assert _modes(motion) == [ContactMode.STICK]


@each_form
def test_without_friction_there_is_one_slip(options: ContactOptions) -> None:
    """A contact without friction flies, hits, and slips in no direction that its conditions know."""
    motion = _landing(options, 4.0, friction=0.0)
    residuals = motion.transcription().problem.residuals(motion.vector())
    assert max(residuals.complementarity, residuals.constraint_violation) <= 1e-13
    assert _modes(motion) == [ContactMode.FLIGHT, ContactMode.IMPACT, ContactMode.SLIP]


@each_form
def test_a_take_off_flies(options: ContactOptions) -> None:
    """A point that leaves the ground is in flight from the beginning of its element, though its gap begins at zero."""
    motion = Motion(options, np.array([0, 0, 1, 2, 0], dtype=float))
    motion.add(0.1)
    motion.add(0.1)
    assert _modes(motion) == [ContactMode.FLIGHT] * 2


@each_form
def test_every_contact_has_its_own_mode(options: ContactOptions) -> None:
    """A branch in which ground and wall have the factors of different modes is read contact by contact."""
    conditions = contact_system(*two_contacts(), options).system.complementarities
    assert list(dict.fromkeys(condition.label.contact for condition in conditions)) == ["foot", "wall"]
    branches = {
        name: branch_of(motion.system(), motion.elements)
        for name, motion in (("foot", _landing(options, 4.0)), ("wall", _landing(options, 4.0, friction=0.0)))
    }

    def factor(label: Label, element: int) -> ActiveFactor:
        owner = str(label.contact)
        own = branches[owner].of_contact(element, "foot")
        return own[label.kind, label.subject.replace(owner, "foot", 1)]

    labels = tuple(condition.label for condition in conditions)
    pairs_of_elements = [(0, 1), (1, 2), (2, 0)]
    factors = tuple(
        tuple(factor(label, foot if label.contact == "foot" else wall) for label in labels)
        for foot, wall in pairs_of_elements
    )
    branch = Branch(labels, factors, (False,) * 3)
    foot = [ContactMode.FLIGHT, ContactMode.IMPACT, ContactMode.SLIP_FORWARDS]
    wall = [ContactMode.FLIGHT, ContactMode.IMPACT, ContactMode.SLIP]
    expected = [{"foot": foot[i], "wall": wall[j]} for i, j in pairs_of_elements]
    assert [contact_modes(branch, element) for element in range(3)] == expected


def test_a_branch_without_contacts_has_no_modes() -> None:
    """Conditions that belong to no contact are left alone."""
    assert contact_modes(Branch.of_pairs([Label("pair 0")], [ActiveFactor.G]), 0) == {}
