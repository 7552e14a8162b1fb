"""Problems of peers, posed anew: what a motion is worth, a T's sides, and a program's word beside the equations."""

from __future__ import annotations

import stat
from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from scripts.benchmarks import _crisp, _peer_page
from scripts.benchmarks._impact import PROBLEMS
from scripts.benchmarks._peer_problems import MIDDLE, SQUARE, Motion
from scripts.benchmarks.compare_peers import PEERS, by_peer, crisp_motion, impact_motion, main

CART, PUSH_T = (PROBLEMS[name] for name in ("impact_cart", "impact_push_t"))
TRANSPORT = _crisp.PROBLEMS["crisp_transport, 0 to 0 m, -3 to 0 m/s"]
CASES = {**PROBLEMS, **dict(list(_crisp.PROBLEMS.items())[:46:15])}


def _ridden(force: float) -> Motion:
    """Return a cart that is pulled by a force, N, with its cargo at rest on it, by explicit Euler."""
    k = np.arange(CART.steps + 1)
    rate = force / 0.3
    places, speeds = rate * CART.step**2 * k * (k - 1) / 2, rate * CART.step * k
    controls = np.tile([0.1 * rate, force, 0.0, 0.0], (CART.steps, 1))
    return np.column_stack([places, places, speeds, speeds]), controls


def test_a_cargo_that_rests_on_its_cart_violates_nothing_and_costs_what_a_hand_sum_says() -> None:
    """Both have the acceleration u / (m1 + m2) while friction m1 u / (m1 + m2) stays below its limit."""
    states, controls = _ridden(0.3)
    judged = CART.judged(states, controls)
    assert max(judged.violation, judged.product) < 1e-12
    place, speed = 0.02**2 * 300 * 299 / 2, 0.02 * 300
    last = 5000 * ((place - 1) ** 2 + place**2 + 2 * speed**2)
    assert judged.objective == pytest.approx(last + 1e-6 * 300 * (0.1**2 + 0.3**2))


def test_places_of_semi_implicit_euler_follow_the_velocities_after_a_step() -> None:
    """CRISP's cart that is braked by 3 N has v = k h u / 3 - 3 and x = 3 + h sum v of all steps that were made."""
    k = np.arange(TRANSPORT.steps + 1)
    speeds = -3.0 + 0.02 * k
    places = 3.0 + 0.02 * np.concatenate([[0.0], np.cumsum(speeds[1:])])
    states = np.column_stack([places, places, speeds, speeds])
    judged = TRANSPORT.judged(states, np.tile([1.0, 3.0, 0.0, 0.0], (TRANSPORT.steps, 1)))
    assert max(judged.violation, judged.product) < 1e-12
    missed = np.array([places[-1], places[-1], speeds[-1], speeds[-1]])
    assert judged.objective == pytest.approx(missed**2 @ [1e5, 1e5, 10, 10] + 1e-4 * 199 * (1 + 9))


def test_a_cargo_may_not_leave_its_bed_at_the_end_either() -> None:
    """CRISP's cargo is 0.25 m beyond its bed in the last state alone: nothing in the MPCC is worse than that."""
    problem = replace(TRANSPORT, step=1.0, guess=np.zeros((2, 4)), start=(0.75, 0, 0.5, 0))
    states, controls = np.array([[0.75, 0, 0.5, 0], [1.25, 0, 0.5, 0]]), np.array([[0.0, 0, 0.5, 0]])
    free = replace(problem, stage=replace(_crisp.CART, ahead=0.0, friction=0.0).stage)
    assert free.judged(states, controls).violation == pytest.approx(0.25)
    assert free.mpcc().residuals(np.r_[states.ravel(), controls.ravel()]).constraint_violation == pytest.approx(0.25)
    assert replace(free, ends=lambda x: ca.SX(0, 1)).judged(states, controls).violation < 1e-12


