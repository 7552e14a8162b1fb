"""Phases: spans in which no contact changes its mode, their sequences, and the motions on a grid that follows them."""

from fesd_robot.phases.discretised import Discretised, discretised
from fesd_robot.phases.guessed import guessed_sequences, hops
from fesd_robot.phases.pushing import Pushing, pushings
from fesd_robot.phases.reading import sequence_of
from fesd_robot.phases.search import SequenceSearch
from fesd_robot.phases.sequence import Phase, Sequence
from fesd_robot.phases.solving import PhaseMotion, PhaseSolver
from fesd_robot.phases.start import resting

__all__ = [
    "Discretised",
    "Phase",
    "PhaseMotion",
    "PhaseSolver",
    "Pushing",
    "Sequence",
    "SequenceSearch",
    "discretised",
    "guessed_sequences",
    "hops",
    "pushings",
    "resting",
    "sequence_of",
]
