"""Why a motion is not certified as B-stationary, in words."""

from __future__ import annotations

from collections import defaultdict
from math import isfinite

from fesd_robot.mpcc import Certificate
from fesd_robot.plans.conflict_words import interval_numbers


def descent_words(certificate: Certificate | None) -> str:
    """Describe the direction in which the cost falls and the result of following it, or by how much it falls at most.

    Empty if it is certified, and where not even a bound was found.

    Args:
        certificate: of the motion that is kept.
    """
    if certificate is None or certificate.b_stationary == "certified":
        return ""
    if certificate.b_stationary == "unknown":
        falls = f"on no branch does the linearised cost fall by more than a slope of {certificate.bound:.1e}"
        return falls if isfinite(certificate.bound) else ""
    places: dict[str, set[int]] = defaultdict(set)
    for label in certificate.leaving:
        if label.place.interval is not None:
            places[f"contact '{label.contact}'" if label.contact else label.subject].add(label.place.interval)
    where = ", ".join(f"{what} in {interval_numbers(own)}" for what, own in sorted(places.items()))
    tried = {0: "no branch was tried there", 1: "the branch there gains nothing"}
    followed = tried.get(certificate.followed, f"{certificate.followed} branches there gain nothing")
    return f"the linearised cost falls (slope {certificate.slope:.1e}) by changing {where or 'bounds only'}; {followed}"
