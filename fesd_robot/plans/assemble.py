"""A plan in names from a motion in arrays."""

from __future__ import annotations

import datetime
import importlib.metadata
import platform
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fesd_robot.plans.checkout import checked_out_commit
from fesd_robot.plans.plan import ContactHistory, Impulse, Provenance, Switch, Trajectory
from fesd_robot.recovery import NumericPhysics, PhysicalMotion

PACKAGES = ("fesd-robot", "casadi", "pin", "numpy", "example-robot-data")


def trajectory_of(
    motion: PhysicalMotion, configuration_names: Sequence[str], velocity_names: Sequence[str]
) -> Trajectory:
    """Return the samples by coordinate name."""
    return Trajectory(
        time=motion.time,
        configuration=dict(zip(configuration_names, motion.configuration.T, strict=True)),
        velocity=dict(zip(velocity_names, motion.velocity.T, strict=True)),
    )


def controls_of(control: np.ndarray, names: Sequence[str], starts: np.ndarray) -> dict[str, np.ndarray]:
    """Return the start time of every control interval, (N), s, and its controls by name; `control` is (n_u, N)."""
    return {"time": starts, **dict(zip(names, control, strict=True))}


def contacts_of(motion: PhysicalMotion, names: Sequence[str], physics: NumericPhysics) -> dict[str, ContactHistory]:
    """Return gap, forces and mode of every contact along the trajectory."""
    gaps = np.array([physics.gaps(q) for q in motion.configuration])
    return {
        name: ContactHistory(
            gap=gaps[:, i],
            normal_force=motion.force[:, i, 0],
            tangential_force=motion.force[:, i, 1],
            lateral_force=motion.force[:, i, 2] if motion.force.shape[2] > 2 else None,
            mode=list(motion.mode[:, i]),
        )
        for i, name in enumerate(names)
    }


def compliant_of(motion: PhysicalMotion, physics: NumericPhysics) -> dict[str, ContactHistory]:
    """Return gap, force and mode of every compliant contact along the trajectory."""
    if motion.compliance is None:
        return {}
    gaps, no_friction = np.array([physics.compliant_gaps(q) for q in motion.configuration]), np.zeros(len(motion.time))
    return {
        name: ContactHistory(
            gap=gaps[:, i],
            normal_force=motion.compliance.force[:, i],
            tangential_force=no_friction,
            lateral_force=no_friction if motion.force.shape[2] > 2 else None,
            mode=list(motion.compliance.mode[:, i]),
        )
        for i, name in enumerate(physics.compliant)
    }


def switches_of(motion: PhysicalMotion, names: Sequence[str], compliant: Sequence[str] = ()) -> list[Switch]:
    """Return the changes of contact mode in time order."""
    own = motion.compliance.switches if motion.compliance else []
    found = [Switch(time=s.time, contact=names[s.contact], kind=s.kind) for s in motion.switches]
    found += [Switch(time=s.time, contact=compliant[s.contact], kind=s.kind) for s in own]
    return sorted(found, key=lambda one: one.time)


def impulses_of(motion: PhysicalMotion, names: Sequence[str]) -> list[Impulse]:
    """Return the impulse of every contact that took part in an impact, without the solver's residue of others."""
    return [
        Impulse(
            time=float(motion.time[impact.after]),
            contact=name,
            normal=normal,
            tangential=tangential,
            lateral=across[0] if across else None,
        )
        for impact in motion.impacts
        for name, (normal, tangential, *across), part in zip(
            names, impact.impulse.tolist(), impact.taking_part, strict=True
        )
        if part
    ]


def provenance(folder: Path) -> Provenance:
    """Return package versions, the folder that the task lies in with the commit there, and the time in UTC."""
    versions: dict[str, str] = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            versions[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            versions[package] = "not installed"
    created = datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds")
    return Provenance(versions=versions, git=checked_out_commit(folder), created=created, folder=str(folder.absolute()))
