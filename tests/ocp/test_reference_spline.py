"""The reference as a spline in a window of parameters."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from fesd_robot.ocp import formulate
from fesd_robot.ocp.reference_spline import WINDOW, ReferenceSpline
from fesd_robot.task import load_task

TASKS = Path(__file__).parents[2] / "tasks"


def spline_of(task: str) -> tuple[ReferenceSpline, Callable[[float], np.ndarray], Callable[[float, float], np.ndarray]]:
    """Return the spline of a task's reference, the reference, and the window around a time at another one."""
    motion = formulate(load_task(TASKS / f"{task}.yaml"))
    names = motion.robot.configuration_names
    spline = ReferenceSpline.of(motion.reference, names)
    parameters, time = ca.SX.sym("p", spline.parameters(0.0).size), ca.SX.sym("t")
    function = ca.Function("q", [parameters, time], [spline.expression(parameters, time)])
    return spline, motion.reference.configuration, lambda around, t: function(spline.parameters(around), t).full()[:, 0]


@pytest.mark.parametrize("task", ["hopper_one_jump", "hopper_five_jumps", "block_push", "solo12_turn", "biped_walk"])
def test_the_spline_follows_the_reference(task: str) -> None:
    """It rounds kinks by 2.5 % of a jump at most, is the reference at its knots, and holds still behind its end."""
    spline, reference, at = spline_of(task)
    end = spline.knots[len(spline.starts)] if len(spline.starts) > WINDOW else None
    horizon = load_task(TASKS / f"{task}.yaml").horizon.duration
    assert isinstance(horizon, float | int) and (end is None or end == pytest.approx(horizon))
    times = np.linspace(0, float(horizon), 101)
    found, expected = np.array([at(t, t) for t in times]), np.array([reference(float(t)) for t in times])
    assert np.abs(found - expected).max() < 0.025 * np.ptp(expected, axis=0).max()
    for knot in spline.knots[spline.knots <= horizon]:
        assert at(knot, knot) == pytest.approx(reference(float(knot)), abs=1e-9)
    assert at(horizon, horizon + 5.0) == pytest.approx(reference(float(horizon)), abs=1e-9)


def test_windows_agree_where_they_overlap() -> None:
    """A time that two windows cover has the same reference in both; one outside is told."""
    spline, _, at = spline_of("hopper_five_jumps")
    assert len(spline.starts) > WINDOW
    assert spline.window(0.0) == 0 and spline.window(100.0) == len(spline.starts) - WINDOW
    early, late = spline.knots[WINDOW // 2 - 1], spline.knots[WINDOW // 2 + 4]
    assert spline.covers(early, late) and at(early, late) == pytest.approx(at(late, late), abs=1e-12)
    assert not spline.covers(0.0, spline.knots[WINDOW] + 1e-3) and spline.covers(0.0, -1.0)


def test_its_slope_has_no_jump() -> None:
    """Difference quotients just before and just after a knot agree: the spline is once continuously differentiable."""
    spline, _, at = spline_of("hopper_one_jump")
    for knot in spline.knots[1:5]:
        before, after = ((at(knot, knot + d) - at(knot, knot + d - 1e-6)) / 1e-6 for d in (0.0, 1e-6))
        assert before == pytest.approx(after, abs=1e-2)
