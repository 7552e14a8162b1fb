"""The MPCC of an optimal control problem: where its variables sit, what its rows say, and the way back."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np
import pytest

from fesd_robot.errors import DimensionError
from fesd_robot.fesd import (
    FesdOptions,
    Form,
    OptimalControlProblem,
    Scheme,
    Transcription,
    initial_value_problem,
    make_tableau,
)

from .systems import driven, scalar

N_X, N_Z, N_U = 2, 7, 1
ELEMENTS = (1, 3, 1)
SCHEMES = [("radau_iia", 2), ("gauss_legendre", 2), ("radau_iia", 1)]


def _ocp() -> OptimalControlProblem:
    """Three intervals of the driven system with costs, bounds, and an end condition on every interval."""
    system = driven()
    x, u, z, p = system.arguments
    return OptimalControlProblem(
        system=system,
        duration=1.5,
        intervals=3,
        parameters=np.array([[0.1, 0.2, 0.3]]),
        initial_lower=np.array([1.0, -1.0]),
        initial_upper=np.array([1.0, 0.5]),
        state_lower=np.full(2, -5.0),
        state_upper=np.full(2, 6.0),
        terminal_lower=np.array([2.0, -np.inf]),
        terminal_upper=np.array([2.5, np.inf]),
        control_lower=np.array([-3.0]),
        control_upper=np.array([4.0]),
        state_guess=lambda time: np.array([1 + time, -9.0]),
        control_guess=np.array([[0.5, 9.0, -0.5]]),
        running_cost={"state": ca.sumsqr(x) + p, "control": z[0] * u**2},
        terminal_cost={"goal": x[0] ** 4, "speed": x[1] ** 2},
        interval_end=x[1] - p,
        interval_end_names=("meet",),
    )


def _transcription(scheme: str = "radau_iia", stages: int = 2, **options: Any) -> Transcription:
    chosen: dict[str, Any] = {"tableau": make_tableau(scheme, stages), "elements": ELEMENTS}  # type: ignore[arg-type]
    return Transcription(_ocp(), FesdOptions(**{**chosen, **options}))


@pytest.fixture(params=SCHEMES, ids=lambda pair: f"{pair[0]}-{pair[1]}")
def transcription(request: pytest.FixtureRequest) -> Transcription:
    return _transcription(*request.param)


def _points(transcription: Transcription) -> int:
    tableau = transcription.options.tableau
    return tableau.stages + (not tableau.ends_at_stage)


def test_sizes(transcription: Transcription) -> None:
    """Variables, rows and pairs are counted by intervals, elements and points."""
    problem, points, stages = transcription.problem, _points(transcription), transcription.options.tableau.stages
    point, elements = N_X + N_Z, sum(ELEMENTS)
    assert problem.size == point + len(ELEMENTS) * N_U + elements * (1 + points * point)
    residuals_per_point = 2 + 1  # two steps, one lifted product
    assert problem.constraints == residuals_per_point + elements * points * (N_X + residuals_per_point) + 2 * 3
    assert problem.pairs == 4 + elements * 4 * points  # lambda_sum: one pair a component and point
    assert stages <= points


@pytest.mark.parametrize(("mode", "pairs"), [("stage_stage", 6), ("lambda_sum", 2), ("theta_sum", 3), ("sum_sum", 1)])
def test_pairs_by_aggregation(mode: str, pairs: int) -> None:
    """The aggregation chooses how many pairs an element has, for each of the four components."""
    assert _transcription(cross_complementarity=mode).problem.pairs == 4 + sum(ELEMENTS) * 4 * pairs


def test_unpack_is_the_inverse_of_the_layout(transcription: Transcription) -> None:
    """Elements in time order, each u, h, (x, z)..., give the vector back; every variable is read."""
    w = np.arange(transcription.problem.size, dtype=float)
    elements = transcription.unpack(w)
    parts = [elements[0].x_left, elements[0].z_left]
    for k, element in enumerate(elements):
        if k == 0 or elements[k - 1].interval != element.interval:
            parts.append(element.u)
        parts.append(np.array([element.step]))
        for x, z in zip(element.x, element.z, strict=True):
            parts += [x, z]
    assert np.concatenate(parts).tolist() == w.tolist()
    assert tuple(sum(e.interval == k for e in elements) for k in range(3)) == ELEMENTS
    for before, after in pairwise(elements):
        assert after.x_left.tolist() == before.x[-1].tolist()
        assert after.z_left.tolist() == before.z[-1].tolist()
        assert after.start == before.start + before.step
    assert transcription.controls(w).tolist() == [[next(e.u[0] for e in elements if e.interval == k) for k in range(3)]]


def test_bounds_and_start(transcription: Transcription) -> None:
    """Initial, stage, control, step and terminal bounds sit on their variables; the start lies within all of them."""
    problem = transcription.problem
    lower, upper, start = (transcription.unpack(values) for values in (problem.lower, problem.upper, problem.start))
    assert lower[0].x_left.tolist() == [1, -1] and upper[0].x_left.tolist() == [1, 0.5]
    for low, high, element in zip(lower, upper, start, strict=True):
        count = ELEMENTS[element.interval]
        assert (low.u.tolist(), high.u.tolist()) == ([-3], [4])
        assert (low.step, high.step) == (0, pytest.approx(2 * 0.5 / count))
        assert element.step == pytest.approx(0.5 / count)
        assert low.z[:, :2].min() == 0 and high.z[:, :2].max() == 1
        is_last = element is start[-1]
        inner = low.x[: len(low.x) - is_last], high.x[: len(high.x) - is_last]
        assert (inner[0] == -5).all() and (inner[1] == 6).all()
        # The guess -9 of the second state and 9 of the second control lie outside their bounds.
        assert (element.x[:, 1] == -5).all()
    assert (lower[-1].x[-1].tolist(), upper[-1].x[-1].tolist()) == ([2, -5], [2.5, 6])
    assert transcription.controls(problem.start).tolist() == [[0.5, 4, -0.5]]
    times = np.concatenate([e.start + e.step * _fractions(transcription) for e in start])
    expected = np.clip(1 + times, -5, 6)
    assert np.concatenate([e.x[:, 0] for e in start])[:-1] == pytest.approx(expected[:-1])
    assert (problem.start >= problem.lower).all() and (problem.start <= problem.upper).all()


def _fractions(transcription: Transcription) -> np.ndarray:
    tableau = transcription.options.tableau
    return tableau.c if tableau.ends_at_stage else np.append(tableau.c, 1.0)


def test_fixed_steps() -> None:
    """Without step freedom every step is its equal share."""
    problem = _transcription(step_freedom=0.0).problem
    transcription = _transcription(step_freedom=0.0)
    for values in (problem.lower, problem.upper):
        assert [e.step for e in transcription.unpack(values)] == pytest.approx([0.5, *[0.5 / 3] * 3, 0.5])


@pytest.mark.parametrize("equilibration", ["mean", "difference", "none"])
@pytest.mark.parametrize(("scheme", "stages"), SCHEMES)
def test_cost_terms_are_the_objective(scheme: str, stages: int, equilibration: str) -> None:
    """At any point the named cost terms add up to the objective, and each is what its name says."""
    transcription = _transcription(scheme, stages, step_equilibration=equilibration, equilibration_weight=3.0)
    w = np.random.default_rng(5).normal(size=transcription.problem.size)
    terms = transcription.cost_terms(w)
    assert sum(terms.values()) == pytest.approx(transcription.problem.residuals(w).objective, rel=1e-12)
    elements, b = transcription.unpack(w), transcription.options.tableau.b
    parameter = [0.1, 0.2, 0.3]
    state = sum(e.step * b @ ((e.x[: len(b)] ** 2).sum(axis=1) + parameter[e.interval]) for e in elements)
    control = sum(e.step * b @ (e.z[: len(b), 0] * e.u[0] ** 2) for e in elements)
    alphas = [elements[0].z_left[:2], *[z[:2] for e in elements for z in e.z]]
    expected = {
        "state": state,
        "control": control,
        "regularisation of the step functions": 1e-2 * sum(float(a @ a) for a in alphas),
        "goal": elements[-1].x[-1, 0] ** 4,
        "speed": elements[-1].x[-1, 1] ** 2,
    }
    steps = [np.array([e.step for e in elements if e.interval == k]) for k in range(3)]
    if equilibration == "mean":
        expected["step equilibration"] = 3 * sum(((h - 0.5 / len(h)) ** 2).sum() for h in steps)
    elif equilibration == "difference":
        expected["step equilibration"] = 3 * sum((np.diff(h) ** 2).sum() for h in steps)
    assert terms == pytest.approx(expected, rel=1e-12)


def test_rows_have_names() -> None:
    """The worst row is reported with its equation, element, stage, state and interval."""
    transcription = _transcription()
    problem = transcription.problem
    block = problem.blocks[1]
    for name in (
        "dynamics [b], element 0, stage 2",
        "step functions [2], element 0, stage 1",
        "sum of steps",
        "end of interval [meet]",
    ):
        names = [str(label) for label in block.constraints]
        assert names.count(name) == 1, names
    assert str(problem.blocks[2].complementarities[0].label) == "lambda_n _|_ alpha [step0], element 0, stage 1"
    assert str(block.constraint_label(names.index("dynamics [b], element 0, stage 2"), 1)) == (
        "dynamics [b], interval 2, element 0, stage 2"
    )
    places = {str(place) for block in problem.blocks for place in block.places}
    assert places == {"the start", "interval 0", "interval 1", "interval 2", "the end"}


@pytest.mark.parametrize("elements", [(1, 2), (1, 2, 0), (2, 2, 2, 2), 0])
def test_bad_element_counts_are_refused(elements: Any) -> None:
    """One positive number per interval, or one for all."""
    with pytest.raises(DimensionError, match="elements must be one positive number per interval"):
        _ = replace(_transcription(), options=FesdOptions(elements=elements)).problem


def test_one_count_serves_all_intervals() -> None:
    """A single number and the tuple that repeats it give the same problem."""
    single, repeated = _transcription(elements=2).problem, _transcription(elements=(2, 2, 2)).problem
    assert (single.size, single.constraints, single.pairs) == (repeated.size, repeated.constraints, repeated.pairs)
    w = np.random.default_rng(0).normal(size=single.size)
    assert single.residuals(w) == repeated.residuals(w)


def _crossing(x0: float, steps: tuple[float, float], mode: str, scheme: str) -> tuple[Transcription, np.ndarray]:
    """x' = 2 - sign x from x0 over T = 2: two elements, alpha = 0 in the first and 1 in the second."""
    system = scalar("crossing")
    x = system.state
    ocp = OptimalControlProblem(
        system=system,
        duration=2.0,
        state_guess=lambda _: np.array([x0]),
        running_cost={"square": x**2},
        terminal_cost={"end": (x - 5 / 3) ** 2},
    )
    tableau = make_tableau(scheme, 2)  # type: ignore[arg-type]
    options = FesdOptions(
        tableau=tableau, elements=2, cross_complementarity=mode, step_equilibration="none", step_freedom=1.0
    )  # type: ignore[arg-type]
    transcription = Transcription(ocp, options)
    fractions = _fractions(transcription)

    def point(value: float, alpha: float) -> list[float]:
        return [value, alpha, max(-value, 0.0), max(value, 0.0)]

    w, left = point(x0, float(x0 > 0)), x0
    for step, slope, alpha in zip(steps, (3.0, 1.0), (0.0, 1.0), strict=True):
        w.append(step)
        for fraction in fractions:
            value = left + slope * step * fraction
            w += point(0.0 if abs(value) < 1e-14 else value, alpha)
        left += slope * step
    return transcription, np.array(w)