@pytest.mark.parametrize(
    ("force", "at", "by", "violation", "product"),
    [
        (0.3, (slice(None), 0), 0.125, 0.125, 0.0),
        (0.6186, (0, 0), 0.0, 0.01, 0.0),
        (0.3, (slice(None), slice(0, 2)), 0.25, 0.25, 0.0),
    ],
)
def test_what_is_wrong_is_measured(
    force: float, at: tuple[object, object], by: float, violation: float, product: float
) -> None:
    """A start 0.125 m or 0.25 m off, and friction 0.01 N beyond 0.1962 N, are violations of just that."""
    states, controls = _ridden(force)
    states[at] += by
    judged = CART.judged(states, controls)
    assert judged.violation == pytest.approx(violation, abs=1e-9)
    assert judged.product == pytest.approx(product, abs=1e-12)


def test_slip_both_ways_is_a_product() -> None:
    """Slips of 0.5 m/s forwards and backwards cancel in the equation, and their product 0.25 is what is wrong."""
    states, controls = _ridden(0.3)
    controls[7, 2:] = 0.5
    judged = CART.judged(states, controls)
    assert judged.violation < 1e-12
    assert judged.product >= 0.25 - 1e-12


@pytest.mark.parametrize("name", CASES)
def test_problem_and_judgement_agree_anywhere(name: str) -> None:
    """The MPCC that is solved and the recomputation, written apart, have one objective and one violation."""
    problem = CASES[name]
    mpcc = problem.mpcc()
    w = np.random.default_rng(1).normal(size=mpcc.size)
    judged, residuals = problem.judged(*problem.parts(w)), mpcc.residuals(w)
    assert judged.objective == pytest.approx(residuals.objective)
    assert judged.violation == pytest.approx(residuals.constraint_violation)


def test_places_on_a_side_of_the_t_have_no_gap_to_it_and_others_have() -> None:
    """Of the middle of each side the gap to that side is zero, and every gap is at least zero anywhere on the T."""
    top, under, foot = ((line - MIDDLE) * SQUARE for line in (4, 3, 0))
    wide, narrow, between = 2 * SQUARE, SQUARE / 2, (3.5 - MIDDLE) * SQUARE
    middles = [(0, top), (wide, between), (1.2 * SQUARE, under), (narrow, 0), (0, foot)]
    middles += [(-narrow, 0), (-1.2 * SQUARE, under), (-wide, between)]
    x, u = ca.SX.sym("x", 3), ca.SX.sym("u", len(PUSH_T.weights))
    sides = ca.Function("sides", [x, u], [PUSH_T.stage(x, u).H[7:15], PUSH_T.stage(x, u).zero])

    def gaps(place: tuple[float, ...]) -> np.ndarray:
        beyond = -np.asarray(sides(np.zeros(3), np.r_[place, np.zeros(len(PUSH_T.weights) - 2)])[1]).ravel()
        found, zero = sides(np.zeros(3), np.r_[place, np.zeros(8), np.maximum(beyond, 0), np.maximum(-beyond, 0)])
        assert np.abs(np.asarray(zero)).max() < 1e-15
        return np.asarray(found).ravel()

    for k, middle in enumerate(middles):
        assert np.abs(gaps(middle)[k]) < 1e-12
    places = np.random.default_rng(2).uniform((-wide, foot), (wide, top), size=(50, 2))
    assert min(gaps(tuple(place)).min() for place in places) > -1e-12


def _program(folder: Path, objective: float) -> None:
    """Write a program in the place of IMPACT's for the cart, which moves nothing and prints an objective."""
    file = folder / CART.program
    file.parent.mkdir()
    rows = "\n".join(["0 0 0 0"] * 301) + "\n\n# Control Trajectory (f, u, v, w)\n" + "\n".join(["0 0 0 0"] * 300)
    words = f"Converged: YES\nObjective value: {objective}\nTotal inner iterations: 7\nSolve time: 0.5 seconds\n"
    script = f"""#!/bin/sh
printf '# State Trajectory (x1, x2, x1_dot, x2_dot)\n{rows}\n' > "$9"
printf '{words}'
"""
    file.write_text(script, encoding="utf-8")
    file.chmod(file.stat().st_mode | stat.S_IXUSR)


