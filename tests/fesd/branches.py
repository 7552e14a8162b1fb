"""Branches of shipped tasks, made by hand, and what contacts do on them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.fesd import Transcription
from fesd_robot.fesd.neighbours.contact_conditions import ActiveSet, ContactConditions
from fesd_robot.fesd.neighbours.patterns import Pattern, intervals_of, pattern_of, with_active
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.ocp import formulate
from fesd_robot.task import load_task

TASKS = Path(__file__).parents[2] / "tasks"


def polisher(task: str, *overrides: str) -> BranchTranscription:
    """The branch transcription of a shipped task with changes."""
    motion = formulate(load_task(TASKS / f"{task}.yaml", ["method.grid=uniform", *overrides]))
    return BranchTranscription(Transcription(motion.ocp, motion.fesd))


def flight_and_stick(contact: ContactConditions) -> tuple[ActiveSet, ActiveSet]:
    """The mode without force, and that in which nothing moves."""
    return (ActiveFactor.H,) * len(contact.members), (ActiveFactor.G,) * len(contact.members)


def branch_of(transcription: BranchTranscription, *flying: set[int]) -> tuple[Branch, list[ContactConditions]]:
    """The branch in which contact c flies in the intervals `flying[c]` and sticks in all others."""
    labels = transcription.conditions.labels
    contacts = list(dict.fromkeys(label.contact for label in labels))
    factors = []
    for k, own in enumerate(intervals_of(transcription.transcription.elements)):
        one = tuple(
            ActiveFactor.H if k in flying[contacts.index(label.contact)] else ActiveFactor.G for label in labels
        )
        factors += [one] * len(own)
    branch = Branch(labels, tuple(factors), (False,) * len(factors))
    return branch, ContactConditions.of(transcription.conditions, branch)


def patterns(transcription: BranchTranscription, contact: ContactConditions, branch: Branch) -> list[Pattern]:
    """What a contact does in every interval."""
    return [pattern_of(contact, branch, own) for own in intervals_of(transcription.transcription.elements)]


def in_impact(contact: ContactConditions, *slipping: int) -> ActiveSet:
    """The mode in which the clock stands still; of the sides of friction, numbers 0 and 1, some slip."""
    conditions = contact.conditions.members
    sides = [contact.parts[side] for side in slipping]
    stopped = [
        ActiveFactor.COMPLEMENT if conditions[i].complement is not None else ActiveFactor.G for i in contact.members
    ]
    return tuple(ActiveFactor.H if n in sides else factor for n, factor in enumerate(stopped))


def with_modes(
    transcription: BranchTranscription, branch: Branch, contact: ContactConditions, own: dict[int, list[ActiveSet]]
) -> Branch:
    """The branch in which a contact has other modes, one for each element, in some intervals."""
    intervals, factors = intervals_of(transcription.transcription.elements), list(branch.factors)
    for k, sequence in own.items():
        for e, active in zip(intervals[k], sequence, strict=True):
            factors[e] = with_active(contact, factors[e], active)
    return replace(branch, factors=tuple(factors))