@pytest.mark.parametrize("scheme", ["radau_iia", "gauss_legendre"])
@pytest.mark.parametrize("mode", ["stage_stage", "lambda_sum", "theta_sum", "sum_sum"])
def test_an_exact_solution_solves_the_mpcc(mode: str, scheme: str) -> None:
    """A crossing that switches at an element boundary meets all rows and pairs; switched elsewhere it does not."""
    transcription, w = _crossing(-1.0, (1 / 3, 5 / 3), mode, scheme)
    residuals = transcription.problem.residuals(w)
    assert residuals.constraint_violation <= 1e-14 and residuals.complementarity == 0
    assert [e.step for e in transcription.unpack(w)] == [1 / 3, 5 / 3]
    for steps in ((0.4, 1.6), (0.2, 1.8)):
        late, moved = _crossing(-1.0, steps, mode, scheme)
        wrong = late.problem.residuals(moved)
        assert wrong.constraint_violation <= 1e-14
        assert wrong.complementarity >= 0.1


@pytest.mark.parametrize("scheme", ["radau_iia", "gauss_legendre"])
@pytest.mark.parametrize("x0", [-2.0, -1.75, -1.5, -1.25, -1.0, -0.8])
def test_the_cost_of_an_exact_solution_is_exact(x0: float, scheme: str) -> None:
    """∫ x² dt + (x(2) - 5/3)² of the piecewise linear solution is its closed form, at any x0 of the benchmark."""
    switch = -x0 / 3
    transcription, w = _crossing(x0, (switch, 2 - switch), "lambda_sum", scheme)
    value = -(x0**3) / 9 + (2 + x0 / 3) ** 3 / 3 + ((1 + x0) / 3) ** 2
    assert transcription.problem.residuals(w).objective == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize("form", ["integral", "differential", "lifted"])
