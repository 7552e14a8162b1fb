"""Mathematical programs with complementarity constraints: the value, its relaxation, its solution by homotopy."""

from fesd_robot.mpcc.certificate import Certificate, certify
from fesd_robot.mpcc.finish import Finisher, FinishReport, Held, SmoothNlp
from fesd_robot.mpcc.homotopy import HomotopyOptions, MpccSolution, NlpReport, solve
from fesd_robot.mpcc.problem import Block, Mpcc, Residuals
from fesd_robot.mpcc.sides import PairFinisher

__all__ = [
    "Block",
    "Certificate",
    "FinishReport",
    "Finisher",
    "Held",
    "HomotopyOptions",
    "Mpcc",
    "MpccSolution",
    "NlpReport",
    "PairFinisher",
    "Residuals",
    "SmoothNlp",
    "certify",
    "solve",
]
