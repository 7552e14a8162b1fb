"""Nonlinear programs: functions apart from numbers, points with multipliers, and one door for their solvers."""

from fesd_robot.nlp.ipopt import Hopeless, Prepared, ipopt_options, our_linear_solver, prepared
from fesd_robot.nlp.large_linear_program import LinearProgram, casadi_matrix, interior_solution
from fesd_robot.nlp.nlp import Iterate, Nlp, NlpNumbers, NlpPoint, NlpResult
from fesd_robot.nlp.reduced import ReducedNlp
from fesd_robot.nlp.settings import AT, FREE, NEAR, SAME, NlpSettings, Start
from fesd_robot.nlp.status import NlpStatus

__all__ = [
    "AT",
    "FREE",
    "NEAR",
    "SAME",
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
    "interior_solution",
    "ipopt_options",
    "our_linear_solver",
    "prepared",
]
