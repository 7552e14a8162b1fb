"""Polishing: products that are zero to round-off, on the branch near which a relaxed point lies."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.exactness import EXACT_PRODUCT
from fesd_robot.mpcc import (
    BranchNlp,
    HomotopyOptions,
    Mpcc,
    NlpReport,
    PairPolisher,
    Run,
    solve,
)
from fesd_robot.running.deadline import Deadline

from .known import KNOWN, Known

CORNERS = {"no_multipliers", "falling_into_the_corner", "b_not_s_stationary"}
"""Whose relaxed points show late, or never, which side is zero."""

SOLVABLE = [known for known in KNOWN if known.solutions]

OTHER = {ActiveFactor.G: ActiveFactor.H, ActiveFactor.H: ActiveFactor.G}


def _branch(problem: Mpcc, *factors: ActiveFactor) -> Branch:
    return Branch.of_pairs(problem.pair_labels, factors)


@pytest.mark.parametrize("known", SOLVABLE, ids=lambda known: known.name)
def test_small_problems_end_exactly(known: Known) -> None:
    """Every small problem ends in one of its solutions, most with products of zero before sigma is at its end."""
    problem = known.problem
    solution = solve(problem, Run(HomotopyOptions(sigma_factor=0.1)), polisher=PairPolisher(problem))
    assert solution.solved, solution.status
    assert solution.residuals.complementarity <= (EXACT_PRODUCT if solution.exact else 1e-8)
    if known.name not in CORNERS:
        assert solution.exact and min(report.sigma for report in solution.reports if report.sigma) > 1e-8
    assert known.error(solution.w) <= known.distance


@pytest.mark.parametrize("known", SOLVABLE, ids=lambda known: known.name)
def test_a_loose_homotopy_follows_sigma(known: Known) -> None:
    """Products of every NLP of a loose homotopy are at most twice its sigma, also below IPOPT's tolerance there."""
    options = HomotopyOptions(sigma_factor=0.1, velocity_level_ratio=1.0)
    solution = solve(known.problem, Run(options), polisher=PairPolisher(known.problem))
    relaxed = [report for report in solution.reports if report.sigma]
    assert min(report.sigma for report in relaxed) < 1e-2
    assert max(report.residuals.complementarity / report.sigma for report in relaxed) <= 2


def test_an_infeasible_problem_is_not_polished() -> None:
    """A problem without a solution is not called solved, with a polisher as without one."""
    (known,) = [known for known in KNOWN if not known.solutions]
    solution = solve(known.problem, Run(HomotopyOptions(sigma_factor=0.1)), polisher=PairPolisher(known.problem))
    assert not solution.solved and not solution.exact


class Misread(PairPolisher):
    """Reads the wrong side of every pair."""

    def candidate_branches(self, w: np.ndarray) -> Iterator[Branch]:
        branch = next(super().candidate_branches(w))
        (factors,) = branch.factors
        yield _branch(self.with_pairs, *(OTHER[factor] for factor in factors))

    def updated_branch(self, branch: Branch, w: np.ndarray) -> Branch | None:
        return None


def test_a_branch_that_costs_more_is_refused() -> None:
    """A misread branch whose exact end costs more than the relaxed point is not taken; the homotopy goes on."""
    (known,) = [known for known in KNOWN if known.name == "near_miss"]
    solution = solve(known.problem, Run(HomotopyOptions(sigma_factor=0.1)), polisher=Misread(known.problem))
    plain = solve(known.problem, Run(HomotopyOptions(sigma_factor=0.1)))
    assert solution.solved and not solution.exact
    np.testing.assert_allclose(solution.w, plain.w, atol=1e-6)


def test_polishing_can_be_switched_off() -> None:
    """Without it the homotopy is the one it was: the same NLPs, to the last bit."""
    problem = SOLVABLE[0].problem
    plain = solve(problem, Run(HomotopyOptions()))
    off = solve(problem, Run(HomotopyOptions(polish=False)), polisher=PairPolisher(problem))
    assert [r.iterations for r in off.reports] == [r.iterations for r in plain.reports]
    np.testing.assert_array_equal(off.w, plain.w)


def test_time_and_stop_are_obeyed() -> None:
    """No branch NLP starts when the time is over, and a stop ends polishing without an exact point."""
    problem = SOLVABLE[0].problem
    nlp = BranchNlp.of(PairPolisher(problem), "never")
    reported: list[NlpReport] = []
    late = nlp.solve(problem, problem.start, Run(deadline=Deadline(0.0), report=reported.append))
    assert late is None and reported == []
    stopping = Run(stop=lambda iteration, objective: True, report=reported.append)
    stopped = nlp.solve(problem, problem.start + 3.0, stopping)
    assert stopped is None and [report.status for report in reported] == ["interrupted"]


def test_bounds_keep_the_active_factor_at_zero() -> None:
    """The active side is at most zero and the other is free above; only a vanishing constraint has G free below."""
    pair, vanishing = (next(k for k in KNOWN if k.name == name).problem for name in ("near_miss", "g_negative"))
    for problem, free in ((pair, 0.0), (vanishing, -np.inf)):
        for factor in (ActiveFactor.G, ActiveFactor.H):
            bounds = PairPolisher(problem).bounds(_branch(problem, factor))
            assert bounds.g_lower[-2:].tolist() == [free, 0.0]
            assert bounds.g_upper[-2:].tolist() == ([0.0, np.inf] if factor is ActiveFactor.G else [np.inf, 0.0])


def test_an_exact_solution_has_its_branch() -> None:
    """The branch of a polished solution names every pair and the side that is zero there, and no other has one."""
    for known in SOLVABLE:
        options, polisher = HomotopyOptions(sigma_factor=0.1), PairPolisher(known.problem)
        solution = solve(known.problem, Run(options), polisher=polisher)
        assert solution.exact == (solution.branch is not None)
        if solution.branch is None:
            continue
        assert solution.branch.conditions == known.problem.pair_labels and solution.branch.without_length == (False,)
        (block,) = known.problem.blocks
        _, _, G, H = block.evaluate(solution.w)
        (factors,) = solution.branch.factors
        for factor, G_value, H_value in zip(factors, G[:, 0], H[:, 0], strict=True):
            assert (G_value if factor is ActiveFactor.G else H_value) <= 1e-9
    assert solve(SOLVABLE[0].problem, Run(HomotopyOptions())).branch is None
