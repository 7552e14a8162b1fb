"""Whether a cheaper motion is near by, in words."""

from __future__ import annotations

from fesd_robot.plans.plan import Status


def stationarity_sentence(status: Status) -> str:
    """Return whether a small change of a motion is known to lower its cost, and if that is not known, why."""
    if status.b_stationary == "certified":
        return (
            "There is no cheaper motion nearby: to first order no small change lowers the cost, neither with these "
            "contacts nor with any that open, close, stick or slip a little earlier or later."
        )
    if status.b_stationary == "refuted":
        why = status.b_stationary_reason or "a direction was found along which the linearised cost falls"
        return f"A cheaper motion may be nearby: {why}."
    if status.stationarity == "unknown":
        reason = "no time was left" if status.solved else "it is asked of solved problems only, and while time is left"
        return f"Whether a cheaper motion is nearby is not known: {reason}."
    undetermined = f"; of {status.unresolved} pairs it is undetermined which side is zero" if status.unresolved else ""
    bound = f"; {status.b_stationary_reason}" if status.b_stationary_reason else ""
    return (
        "Whether a cheaper motion is nearby is not known: the search over all branches came to no answer in its time"
        f"{undetermined}{bound}."
    )
