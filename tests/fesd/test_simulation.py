"""What a simulation returns besides states: phases, switch times, dense output, quadratures, reports, and errors."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from fesd_robot.dcs import ComplementaritySystem, Model, Subsystem, stewart
from fesd_robot.errors import DimensionError, ModelError, OptionError
from fesd_robot.fesd import FesdOptions, SimulationError, SimulationSettings, StepReport, make_tableau, simulate
from fesd_robot.fesd.tableau import Scheme

from .systems import driven, leaving, oscillator, scalar

ROOT = np.sqrt(2) - 1


def test_phases_cover_the_horizon() -> None:
    """Phases follow each other without a gap, and end where the switches are: at √2 - 1 and at 1."""
    simulation = simulate(leaving(), np.array([-0.5, 0.0]), 5, 2.0)
    assert simulation.switch_times == pytest.approx([ROOT, 1.0], abs=1e-12)
    phases = simulation.phases
    assert [phase.start for phase in phases] == pytest.approx([0, ROOT, 1.0], abs=1e-12)
    assert [phase.end for phase in phases] == pytest.approx([ROOT, 1.0, 2.0], abs=1e-12)
    assert [int(phase.mode.sum()) for phase in phases] == [1, 2, 1]  # one side of alpha active, both while sliding
    assert len({phase.regions for phase in phases}) == 3


@pytest.mark.parametrize(("scheme", "stages"), [("radau_iia", 2), ("gauss_legendre", 2), ("lobatto_iiic", 3)])
def test_dense_output_inside_elements(scheme: Scheme, stages: int) -> None:
    """Between the steps the state is that of the scheme's polynomial: exact for the quadratic arcs of the slider."""
    if scheme == "lobatto_iiic":
        simulation = simulate(scalar("crossing"), np.array([-1.0]), 3, 2.0, options=_options(scheme, stages))
        times = np.linspace(0, 2, 41)
        exact = np.where(times < 1 / 3, -1 + 3 * times, times - 1 / 3)
        assert simulation.at(times)[:, 0] == pytest.approx(exact, abs=1e-12)
        return
    simulation = simulate(leaving(), np.array([-0.5, 0.0]), 5, 2.0, options=_options(scheme, stages))
    times = np.linspace(0, 2, 41)
    exact = np.select([times < ROOT, times < 1.0], [-0.5 + times + times**2 / 2, 0.0], (times - 1) ** 2 / 2)
    assert simulation.at(times) == pytest.approx(np.column_stack([exact, times]), abs=1e-12)
    assert simulation.at(simulation.times) == pytest.approx(simulation.states, abs=1e-14)


def test_dense_output_ends_with_the_horizon() -> None:
    """A time after the end is refused."""
    simulation = simulate(scalar("crossing"), np.array([-1.0]), 2, 2.0)
    with pytest.raises(ModelError, match=r"time 2\.1 is outside the simulation, 0 to 2"):
        simulation.at([0.5, 2.1])


def test_quadratures_are_integrals() -> None:
    """The integral of x² over the crossing is (x0³ split at 1/3): 1/9 before and (5/3)³/3 after."""
    system = scalar("crossing")
    with_cost = replace(system, quadratures={"square": system.state**2, "time": ca.SX(1)})
    simulation = simulate(with_cost, np.array([-1.0]), 4, 2.0)
    assert simulation.quadratures["square"][-1] == pytest.approx(1 / 9 + (5 / 3) ** 3 / 3, abs=1e-12)
    assert simulation.quadratures["time"] == pytest.approx(simulation.times, abs=1e-12)


