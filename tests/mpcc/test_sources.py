"""MPCCs from files of the suites and from CasADi's `Opti`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

from fesd_robot.errors import ModelError
from fesd_robot.mpcc import PairPolisher, from_opti, read_casadi_json, solve


def _file(folder: Path, **changes: Any) -> Path:
    """A file as NOSBENCH has them: min (w0 - p)^2 + w1^2 s.t. w0 + w1 <= 3, 0 <= w0 complementary to w1 >= 0."""
    w, p = ca.SX.sym("w", 2), ca.SX.sym("p")

    def serialized(value: ca.SX) -> str:
        return ca.Function("part", [w, p], [value]).serialize()

    data = {
        "w0": [1, 1],
        "lbw": [-1e20, -np.inf],
        "ubw": [np.inf, np.inf],
        "p": p.serialize(),
        "p0": [2.0],
        "g_fun": serialized(w[0] + w[1]),
        "lbg": -1e20,
        "ubg": [3.0],
        "G_fun": serialized(w[0]),
        "H_fun": serialized(w[1]),
        "augmented_objective_fun": serialized((w[0] - p) ** 2 + w[1] ** 2),
        **changes,
    }
    file = folder / "small.json"
    file.write_text(json.dumps({key: value for key, value in data.items() if value is not None}), encoding="utf-8")
    return file


def test_functions_and_bounds_of_a_file(tmp_path: Path) -> None:
    """Cost, rows and sides have the values that the file's functions have at p0; bounds of 1e20 are none."""
    problem = read_casadi_json(_file(tmp_path))
    f, g, G, H = (part.ravel() for part in problem.blocks[0].evaluate(np.array([5.0, 0.5])))
    assert (f, g) == (pytest.approx(9.25), pytest.approx(5.5)) and (G, H) == (5.0, 0.5)
    assert np.isinf([*problem.lower, *problem.upper, *problem.blocks[0].lower]).all()
    assert problem.residuals(np.array([4.0, 0.0])).constraint_violation == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"G_fun": None}, "small.json: G_fun is missing, expected a function serialized by CasADi"),
        ({"H_fun": "abc"}, "small.json: H_fun is no function serialized by CasADi"),
        ({"w0": "one"}, "small.json: w0 is one, expected a list of numbers"),
        ({"lbw": [0.0]}, None),
        ({"lbw": [0.0, 0.0, 0.0]}, "small.json: lbw has 3 numbers, expected 2"),
        ({"lbw": 1.0, "ubw": [2.0, 0.0]}, "small.json: lbw[1] is 1 and ubw[1] is 0, expected the upper bound"),
        ({"p0": [1.0, 2.0]}, "takes [2, 1] numbers, expected 2, and 2 of p0"),
        ({"w_0": [1.0]}, "small.json: unknown key 'w_0'"),
    ],
)
def test_wrong_files_say_what_is_expected(tmp_path: Path, changes: dict[str, Any], message: str | None) -> None:
    """The sentence names file, key, what was found and what would be valid; one number stands for a list."""
    file = _file(tmp_path, **changes)
    if message is None:
        assert (read_casadi_json(file).lower == 0).all()
        return
    with pytest.raises(ModelError) as caught:
        read_casadi_json(file)
    assert message in str(caught.value)


def test_files_that_are_none(tmp_path: Path) -> None:
    """A file that is missing, is no JSON or no object is named as such."""
    for name, text, message in (
        ("no.json", None, "No such file"),
        ("words.json", "words", "no JSON"),
        ("list.json", "[]", "found a list"),
    ):
        if text is not None:
            (tmp_path / name).write_text(text, encoding="utf-8")
        with pytest.raises(ModelError, match=f"{name}: .*{message}"):
            read_casadi_json(tmp_path / name)


@pytest.mark.parametrize(
    ("bounds", "root", "expected"),
    [
        ({"lbH": 0.0, "ubH": 2.0, "lbG": -1e20}, -1.0, 0.0),
        ({"lbH": 0.0, "ubH": 2.0, "lbG": -1e20}, 1.0, 1.0),
        ({"lbH": 0.0, "ubH": 2.0, "lbG": -1e20}, 3.0, 2.0),
        ({"lbH": 1.0, "ubH": 1.0, "lbG": -1e20}, 3.0, 1.0),
        ({"lbH": -1e20, "ubH": 2.0, "lbG": -1e20}, 3.0, 2.0),
        ({"lbH": -1e20, "ubH": 1e20}, 3.0, 3.0),
        ({"lbH": 1.0, "ubH": 2.0}, -3.0, 1.0),
    ],
)
def test_mixed_complementarity(tmp_path: Path, bounds: dict[str, float], root: float, expected: float) -> None:
    """A pair H = w0 within bounds, G = w0 - root, has the solution that mixed complementarity has: root, clipped."""
    w, p = ca.SX.sym("w", 2), ca.SX.sym("p")
    G, H, f = (ca.Function("part", [w, p], [part]).serialize() for part in (w[0] - root, w[0], w[1] ** 2))
    problem = read_casadi_json(_file(tmp_path, **bounds, G_fun=G, H_fun=H, augmented_objective_fun=f, ubg=100.0))
    solution = solve(problem, polisher=PairPolisher(problem))
    assert solution.solved and solution.w[0] == pytest.approx(expected, abs=1e-7)


def test_opti_is_the_problem_of_its_expressions() -> None:
    """Cost, rows, sides, bounds, parameters and start of an `Opti` are those that it was given."""
    opti = ca.Opti()
    x, p = opti.variable(2), opti.parameter()
    opti.minimize((x[0] - p) ** 2 + x[1])
    opti.subject_to(opti.bounded(-1, x[0] - 2 * x[1], p))
    opti.set_value(p, 3)
    opti.set_initial(x, [1, 2])
    problem = from_opti(opti, [(x, 1 - x)])
    f, g, G, H = (part.ravel() for part in problem.blocks[0].evaluate(np.array([1.0, 2.0])))
    assert (*f, *g, *G, *H) == (6, -3, 1, 2, 0, -1)
    assert (problem.blocks[0].lower, problem.blocks[0].upper) == (-1, 3) and problem.start.tolist() == [1, 2]


def test_opti_without_values_or_with_sides_of_two_shapes() -> None:
    """What is missing is named."""
    opti = ca.Opti()
    x, p = opti.variable(2), opti.parameter()
    opti.minimize(x[0] * p)
    with pytest.raises(ModelError, match="parameter has no value"):
        from_opti(opti, [(x, x)])
    with pytest.raises(ModelError, match=r"pair 0: G has shape \(2, 1\), H has shape \(1, 1\)"):
        from_opti(opti, [(x, x[0])])
