"""A MuJoCo file as MuJoCo compiles it, with defaults, includes, frames and attachments resolved."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from fesd_robot.errors import RobotError
from fesd_robot.robot.mjcf.words import check_mjcf, in_one_sentence

logger = logging.getLogger(__name__)


def compiled_mjcf(path: Path) -> mujoco.MjModel:
    """Return MuJoCo's model of a file, after refusing forces that the equations of motion do not have.

    Raises:
        RobotError: a file that MuJoCo cannot read, in its words, or one with physics that is left out.
    """
    check_mjcf(path)
    try:
        with _warnings_logged():
            model = mujoco.MjModel.from_xml_path(str(path))
    except (ValueError, mujoco.FatalError, UnicodeDecodeError) as error:
        raise RobotError(f"{path} cannot be read: {in_one_sentence(str(error))}.") from error
    for sentence in chain(_unusable(model), _wrong_ranges(model), _left_out(model)):
        raise RobotError(f"{path}: {sentence}.")
    return model


def _unusable(model: mujoco.MjModel) -> Iterator[str]:
    """Yield why a model is none of a robot, a sentence each."""
    try:
        model.names.decode()
    except UnicodeDecodeError:
        yield "found names that are not in UTF-8, expected that encoding, also in included files"
    if model.nbody <= 1:
        yield "found no body, expected one that moves"
    for kind, properties in _FINITE.items():
        for name in properties:
            finite = np.isfinite(getattr(model, f"{kind}_{name}"))
            for row in np.flatnonzero(~(finite.all(axis=1) if finite.ndim > 1 else finite)):
                what = f"{kind} '{name_of(model, kind, int(row))}'"
                yield f"{what}: found a number in '{name}' that is not finite, expected a finite one"


@contextlib.contextmanager
def _warnings_logged() -> Iterator[None]:
    """Log MuJoCo's warnings instead of a file MUJOCO_LOG.TXT in the working directory."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda text: logger.info("MuJoCo: %s", text))
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def name_of(model: mujoco.MjModel, kind: str, index: int) -> str:
    """Return the name of an element, or for one without name its kind and number.

    Args:
        kind: ``body``, ``joint``, ``site``, ``geom``, ``actuator``, ``tendon`` or ``equality``.
    """
    named = str(mujoco.mj_id2name(model, getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}"), index) or "")
    return named or f"{kind}{index}"


def disabled(model: mujoco.MjModel, what: str) -> bool:
    """Return whether an option of the file turns something off, ``GRAVITY``, ``SPRING`` or ``DAMPER``."""
    return bool(model.opt.disableflags & getattr(mujoco.mjtDisableBit, f"mjDSBL_{what}"))


def _wrong_ranges(model: mujoco.MjModel) -> Iterator[str]:
    """Yield a sentence for every range of no width or the wrong way round, which MuJoCo would take as no limit."""
    ranges = {
        ("joint", "range"): (model.jnt_limited, model.jnt_range),
        ("joint", "actuatorfrcrange"): (model.jnt_actfrclimited, model.jnt_actfrcrange),
        ("actuator", "ctrlrange"): (model.actuator_ctrllimited, model.actuator_ctrlrange),
        ("actuator", "forcerange"): (model.actuator_forcelimited, model.actuator_forcerange),
    }
    for (kind, key), (limited, values) in ranges.items():
        for index, limits in enumerate(values):
            if not limited[index] and limits[0] >= limits[1] and np.any(limits):
                yield (
                    f"found {key} [{limits[0]:g}, {limits[1]:g}] of {kind} '{name_of(model, kind, index)}', which "
                    "MuJoCo takes as no limit, expected lower < upper"
                )


def _left_out(model: mujoco.MjModel) -> Iterator[str]:
    """Yield the unsupported parts of a file that change the motion, a sentence each."""
    moving = model.jnt_type[np.asarray(model.dof_jntid)] if model.nv else np.zeros(0)
    single = (moving == mujoco.mjtJoint.mjJNT_HINGE) | (moving == mujoco.mjtJoint.mjJNT_SLIDE)
    several = [j for j in range(model.njnt) if model.jnt_type[j] in _SEVERAL]
    found = [
        (model.opt.density, "density of a fluid", f"{model.opt.density:g} kg/m3", "0"),
        (model.opt.viscosity, "viscosity of a fluid", f"{model.opt.viscosity:g} Pa s", "0"),
        (np.any(model.body_gravcomp), "gravity compensation", _largest(model, "body", model.body_gravcomp), "0"),
        (model.nflex, "flexible bodies", str(model.nflex), "none"),
        (model.nplugin, "plugins", str(model.nplugin), "none"),
        (np.any(_array(model, "jnt_stiffnesspoly")), "springs that are not linear", "stiffness with several numbers",
         "one"),
        (np.any(_array(model, "dof_dampingpoly")), "damping that is not linear", "damping with several numbers", "one"),
        (np.any(_array(model, "actuator_damping")), "damping of an actuator", "damping", "that of its joint"),
        (np.any(model.jnt_stiffness[several]), "the spring of a free or ball joint",
         _largest(model, "joint", np.where(np.isin(range(model.njnt), several), model.jnt_stiffness, 0)), "0"),
        (np.any(model.dof_frictionloss[~single]), "dry friction of a free or ball joint", "frictionloss", "0"),
    ]  # fmt: skip
    for yes, what, size, wanted in found:
        if yes:
            yield f"found {what} ({size}), which is not supported, expected {wanted}"
    for name in ("tendon_stiffness", "tendon_damping", "tendon_frictionloss", "tendon_armature", "tendon_limited"):
        values = _array(model, name)
        if np.any(values):
            what = name.removeprefix("tendon_").replace("limited", "range")
            at = name_of(model, "tendon", int(np.flatnonzero(values)[0]))
            yield f"found tendon '{at}' with {what}, which is not supported, expected a tendon without"
    for i in range(model.neq):
        if model.eq_active0[i] and model.eq_type[i] != mujoco.mjtEq.mjEQ_JOINT:
            kind = mujoco.mjtEq(int(model.eq_type[i])).name.removeprefix("mjEQ_").lower()
            yield (
                f"found <{kind}> '{name_of(model, 'equality', i)}' in <equality>, which closes a loop, expected a tree "
                'of joints; leave it out or write active="false"'
            )


_FINITE = {
    "body": ("pos", "quat", "ipos", "iquat", "mass", "inertia"),
    "geom": ("pos", "quat", "size", "friction"),
    "site": ("pos", "quat"),
}
"""Kind of an element -> its numbers that are to be finite; MuJoCo reads NaN and goes on."""

_SEVERAL = (int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_BALL))


def _array(model: mujoco.MjModel, name: str) -> Any:
    """Return an array that older versions of MuJoCo do not have."""
    return np.asarray(getattr(model, name, np.zeros(0)))


def _largest(model: mujoco.MjModel, kind: str, values: np.ndarray) -> str:
    if not len(values):
        return "0"
    at = int(np.argmax(np.abs(values)))
    return f"{values[at]:g} of {kind} '{name_of(model, kind, at)}'"
