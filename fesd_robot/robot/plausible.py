"""Inertias that no body has, and numbers that look like other units, in the model of a robot."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pinocchio as pin

from fesd_robot.errors import RobotError
from fesd_robot.robot.model_file import note

_NONE = 1e-15
"""kg m²; moments that add up to less are none, written by a program."""

_WEIGHTLESS = 1e-12
"""kg; less is no mass to compare with."""

_ROUNDED = 1e-6
"""Of the sum of the principal moments; how far a moment may be below zero by rounding."""

_ROUGH = 0.02
"""Of the same sum; how far the largest moment may be above the sum of the others where a file has few digits."""

_NEGATIVE, _UNEQUAL = 0.15, 0.8
"""The same from which on an inertia is refused; below, models are in use that have such inertias."""

_LARGE = 100.0
"""m; size of a robot from which on its lengths look like millimetres."""

_DENSE, _HEAVY = 2e4, 20.0
"""kg/m3 and kg; mass in the cube as long as the robot, above that of gold, and total mass, that look like grams."""

_WIDE = 20.0
"""Sizes of the robot; radius of gyration of a body from which on its inertia looks like that in other units."""


def check_inertias(path: Path, model: pin.Model) -> list[str]:
    """Return a warning for every body whose inertia no body has, refuse one that is far from any.

    The body of a joint is all that it moves without another joint between. Its principal moments about its centre of
    mass are not negative, and none is larger than the sum of the other two; hollow and flat bodies are at these bounds.

    Raises:
        RobotError: names body and moments.
    """
    warnings = []
    for joint in range(1, model.njoints):
        moments = _principal_moments(model.inertias[joint])
        scale, largest = float(np.abs(moments).sum()), float(moments[2])
        if scale <= _NONE:
            continue
        negative, over = -float(moments[0]) / scale, (largest - float(moments[0]) - float(moments[1])) / scale
        found = (
            f"the inertia of {_body(model, joint)} has principal moments {', '.join(f'{m:.4g}' for m in moments)} kg m²"
        )
        if negative > _ROUNDED:
            sentence = f"{found}, expected none below 0: no body has this inertia"
        elif over > _ROUGH:
            sentence = f"{found}, expected none larger than the sum of the others: no body has this inertia"
        else:
            continue
        if negative > _NEGATIVE or over > _UNEQUAL:
            raise RobotError(f"{path}: {sentence}.")
        warnings.append(f"{sentence[:1].upper()}{sentence[1:]}.")
    return warnings


def unit_warnings(model: pin.Model, longest: float) -> list[str]:
    """Return where lengths, masses or inertias of a robot look like other units than m, kg and kg m².

    Args:
        model: of the robot.
        longest: length of the longest shape in its file, m.
    """
    size, mass = max(_size(model), longest), sum(float(inertia.mass) for inertia in model.inertias)
    return [*_of_size(size), *_of_mass(mass, size), *_of_inertia(model, size)]


def _of_size(size: float) -> Iterator[str]:
    if size > _LARGE:
        yield (
            f"The robot is {size:.3g} m large; in millimetres it would be {size / 1000:.3g} m: its lengths should be "
            "in m."
        )


def _of_mass(mass: float, size: float) -> Iterator[str]:
    if size > 0 and mass > max(_HEAVY, _DENSE * size**3):
        yield (
            f"The robot weighs {mass:.4g} kg at a size of {size:.3g} m; in grams it would be {mass / 1000:.3g} kg: its "
            "masses should be in kg."
        )


def _of_inertia(model: pin.Model, size: float) -> Iterator[str]:
    wide = {
        _body(model, joint): math.sqrt(_principal_moments(model.inertias[joint])[2] / model.inertias[joint].mass)
        for joint in range(1, model.njoints)
        if model.inertias[joint].mass > _WEIGHTLESS and _principal_moments(model.inertias[joint])[2] > 0
    }
    yield from note(
        f"Inertias have radii of gyration sqrt(I/m) beyond the robot's size of {size:.3g} m ({{}}), as in kg mm² or "
        "with masses in other units: they should be in kg m².",
        [f"{body}: {radius:.3g} m" for body, radius in wide.items() if size > 0 and radius > _WIDE * size],
    )


def _principal_moments(inertia: pin.Inertia) -> np.ndarray:
    """Return the principal moments about the centre of mass, kg m², ascending, (3)."""
    return np.asarray(np.linalg.eigvalsh(np.array(inertia.inertia)))


def _size(model: pin.Model) -> float:
    """Return the diagonal of the box around all frames in the neutral configuration, m."""
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    places = np.array([pose.translation for pose in list(data.oMf)[1:]] or [np.zeros(3)])
    return float(np.linalg.norm(places.max(axis=0) - places.min(axis=0)))


def _body(model: pin.Model, joint: int) -> str:
    own = [f.name for f in model.frames if f.parentJoint == joint and f.type == pin.FrameType.BODY]
    return f"'{own[0]}'" if own else f"joint '{model.names[joint]}'"
