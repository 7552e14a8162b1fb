"""Nonlinear programs: functions apart from numbers, points with multipliers, and one door for their solvers."""

from fesd_robot.nlp.ipopt import ipopt_options, our_linear_solver
from fesd_robot.nlp.large_linear_program import LinearProgram, casadi_matrix, interior_solution
from fesd_robot.nlp.nlp import Hopeless, Iterate, Nlp, NlpNumbers, NlpPoint, NlpResult
from fesd_robot.nlp.reduced import ReducedNlp
from fesd_robot.nlp.settings import AT, AT_REST, FREE, NEAR, SAME, NlpSettings, Start
from fesd_robot.nlp.solvers import SOLVERS, Prepared, check_solver, prepared
from fesd_robot.nlp.status import NlpStatus

__all__ = [
    "AT",
    "AT_REST",
    "FREE",
    "NEAR",
    "SAME",
    "SOLVERS",
    "Hopeless",
    "Iterate",
    "LinearProgram",
    "Nlp",
    "NlpNumbers",
    "NlpPoint",
    "NlpResult",
    "NlpSettings",
    "NlpStatus",
    "Prepared",
    "ReducedNlp",
    "Start",
    "casadi_matrix",
    "check_solver",
    "interior_solution",
    "ipopt_options",
    "our_linear_solver",
    "prepared",
]
