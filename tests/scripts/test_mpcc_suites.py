"""Rows of the suites: files checked without the solver's own functions, and what counts as solved."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

from scripts.benchmarks.mpcc_suites import checked, family_of, solved_row, write
from scripts.benchmarks.suites.page import far, page, solved


def _file(folder: Path, **changes: Any) -> Path:
    """Min (w0 - 1)^2 + (w1 - p)^2 with w0 + w1 <= 3, 0 <= w0 complementary to w1 >= 0, p = 2."""
    w, p = ca.SX.sym("w", 2), ca.SX.sym("p")
    parts = {"f_fun": (w[0] - 1) ** 2 + (w[1] - p) ** 2, "g_fun": w[0] + w[1], "G_fun": w[0], "H_fun": w[1]}
    functions = {key: ca.Function("part", [w, p], [part]).serialize() for key, part in parts.items()}
    numbers = {"w0": [1, 1], "lbw": [-10, -10], "ubw": [10, 1e20], "p0": [2], "lbg": [-1e20], "ubg": [3]}
    file = folder / "TWO_001_002.json"
    file.write_text(json.dumps({**functions, **numbers, **changes}), encoding="utf-8")
    return file


@pytest.mark.parametrize(
    ("bounds", "w", "violation", "product"),
    [
        ({}, (0.0, 2.0), 0.0, 0.0),
        ({}, (1.0, 3.0), 1.0, 3.0),
        ({}, (-0.5, 1.0), 0.5, 0.0),
        ({"lbH": 0, "ubH": 2, "lbG": -1e20}, (-1.0, 2.0), 0.0, 0.0),
        ({"lbH": 0, "ubH": 2, "lbG": -1e20}, (-1.0, 0.5), 0.0, 1.5),
        ({"lbH": -1e20, "ubH": 2}, (0.5, 1.0), 0.0, 0.5),
        ({"lbH": -1e20, "ubH": 1e20}, (0.25, 1.0), 0.0, 0.25),
    ],
)
def test_points_are_checked(
    tmp_path: Path, bounds: dict[str, float], w: tuple[float, float], violation: float, product: float
) -> None:
    """Violation and product are those of the file's functions and of mixed complementarity."""
    found = checked(_file(tmp_path, **bounds), np.array(w))
    assert found["violation"] == violation and found["product"] == product
    assert found["objective"] == (w[0] - 1) ** 2 + (w[1] - 2) ** 2


def test_a_file_becomes_a_row_of_the_page(tmp_path: Path) -> None:
    """The row of a solved file says so, is written and read, and stands in the table of its family."""
    given = argparse.Namespace(seconds=20.0, further=0, points=tmp_path / "points")
    row = solved_row(_file(tmp_path), given)
    assert solved(row) and row["b_stationary"] == "certified" and row["objective"] == pytest.approx(1.0)
    assert np.load(tmp_path / "points" / "TWO_001_002.npy") == pytest.approx([0.0, 2.0], abs=1e-6)
    published = {"status": "converged", "kind": "C", "objective": 2.5, "product": 1e-7, "seconds": 3.0}
    where = {"suite": "NOSBENCH", "level": 1, "family": family_of("TWO_001_002"), "name": "TWO_001_002"}
    made = {"limit": 20.0, "further": 0, "machine": "M", "program": "abc", "published": published}
    write({"TWO_001_002": {**where, **row, **made}}, tmp_path / "rows.json")
    rows = json.loads((tmp_path / "rows.json").read_text(encoding="utf-8"))
    assert "| TWO | 1 | 2, 2 | 1, 1 | 1 | 1 | 1 | 1 | 0 | 1, 0, 0 |" in page(rows)


def test_an_objective_far_off_is_a_failure() -> None:
    """One above twice the best known is far off, the better of both being the best; next to zero nothing is."""
    row = {"solved": True, "violation": 0.0, "product": 0.0, "published": {"status": "converged", "objective": 1.0}}
    assert [far({**row, "objective": value}) for value in (0.4, 1.9, 2.1)] == [False, False, True]
    row["published"] = {"status": "converged", "objective": 1e-9}
    assert not far({**row, "objective": 5e-7}) and far({**row, "objective": 1e-5})
    assert not far({**row, "objective": 1.0, "published": {"status": "timeout", "objective": None}})