@pytest.mark.parametrize(("scheme", "stages"), [("radau_iia", 2), ("gauss_legendre", 2)])
def test_pack_is_the_inverse_of_unpack(form: Any, scheme: Any, stages: int) -> None:
    """The elements of any point, packed, are that point again."""
    transcription = _transcription(scheme, stages)
    transcription = replace(transcription, options=replace(transcription.options, form=form))
    w = np.random.default_rng(3).uniform(0.1, 1.0, transcription.problem.size)
    assert transcription.pack(transcription.unpack(w)) == pytest.approx(w, abs=1e-14)
    with pytest.raises(DimensionError, match="2 elements for a problem with"):
        transcription.pack(transcription.unpack(w)[:2])


def test_bounds_of_states_that_are_no_variables() -> None:
    """In the differential form the bounds of the stage states are rows, and name what they bound."""
    transcription = _transcription()
    transcription = replace(transcription, options=replace(transcription.options, form="differential"))
    problem, plain = transcription.problem, _transcription(form="lifted").problem
    stages, elements = 2, sum(ELEMENTS)
    assert problem.constraints == plain.constraints - elements * stages * N_X + elements * (stages + 1) * N_X
    w = problem.start.copy()
    w[transcription.interval_variables(np.arange(problem.size), 0)[0][2 : 2 + N_X]] = 1e3  # K_1 of the first element
    residuals = problem.residuals(w)
    names = [str(label) for block in problem.blocks for label in block.constraints]
    assert any(name == "bound [a], element 0, stage 1" for name in names)
    assert residuals.constraint_violation > 1


