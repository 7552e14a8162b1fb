"""Solvers are found by name."""

from __future__ import annotations

import casadi as ca
import pytest

from fesd_robot.errors import OptionError
from fesd_robot.mpcc import HomotopyOptions, Mpcc, PairPolisher, Run, solve
from fesd_robot.nlp import SOLVERS, Nlp, NlpSettings, Prepared

W = ca.SX.sym("w", 2)
PROBLEM = Mpcc.from_expressions(w=W, f=(W[0] - 2) ** 2 + (W[1] - 1) ** 2, G=W[0], H=W[1], start=[1.0, 1.0])
"""min (x - 2)^2 + (y - 1)^2 with 0 <= x _|_ y >= 0, whose solution is (2, 0)."""


def test_branch_nlps_are_solved_by_the_solver_that_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """A solver in the table is made for branch NLPs, and for no others."""
    asked: list[NlpSettings] = []

    def other(nlp: Nlp, settings: NlpSettings) -> Prepared:
        asked.append(settings)
        return SOLVERS["ipopt"](nlp, settings)

    monkeypatch.setitem(SOLVERS, "other", other)
    solution = solve(PROBLEM, Run(HomotopyOptions(branch_solver="other")), polisher=PairPolisher(PROBLEM))
    assert solution.exact and solution.w == pytest.approx([2, 0], abs=1e-8)
    assert len(asked) == 1 and asked[0].tolerance == 1e-9 and len(solution.reports) > 1


def test_a_solver_that_there_is_not() -> None:
    """Its name is refused with those that there are."""
    with pytest.raises(OptionError, match="found the NLP solver 'ipop', expected one of ipopt"):
        HomotopyOptions(branch_solver="ipop")