def test_reports_follow_the_steps() -> None:
    """Progress is reported once a step, with the method, the switches and a residual at round-off."""
    reported: list[StepReport] = []
    simulation = simulate(leaving(), np.array([-0.5, 0.0]), 5, 2.0, progress=reported.append)
    assert reported == simulation.reports
    assert [report.step for report in reported] == list(range(5)) and {report.steps for report in reported} == {5}
    assert [report.time for report in reported] == pytest.approx([0.4, 0.8, 1.2, 1.6, 2.0])
    assert [report.switches for report in reported] == [0, 1, 1, 0, 0]
    assert {report.method for report in reported} == {"modes"}
    assert max(report.residual for report in reported) <= 1e-14


def test_complementarity_is_exact() -> None:
    """Of every pair one side vanishes to round-off at all points of an element, and no side is negative."""
    system = oscillator()
    simulation = simulate(system, np.array([np.exp(-1), 0.0]), 34, np.pi / 2)
    sides = ca.Function("sides", [system.algebraic], [system.G, system.H])
    for element in simulation.elements:
        G, H = (
            np.array([np.asarray(side).ravel() for side in part]) for part in zip(*map(sides, element.z), strict=True)
        )
        assert np.minimum(G.sum(axis=0), H.sum(axis=0)).max() <= 1e-13
        assert min(G.min(), H.min()) >= -1e-13


def test_a_failing_step_keeps_what_was_computed() -> None:
    """The error carries step, time, state and residual, and the elements before it."""
    with pytest.raises(SimulationError) as caught:
        simulate(scalar("sliding"), np.array([1.0]), 2, 1.0, settings=SimulationSettings(state_lower=np.array([0.25])))
    error = caught.value
    assert (error.step, error.time, error.state.tolist()) == (1, 0.5, [0.5])
    assert error.residual == pytest.approx(0.25)
    assert "its motion takes x to 0, beyond state_lower 0.25" in str(error)
    assert error.simulation.states.ravel().tolist() == [1.0, 0.5] and error.simulation.times.tolist() == [0.0, 0.5]
    assert len(error.simulation.elements) == 2 and len(error.simulation.reports) == 1
    assert "simulation step 1 at time 0.5 was not solved" in str(error) and "state [0.5]" in str(error)


def _options(scheme: Scheme = "radau_iia", stages: int | None = 2, **changes: Any) -> FesdOptions:
    return FesdOptions(**{"tableau": make_tableau(scheme, stages), "elements": 2, **changes})


def _simulate(system: ComplementaritySystem, **changes: Any) -> None:
    arguments: dict[str, Any] = {"initial": np.array([1.0, 0.0]), "controls": np.zeros((1, 3)), "duration": 1.0}
    arguments |= {"parameters": np.array([0.0]), **changes}
    simulate(system, **arguments)


@pytest.mark.parametrize(
    ("changes", "kind", "message"),
    [
        ({"initial": np.array([np.nan, 0])}, ModelError, r"initial\[0\] of a is nan, must be finite"),
        ({"controls": np.array([[0, np.inf]])}, ModelError, r"controls\[0, 1\] of push is inf, must be finite"),
        ({"parameters": np.array([np.inf])}, ModelError, r"parameters\[0\] is inf, must be finite"),
        ({"parameters": None}, DimensionError, r"parameters has shape \(0,\), expected \(1,\)"),
        ({"controls": np.zeros((1, 0))}, ModelError, "empty horizon: 0 steps over a duration of 1"),
        ({"duration": 0.0}, ModelError, "empty horizon: 3 steps over a duration of 0"),
        ({"duration": -1.0}, ModelError, "need at least one step and a positive duration"),
        ({"controls": 3}, DimensionError, r"controls is the number 3, expected an array of shape \(1, steps\)"),
        (
            {"settings": SimulationSettings(state_upper=np.ones(3))},
            DimensionError,
            r"state_upper has shape \(3,\), expected \(2,\)",
        ),
        ({"options": FesdOptions(elements=(1, 2, 1))}, DimensionError, r"needs one number of elements .* \(1, 2, 1\)"),
    ],
)
def test_bad_input_is_named(changes: dict[str, Any], kind: type[Exception], message: str) -> None:
    """Every bad argument ends in our own exception with its name and what would be valid."""
    with pytest.raises(kind, match=message):
        _simulate(driven(), **changes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"step_equilibration": "bogus"}, r"step_equilibration is 'bogus' \(valid: .*direct.*mean"),
        ({"step_equilibration": "diference"}, r"step_equilibration is 'diference' \(did you mean 'difference'"),
        ({"cross_complementarity": "sum"}, r"cross_complementarity is 'sum' \((valid|did)"),
        ({"form": "diff"}, r"form is 'diff' \(valid: differential, integral, lifted\)"),
        ({"tableau": "radau_iia"}, "tableau: found the text 'radau_iia', expected a Tableau"),
    ],
)
def test_values_that_are_no_option_are_named(changes: dict[str, Any], message: str) -> None:
    """A name or number that does not exist is refused when options are made, with what would be valid."""
    with pytest.raises(OptionError, match=message):
        _options(**changes)


