"""Mathematical programs with complementarity constraints: the value, its relaxation, its solution by homotopy.

The two sides of a pair are G and H, 0 <= G complementary to H >= 0. In this package a multiplier is a Lagrange
multiplier of a bound, a row or a side; Filippov multipliers are variables like all others here.
"""

from fesd_robot.mpcc.assembly import RelaxedNlp, assemble
from fesd_robot.mpcc.attempts import ATTEMPTS, Attempt, Attempted, solve_by_attempts
from fesd_robot.mpcc.certificate import Certificate, certify
from fesd_robot.mpcc.conflict import Conflict, Demand, conflict_at
from fesd_robot.mpcc.continuation import TRIALS, BranchPoint, BranchSolver, Trial, continue_on_branch
from fesd_robot.mpcc.elastic import LeastViolation
from fesd_robot.mpcc.homotopy import COST_LOSS, solve
from fesd_robot.mpcc.options import HomotopyOptions
from fesd_robot.mpcc.pair_polisher import PairPolisher
from fesd_robot.mpcc.polishing import (
    BRANCH,
    BranchBounds,
    BranchNlp,
    Polisher,
    PolishingLimits,
    PolishingReport,
)
from fesd_robot.mpcc.problem import Block, BlockEquations, Mpcc, Residuals
from fesd_robot.mpcc.report import NlpReport
from fesd_robot.mpcc.run import Run
from fesd_robot.mpcc.solution import MpccSolution, begun
from fesd_robot.mpcc.sources import from_opti, read_casadi_json
from fesd_robot.nlp import NlpStatus

__all__ = [
    "ATTEMPTS",
    "BRANCH",
    "COST_LOSS",
    "TRIALS",
    "Attempt",
    "Attempted",
    "Block",
    "BlockEquations",
    "BranchBounds",
    "BranchNlp",
    "BranchPoint",
    "BranchSolver",
    "Certificate",
    "Conflict",
    "Demand",
    "HomotopyOptions",
    "LeastViolation",
    "Mpcc",
    "MpccSolution",
    "NlpReport",
    "NlpStatus",
    "PairPolisher",
    "Polisher",
    "PolishingLimits",
    "PolishingReport",
    "RelaxedNlp",
    "Residuals",
    "Run",
    "Trial",
    "assemble",
    "begun",
    "certify",
    "conflict_at",
    "continue_on_branch",
    "from_opti",
    "read_casadi_json",
    "solve",
    "solve_by_attempts",
]
