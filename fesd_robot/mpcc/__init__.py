"""Mathematical programs with complementarity constraints: the value, its relaxation, its solution by homotopy."""

from fesd_robot.mpcc.certificate import Certificate, certify
from fesd_robot.mpcc.homotopy import HomotopyOptions, MpccSolution, NlpReport, solve
from fesd_robot.mpcc.polishing import BranchNlp, Held, Polisher, PolishingReport
from fesd_robot.mpcc.problem import Block, Mpcc, Residuals
from fesd_robot.mpcc.sides import PairPolisher

__all__ = [
    "Block",
    "BranchNlp",
    "Certificate",
    "Held",
    "HomotopyOptions",
    "Mpcc",
    "MpccSolution",
    "NlpReport",
    "PairPolisher",
    "Polisher",
    "PolishingReport",
    "Residuals",
    "certify",
    "solve",
]