@pytest.mark.parametrize("elements", [0, (), (2, 0)])
def test_a_number_of_elements_is_at_least_one(elements: Any) -> None:
    """Elements are counted: no number below one, no empty list."""
    with pytest.raises(DimensionError, match="one positive number per interval, or one for all, found"):
        _options(elements=elements)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"options": make_tableau("radau_iia", 2)},
            "options: found a value of type Tableau, expected a FesdOptions",
        ),
        (
            {"settings": FesdOptions()},
            "settings: found a value of type FesdOptions, expected a SimulationSettings",
        ),
    ],
)
def test_arguments_of_another_type_are_named(changes: dict[str, Any], message: str) -> None:
    """What is passed in place of something else is named with what belongs there."""
    with pytest.raises(OptionError, match=message):
        _simulate(driven(), **changes)


def test_bad_options_are_named() -> None:
    """Forms that a scheme does not have and numbers outside their range are refused."""
    with pytest.raises(ModelError, match=r"form 'integral' needs a collocation scheme .* lobatto_iiic is not"):
        _options("lobatto_iiic", 3, form="integral")
    with pytest.raises(ModelError, match="equilibration_width positive, found 1, 1 and 0"):
        _options(equilibration_width=0.0)


def test_a_bound_on_the_steps_is_named() -> None:
    """Where the modes need a longer element than the options allow, the error says which bound that is."""
    options = _options(elements=3, step_freedom=0.0)
    with pytest.raises(
        SimulationError, match=r"need an element of length 0\.4333, longer than .* step_freedom 0 allows"
    ):
        simulate(scalar("crossing"), np.array([-1.3]), 1, 1.0, options=options)


def test_an_impact_is_not_passed_over() -> None:
    """A mass meets the floor and comes to rest within one step: the end of the impact is found, not slid over."""
    state = ca.SX.sym("state", 3)  # height, speed, clock
    flight, floor = ca.vertcat(state[1], -10, 1), ca.vertcat(0, 10, 0)
    signs = np.array([[1, 0], [-1, 1], [-1, -1]])
    regions = Subsystem(
        switching=state[:2], sign_matrix=signs, fields=ca.horzcat(flight, flight, floor), name="contact"
    )
    for stages in (1, 2, 3):
        simulation = simulate(
            stewart(Model(state), regions), np.array([0.0, -1.0, 0.0]), 1, 0.17,
            options=_options(stages=stages),
        )  # fmt: skip
        assert simulation.switch_times == pytest.approx([0.1], abs=1e-12)
        assert simulation.states[-1] == pytest.approx([0.0, 0.0, 0.035], abs=1e-12)


def test_too_few_elements_are_named() -> None:
    """One element cannot hold a switch, and the error says that it is the elements that are missing."""
    with pytest.raises(SimulationError, match="its switches need more than the 1 elements of a step"):
        simulate(scalar("crossing"), np.array([-1.0]), 1, 1.0, options=_options(elements=1))