def test_a_program_that_prints_another_objective_than_its_motion_has_is_not_believed(tmp_path: Path) -> None:
    """A cart that stays misses its goal by a metre, which costs 5000: what is printed has to say so."""
    _program(tmp_path, 5000.0)
    numbers, (states, controls) = by_peer(PEERS["impact"], CART, tmp_path)
    assert (numbers["objective"], numbers["missed"], numbers["iterations"]) == (5000.0, 1.0, 7)
    assert (states.shape, controls.shape) == ((301, 4), (300, 4))
    (tmp_path / CART.program).unlink()
    (tmp_path / CART.program).parent.rmdir()
    _program(tmp_path, 4900.0)
    with pytest.raises(SystemExit, match="printed the objective 4900, expected 5000"):
        by_peer(PEERS["impact"], CART, tmp_path)


def test_a_motion_is_read_as_it_is_written() -> None:
    """IMPACT's states and controls come after titles; CRISP's in one column, of the transport slips before forces."""
    text = "# Success\n1\n\n# State Trajectory (rows: a)\n0 1\n2 3\n\n# Control Trajectory (rows: b)\n4\n"
    states, controls = impact_motion(CART, text)
    assert states.tolist() == [[0, 1], [2, 3]]
    assert controls.tolist() == [[4]]
    column = np.tile([1, 2, 3, 4, 0.5, 0.25, 7, 8], TRANSPORT.steps + 1)
    states, controls = crisp_motion(TRANSPORT, "\n".join(map(str, column)))
    assert states.tolist() == [[1, 2, 3, 4]] * (TRANSPORT.steps + 1)
    assert controls.tolist() == [[7, 8, 0.5, 0.25]] * TRANSPORT.steps


def test_a_t_of_crisp_counts_its_angle_from_the_start() -> None:
    """Sine and cosine alone are given there, so that all angles may be off by the same number of turns."""
    problem = _crisp.PROBLEMS["crisp_push_t"]
    values = np.zeros((problem.steps + 1, 29))
    values[:, :3], values[:, 2] = problem.start, problem.start[2] - 4 * np.pi
    values[:, 3:29] = np.arange(26)
    states, controls = crisp_motion(problem, " ".join(map(str, values.ravel())))
    assert np.abs(states - problem.start).max() < 1e-12
    place, forces, above, below = np.split(controls[0], [2, 10, 17])
    assert (place.tolist(), forces.tolist()) == ([0, 1], list(range(16, 24)))
    assert (above.tolist(), below.tolist()) == (list(range(2, 16, 2)), list(range(3, 17, 2)))


def test_a_case_that_is_not_there_is_named(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """An unknown case ends the command with the ones that there are."""
    with pytest.raises(SystemExit):
        main(["impact", str(tmp_path), "impact_bx"])
    assert "found 'impact_bx', expected one of impact_cart" in capsys.readouterr().err


def test_the_box_is_solved_exactly_and_below_what_impact_reports() -> None:
    """From the same guess the MPCC solver ends at an exact, certified solution that costs less than 0.00795."""
    found, judged = PROBLEMS["impact_box"].solved(PROBLEMS["impact_box"].mpcc())
    assert found.solution.exact
    assert found.certificate is not None
    assert found.certificate.b_stationary == "certified"
    assert max(judged.violation, judged.product) < 1e-9
    assert judged.objective < _peer_page.known("impact")["impact_box"]["peer"]["objective"]


@pytest.mark.parametrize("peer", PEERS)
def test_the_page_says_of_the_runs_what_they_are(peer: str) -> None:
    """Every problem has its runs, exact ones of the MPCC solver, which alone leaves nothing but a disk where it is."""
    runs = _peer_page.known(peer)
    assert list(runs) == list(PEERS[peer].problems)
    assert all(each["mpcc"]["solved"] and each["mpcc_from_peer"]["solved"] for each in runs.values())
    stays = [case for case, each in runs.items() if each["mpcc"]["objective"] > 3 * each["peer"]["objective"]]
    assert stays == (["impact_disk"] if peer == "impact" else [])
    if peer == "crisp":
        dear = [case for case, each in runs.items() if each["mpcc"]["objective"] > 1.1 * each["peer"]["objective"]]
        assert dear == [f"crisp_push_box, {degrees} degrees" for degrees in range(220, 360, 20)]
    page = _peer_page.file_of(peer).with_name("public_tasks.md").read_text(encoding="utf-8")
    assert all(f"| {case} | {each['peer']['objective']:.5g}" in page for case, each in runs.items())
