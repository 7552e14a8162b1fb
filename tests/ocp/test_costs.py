"""Every further cost by name, as an integrand or as a sum over intervals."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest

from fesd_robot.fesd import Transcription
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.ocp.costs import FINAL_TERMS, INTEGRANDS, TRAJECTORY_COSTS
from fesd_robot.task import Costs, Task
from fesd_robot.task.costs import COST_TERMS

from .pinocchio_points import center_of_mass, frame, states

Load = Callable[[str], Task]

SMOOTH = "costs: {control_change: {leg: 2, root_pitch: 0.5}, acceleration: {root_x: 3, leg: 0.5}}\n"


def running(motion: MotionProblem, name: str) -> ca.Function:
    system = motion.ocp.system
    return ca.Function("running", system.arguments, [motion.ocp.running_cost[name]])


def test_tracking_of_points(short: str, load: Load) -> None:
    """Frames and centre of mass are compared, per second of physical time, with where the reference has them."""
    text = short + "costs: {center_of_mass: 5, frames: {foot: {x: 2, z: 7}, body: {y: 1}}}\n"
    motion = formulate(load(text))
    assert list(motion.ocp.running_cost)[4:] == ["center of mass", "frame foot", "frame body"]
    z, speed, theta = [0, 0, 1], 1.5, 1.0
    still = np.zeros(4)
    for x, y in zip(states(), states(8)[4:], strict=True):
        p = np.concatenate([y[:4], [0.0], motion.parts.values])
        foot, body = (
            frame(motion.robot, name, x[:4], still)[0] - frame(motion.robot, name, y[:4], still)[0]
            for name in ("foot", "body")
        )
        com = center_of_mass(motion.robot, x[:4], still)[0] - center_of_mass(motion.robot, y[:4], still)[0]
        expected = {
            "center of mass": 5 * com @ com,
            "frame foot": 2 * foot[0] ** 2 + 7 * foot[2] ** 2,
            "frame body": body[1] ** 2,
        }
        for name, value in expected.items():
            integrand = float(running(motion, name)(x, [1.0, 1.0, speed], z, p))
            assert integrand == pytest.approx(theta * speed * value, abs=1e-12), name


def test_slipping_while_pairs_are_relaxed(short: str, load: Load) -> None:
    """Friction that drives the slip is paid little; where that is exploited, nothing: the work is not negative. Where
    friction opposes the slip both tend to its work as sigma falls."""
    motion = formulate(load(short + "costs: {slipping: {foot: 0.2}}\n"))
    ocp, sigma = motion.ocp, ca.SX.sym("sigma")
    weighed, opposed = (
        ca.Function("relaxed", [*ocp.system.arguments, sigma], [one(sigma)]) for one in ocp.relaxed_costs["slipping"]
    )
    exact, p, negative = running(motion, "slipping"), np.append(np.zeros(5), motion.parts.values), 0
    for x in states():
        for plus, minus in ((0.3, 0.0), (0.0, 0.3), (0.1, 0.2)):
            point = x, [1.0, 1.0, 1.0], [plus, minus, 1 - plus - minus], p
            work = float(exact(*point))
            negative += work < 0
            for level, weight in ((3.0, 0.01), (0.03, 1.0), (1e-3, 1.0)):
                assert float(weighed(*point, level)) == pytest.approx(weight * work)
                assert float(opposed(*point, level)) >= 0
            if work >= 0 and plus * minus == 0:
                assert float(opposed(*point, 1e-7)) == pytest.approx(work, rel=1e-9)
                assert float(opposed(*point, 3.0)) <= 0.01 * work
    assert negative


def test_force_is_the_impulse_of_the_contact(short: str, load: Load) -> None:
    """The integrand is a_n (theta_+ + theta_-), whatever the speed of time: force in stance, impulse in an impact."""
    motion = formulate(load(short + "costs: {force: {foot: 0.2}}\n"))
    x, p = states()[0], np.append(np.zeros(5), motion.parts.values)
    for plus, minus in ((0.1, 0.2), (1.0, 0.0), (0.0, 0.0)):
        for speed in (0.5, 3.0):
            integrand = float(running(motion, "force")(x, [1.0, 1.0, speed], [plus, minus, 1 - plus - minus], p))
            assert integrand == pytest.approx(0.2 * motion.auxiliary_force * (plus + minus))


def test_smoothness(short: str, load: Load) -> None:
    """Control change and acceleration are sums of squared differences between and over the intervals."""
    motion = formulate(load(short + SMOOTH))
    transcription = Transcription(motion.ocp, motion.fesd)
    w = np.random.default_rng(3).normal(size=transcription.problem.size)
    u, elements = transcription.controls(w), transcription.unpack(w)
    v = np.array([elements[0].x_left[4:8], *(elements[3 * k + 2].x[-1][4:8] for k in range(4))])
    terms = transcription.cost_terms(w)
    assert terms["control change"] == pytest.approx(np.array([0.5, 2]) @ np.sum(np.diff(u[:2]) ** 2, axis=1))
    square = np.sum((np.diff(v, axis=0) / 0.25) ** 2 * np.array([3, 0, 0, 0.5])) * 0.25
    assert terms["acceleration"] == pytest.approx(square)
    total = sum(float(block.evaluate(w)[0].sum()) for block in transcription.problem.blocks)
    assert sum(terms.values()) == pytest.approx(total)


def test_nothing_is_added_unasked(short: str, load: Load) -> None:
    """Weights of zero add neither terms nor constraints, and keys left out those that have a default only."""
    zero = "costs: {control_change: {leg: 0}, force: {foot: 0}, frames: {foot: 0}, center_of_mass: {x: 0}, time: 0}\n"
    for text in (short, short + zero):
        ocp = formulate(load(text)).ocp
        assert [one.name for one in ocp.constraints if not one.on_request] == []
        assert list(ocp.running_cost) == ["configuration", "velocity", "control", "slipping"]
        assert list(ocp.terminal_cost) == ["terminal configuration", "terminal velocity"]


def test_every_key_has_an_expression() -> None:
    """Each key of `costs` is in one of the tables of expressions and in no other."""
    tables = [INTEGRANDS, FINAL_TERMS, TRAJECTORY_COSTS]
    assert sorted(key for table in tables for key in table) == sorted(Costs.model_fields) == sorted(COST_TERMS)
