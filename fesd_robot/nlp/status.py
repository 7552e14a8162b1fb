"""How an NLP or a homotopy of NLPs ended, each with what a reader can do about it."""

from __future__ import annotations

from enum import Enum

_USUAL_ADVICE = "try another reference, solver.sigma_start or more method.elements"


class NlpStatus(str, Enum):
    """How an NLP or a homotopy ended; a member is equal to its words, as ``"iteration limit"``.

    Attributes:
        advice: what usually helps, the end of the sentence that says how it ended.
    """

    advice: str

    CONVERGED = "converged", _USUAL_ADVICE
    ACCEPTABLE = "converged to the acceptable level", _USUAL_ADVICE
    ITERATION_LIMIT = (
        "iteration limit",
        "try a larger solver.max_iterations, a larger solver.sigma_factor or another reference",
    )
    TIME_LIMIT = "time limit", "try a longer solver.time_limit"
    INFEASIBLE = (
        "infeasible",
        "try a longer horizon.duration, more method.elements, wider limits or another reference",
    )
    INTERRUPTED = "interrupted", "this is the best iterate so far"
    SLACK_LEFT = "slack left", "try steering: direct"
    NOT_STARTED = "not started", _USUAL_ADVICE
    RESTORATION_FAILED = "failed: restoration", _USUAL_ADVICE
    SEARCH_DIRECTION_TOO_SMALL = "failed: search direction too small", _USUAL_ADVICE
    INVALID_NUMBER = "failed: a value or derivative is not a number", _USUAL_ADVICE
    DIVERGING = "failed: the iterates diverge", _USUAL_ADVICE
    STEP_NOT_COMPUTED = "failed: no step could be computed", _USUAL_ADVICE
    TOO_FEW_FREEDOMS = "failed: more equations than variables", _USUAL_ADVICE
    OTHER_FAILURE = "failed: for a reason of IPOPT's own", _USUAL_ADVICE

    def __new__(cls, words: str, advice: str) -> NlpStatus:
        """Return the member that is equal to its words."""
        member = str.__new__(cls, words)
        member._value_, member.advice = words, advice
        return member

    def __str__(self) -> str:
        return str(self.value)

    @property
    def converged(self) -> bool:
        """Whether IPOPT met its tolerance or its acceptable level."""
        return self in (NlpStatus.CONVERGED, NlpStatus.ACCEPTABLE)

    @property
    def ended_early(self) -> bool:
        """Whether the user or the time limit ended it, after which nothing further is tried."""
        return self in (NlpStatus.INTERRUPTED, NlpStatus.TIME_LIMIT)

    @classmethod
    def of_ipopt(cls, return_status: str) -> NlpStatus:
        """Return the member for IPOPT's own name of how it ended, as ``Solve_Succeeded``."""
        return _OF_IPOPT.get(return_status, cls.OTHER_FAILURE)


_OF_IPOPT = {
    "Solve_Succeeded": NlpStatus.CONVERGED,
    "Solved_To_Acceptable_Level": NlpStatus.ACCEPTABLE,
    "Maximum_Iterations_Exceeded": NlpStatus.ITERATION_LIMIT,
    "Maximum_CpuTime_Exceeded": NlpStatus.TIME_LIMIT,
    "Maximum_WallTime_Exceeded": NlpStatus.TIME_LIMIT,
    "Infeasible_Problem_Detected": NlpStatus.INFEASIBLE,
    "User_Requested_Stop": NlpStatus.INTERRUPTED,
    "Restoration_Failed": NlpStatus.RESTORATION_FAILED,
    "Search_Direction_Becomes_Too_Small": NlpStatus.SEARCH_DIRECTION_TOO_SMALL,
    "Invalid_Number_Detected": NlpStatus.INVALID_NUMBER,
    "Diverging_Iterates": NlpStatus.DIVERGING,
    "Error_In_Step_Computation": NlpStatus.STEP_NOT_COMPUTED,
    "Not_Enough_Degrees_Of_Freedom": NlpStatus.TOO_FEW_FREEDOMS,
}