@pytest.mark.parametrize("form", ["integral", "differential", "lifted"])
@pytest.mark.parametrize("scheme", ["radau_iia", "gauss_legendre"])
def test_every_variable_has_a_label(form: Form, scheme: Scheme) -> None:
    """Labels say what the variables are: steps and controls where the layout has them, states as they are unpacked."""
    options = FesdOptions(make_tableau(scheme, 2), elements=2, form=form)
    problem = initial_value_problem(driven(), [0.1, 0.2], 1.0, intervals=2, control=[0.3], parameters=[0.0])
    transcription = Transcription(problem, options)
    mpcc = transcription.problem
    values = dict(zip(map(str, mpcc.variables), np.arange(float(mpcc.size)), strict=True))
    assert len(values) == mpcc.size
    elements = transcription.unpack(np.arange(float(mpcc.size)))
    for number, element in enumerate(elements):
        interval, own = divmod(number, 2)
        assert element.step == values[f"step, interval {interval}, element {own}"]
        assert element.u[0] == values[f"control [push], interval {interval}"]
        place = f"interval {interval}, element {own}, stage 2"
        assert element.z[1, 0] == values[f"algebraic variable [alpha[step0]], {place}"]
        if form != "differential":
            assert element.x[1].tolist() == [values[f"state [{name}], {place}"] for name in ("a", "b")]
