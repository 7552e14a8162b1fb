"""Interior-point steps in two halves, on programs whose solutions are known."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from fesd_robot.nlp import Nlp, NlpNumbers
from fesd_robot.nlp.real_time import PrimalDual, RealTimeInteriorPoint

INF = np.inf


def program(x: ca.SX, p: ca.SX, f: ca.SX, g: ca.SX) -> Nlp:
    lam = ca.SX.sym("lam_g", g.numel())
    weight = ca.SX.sym("lam_f")
    return Nlp(
        ca.Function("nlp", [x, p], [f, g], ["x", "p"], ["f", "g"]),
        ca.Function("gradient", [x, p], [f, ca.gradient(f, x)], ["x", "p"], ["f", "grad_f_x"]),
        ca.Function("jacobian", [x, p], [g, ca.jacobian(g, x)], ["x", "p"], ["g", "jac_g_x"]),
        ca.Function(
            "hessian",
            [x, p, weight, lam],
            [ca.triu(ca.hessian(weight * f + ca.dot(lam, g), x)[0])],
            ["x", "p", "lam_f", "lam_g"],
            ["hess_gamma_x_x"],
        ),
    )


def pendulum_like() -> tuple[Nlp, NlpNumbers]:
    """A program with a fixed variable, a nonlinear equation, a bound that is met and an inequality row.

    min (x_1 - 2)^2 + x_2^2 + 0.1 x_3^2   with   x_1 = x_0 + sin x_3,   x_1 <= 1.2,   x_2 >= x_3 - 0.3,   x_0 given.
    """
    x, p = ca.SX.sym("x", 4), ca.SX.sym("p", 1)
    f = (x[1] - p) ** 2 + x[2] ** 2 + 0.1 * x[3] ** 2
    g = ca.vertcat(x[1] - x[0] - ca.sin(x[3]), x[2] - x[3])
    numbers = NlpNumbers(
        np.array([0.5, -INF, -INF, -INF]),
        np.array([0.5, 1.2, INF, INF]),
        np.array([0.0, -0.3]),
        np.array([0.0, INF]),
        np.array([2.0]),
    )
    return program(x, p, f, g), numbers


def solved(solver: RealTimeInteriorPoint, x: np.ndarray, count: int = 40) -> PrimalDual:
    point = solver.at(x)
    for _ in range(count):
        solver.prepare(point)
        point = solver.step().iterate
    return point


def test_it_solves_the_barrier_problem() -> None:
    """Its fixed point is the minimum of f - mu sum log(distance), which another solver finds from the same words."""
    nlp, numbers = pendulum_like()
    solver = RealTimeInteriorPoint(nlp, numbers, barrier=1e-3)
    found = solved(solver, np.array([0.5, 0.6, 0.0, 0.1])).x
    x = ca.SX.sym("x", 4)
    f, g = nlp.nlp(x, numbers.p)
    rho, mu = solver.strength, solver.barrier
    t, e = ca.SX.sym("t", 2), ca.SX.sym("e", 2)
    inside = ca.vertcat(1.2 - x[1], g[1] + 0.3)
    other = ca.nlpsol(
        "other",
        "ipopt",
        {
            "x": ca.vertcat(x, t, e),
            "f": f + rho * ca.sum1(e) - mu * ca.sum1(ca.log(t) + ca.log(e)),
            "g": ca.vertcat(g[0], x[0] - 0.5, t - e - inside),
        },
        {"ipopt.print_level": 0, "print_time": False, "ipopt.tol": 1e-12},
    )(x0=[0.5, 0.6, 0, 0.1, 1, 1, 1e-4, 1e-4], lbg=0, ubg=0)
    assert found == pytest.approx(np.array(other["x"]).ravel()[:4], abs=1e-7)


def test_one_step_follows_to_second_order() -> None:
    """Where a fixed variable moves by d, what one step leaves of the equations falls with the square of d."""
    nlp, numbers = pendulum_like()
    solver = RealTimeInteriorPoint(nlp, numbers, barrier=1e-2)
    point = solved(solver, np.array([0.5, 0.6, 0.0, 0.1]))
    left = []
    for distance in (0.02, 0.01, 0.005):
        solver.prepare(point)
        step = solver.step(np.array([distance, 0.0, 0.0, 0.0]))
        assert step.share == 1.0
        assert step.iterate.x[0] == pytest.approx(0.5 + distance, abs=1e-15)
        left.append(solver.violation(step.iterate.x)[0])
    assert left[0] / left[1] == pytest.approx(4.0, rel=0.1)
    assert left[1] / left[2] == pytest.approx(4.0, rel=0.1)


def test_a_settled_matrix_has_the_same_steps() -> None:
    """Another order of elimination changes a step by round-off only."""
    nlp, numbers = pendulum_like()
    solver = RealTimeInteriorPoint(nlp, numbers, barrier=1e-2)
    point = solver.at(np.array([0.5, 0.6, 0.0, 0.1]))
    solver.prepare(point)
    before = solver.step().iterate.x
    solver.settle(point)
    solver.prepare(point)
    assert solver.step().iterate.x == pytest.approx(before, abs=1e-12)


def test_the_sensitivity_is_that_of_the_solution() -> None:
    """Derivatives by the fixed variable are those of solutions on both sides of it."""
    nlp, numbers = pendulum_like()
    solver = RealTimeInteriorPoint(nlp, numbers, barrier=1e-2)
    point = solved(solver, np.array([0.5, 0.6, 0.0, 0.1]))
    solver.prepare(point)
    found = solver.sensitivity(np.array([1, 2, 3]), np.array([0])).ravel()
    sides = [solved(solver, point.x + np.array([d, 0.0, 0.0, 0.0])).x[1:] for d in (1e-4, -1e-4)]
    assert found == pytest.approx((sides[0] - sides[1]) / 2e-4, abs=1e-5)


def test_a_bound_gives_way_where_equations_leave_no_choice() -> None:
    """Equations that contradict a bound are met all the same, the bound by no more than it has to be violated."""
    nlp, numbers = pendulum_like()
    solver = RealTimeInteriorPoint(nlp, numbers, barrier=1e-4)
    far = np.array([2.5, 0.6, 0.0, 0.1])
    found = solved(solver, far).x
    of_rows, of_bounds = solver.violation(found)
    assert of_rows < 1e-9
    assert of_bounds == pytest.approx(0.3, abs=1e-2)  # x_1 >= 2.5 - 1, and at most 1.2


def test_other_numbers_move_the_bounds() -> None:
    """A program with other numbers has the solution of a solver that was made for them."""
    nlp, numbers = pendulum_like()
    other = NlpNumbers(
        numbers.lower, np.array([0.5, 0.9, INF, INF]), np.array([0.1, -0.2]), np.array([0.1, INF]), np.array([1.5])
    )
    solver = RealTimeInteriorPoint(nlp, numbers)
    start = np.array([0.5, 0.6, 0.0, 0.1])
    before = solved(solver, start).x
    solver.renumber(other)
    found = solved(solver, start).x
    assert np.abs(found - before).max() > 0.1
    assert found == pytest.approx(solved(RealTimeInteriorPoint(nlp, other), start).x, abs=1e-9)


def test_what_has_passed_stays() -> None:
    """Variables that have passed keep their values, whatever earlier rows say; the rest is solved as if alone."""
    x, p = ca.SX.sym("x", 4), ca.SX.sym("p", 0)
    f = ca.sumsqr(x - ca.DM([1, 2, 3, 4]))
    g = ca.vertcat(x[1] - 2 * x[0], x[2] - 2 * x[1], x[3] - 2 * x[2])
    numbers = NlpNumbers(
        np.array([0.1, -INF, -INF, -INF]), np.array([0.1, INF, 5.0, INF]), np.zeros(3), np.zeros(3), np.zeros(0)
    )
    solver = RealTimeInteriorPoint(program(x, p, f, g), numbers)
    assert solved(solver, np.array([0.1, 1.0, 1.0, 1.0]), 5).x == pytest.approx([0.1, 0.2, 0.4, 0.8], abs=1e-9)
    passed = np.array([True, True, False, False])
    solver.restrict(passed, np.array([], dtype=int))
    at = np.array([0.1, 0.7, 0.0, 0.0])  # the first row does not hold any more
    found = solved(solver, at, 5)
    assert found.x == pytest.approx([0.1, 0.7, 1.4, 2.8], abs=1e-9)
    assert solver.violation(found.x)[0] < 1e-12
    solver.analyse(passed, np.array([], dtype=int))
    assert solved(solver, at, 5).x == pytest.approx(found.x, abs=1e-12)


def test_rows_are_held_and_shifted() -> None:
    """A row that is held keeps its value at a point, a shifted one has its own and an amount."""
    x, p = ca.SX.sym("x", 2), ca.SX.sym("p", 0)
    numbers = NlpNumbers(np.full(2, -INF), np.full(2, INF), np.zeros(1), np.zeros(1), np.zeros(0))
    solver = RealTimeInteriorPoint(program(x, p, ca.sumsqr(x), x[0] - x[1]), numbers)
    solver.hold(np.array([0]), np.array([3.0, 1.0]))
    assert solved(solver, np.zeros(2), 3).x == pytest.approx([1.0, -1.0])
    solver.shift(np.array([0]), 1.0)
    assert solved(solver, np.zeros(2), 3).x == pytest.approx([0.5, -0.5])
