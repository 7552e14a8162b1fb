"""From arrays to names."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fesd_robot.plans import Plan, assemble

from .motions import drop

NAMES = ["root_x", "root_z", "root_pitch", "leg"]


def test_samples_by_name(plan: Plan) -> None:
    """Every coordinate has its own column of the motion."""
    motion = drop()
    np.testing.assert_array_equal(plan.trajectory.time, motion.time)
    assert list(plan.trajectory.configuration) == list(plan.trajectory.velocity) == NAMES
    for i, name in enumerate(NAMES):
        np.testing.assert_array_equal(plan.trajectory.configuration[name], motion.configuration[:, i])
        np.testing.assert_array_equal(plan.trajectory.velocity[name], motion.velocity[:, i])


def test_a_wrong_number_of_names_is_an_error() -> None:
    """Names and columns must match one by one."""
    with pytest.raises(ValueError):
        assemble.trajectory_of(drop(), NAMES[:3], NAMES)


def test_controls_start_at_their_intervals() -> None:
    """The start of every interval stands beside its controls."""
    controls = assemble.controls_of(np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]), ["a", "b"], np.array([0.0, 0.2, 0.4]))
    np.testing.assert_allclose(controls["time"], [0.0, 0.2, 0.4])
    np.testing.assert_array_equal(controls["b"], [4.0, 5.0, 6.0])


def test_contact_history(plan: Plan) -> None:
    """Gap is the true one, forces and modes are the motion's."""
    motion, foot = drop(), plan.contacts["foot"]
    np.testing.assert_allclose(foot.gap, motion.gap_state[:, 0], atol=1e-14)
    np.testing.assert_array_equal(foot.normal_force, motion.force[:, 0, 0])
    assert foot.mode == list(motion.mode[:, 0])
    assert foot.mode[0] == "flight" and "impact" in foot.mode and foot.mode[-1] == "stick"


def test_switches_and_impulses(plan: Plan) -> None:
    """The drop has one touchdown and one impulse, at the same time."""
    (switch,), (impulse,) = plan.switches, plan.impulses
    assert (switch.contact, switch.kind, impulse.contact) == ("foot", "touchdown", "foot")
    assert switch.time == impulse.time == pytest.approx(0.20192751093846089)
    assert (impulse.normal, impulse.tangential) == (pytest.approx(0.18158331421141096), 0.0)


def test_only_who_took_part_has_an_impulse() -> None:
    """Beside a contact that stops the fall one with a billionth of its impulse is none that hit."""
    motion = drop()
    (impact,) = motion.impacts
    both = replace(impact, impulse=np.vstack([impact.impulse, 1e-9 * impact.impulse]))
    (found,) = assemble.impulses_of(replace(motion, impacts=[both]), ["foot", "elbow"])
    assert found.contact == "foot"


def test_provenance_outside_a_repository(tmp_path: Path) -> None:
    """Versions of every package are known, and a folder without git has no git state."""
    found = assemble.provenance(tmp_path)
    assert found.git == "none"
    assert set(found.versions) == {"python", *assemble.PACKAGES}
    assert found.created.endswith("+00:00")
    assert found.folder == str(tmp_path)
