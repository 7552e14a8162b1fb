"""The ways in which an NLP can end."""

from __future__ import annotations

import pytest

from fesd_robot.mpcc import NlpStatus


@pytest.mark.parametrize("status", NlpStatus)
def test_a_status_is_its_words(status: NlpStatus) -> None:
    """A status is equal to its words, is written as them, comes back from them, and says what helps."""
    assert status == status.value and f"{status}" == status.value and NlpStatus(status.value) is status
    assert status.advice


@pytest.mark.parametrize(
    ("name", "status", "converged"),
    [
        ("Solve_Succeeded", "converged", True),
        ("Solved_To_Acceptable_Level", "converged to the acceptable level", True),
        ("Maximum_WallTime_Exceeded", "time limit", False),
        ("Maximum_CpuTime_Exceeded", "time limit", False),
        ("Invalid_Number_Detected", "failed: a value or derivative is not a number", False),
        ("Insufficient_Memory", "failed: for a reason of IPOPT's own", False),
    ],
)
def test_ipopts_own_names(name: str, status: str, converged: bool) -> None:
    """Every name that IPOPT has for an end becomes a status; one without a status of its own is a failure too."""
    end = NlpStatus.of_ipopt(name)
    assert (end, end.converged) == (status, converged)
