"""How much is tried for a motion, and for cheaper ones."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Literal

from fesd_robot.errors import OptionError

EffortLevel = Literal["quick", "balanced", "best"]
"""As in `solver.effort` of a task."""


@dataclass(frozen=True)
class SearchEffort:
    """How much is tried for a motion, and for cheaper ones, before what was found by then is taken.

    All iterations are IPOPT's. Work is IPOPT iterations times nonzeros of the derivatives; ten million take about a
    second.

    Args:
        search_starts: motions of guesses from which cheaper sequences of phases are looked for, the cheapest first.
        least_patience, most_patience: work without a worthwhile gain after which that search ends: as much as all
            before the gain took, within these.
        most_work: work after which it ends, whatever it gains.
        neighbour_gain: part of the cost by which a neighbour is cheaper that takes a motion's place.
        worthwhile_gain: part of the cost that a pass over all neighbours brings for another to follow, and that a gain
            is for the search to go on for long after it.
        hope: part of the cost that a sequence may still gain where bounds of durations move, or what has vanished is
            left out; one that would have to gain more is given up.
        sequence_rounds: NLPs of one sequence: bounds move with durations that have reached them, and phases that have
            shrunk are left out.
        guess_iterations: with the durations of the guess; those that converge take 20 to 120.
        freed_iterations: the same with free durations, where there is no motion with those of the guess.
        free_iterations: with free durations, from a motion.
        neighbour_iterations: the same from the motion of another sequence; those that converge take 15 to 60.
        settled_iterations: for the last digits.
        lost_nlps: NLPs of a homotopy that may be lost; after them steps are no longer shortened.
        polishing_iterations: on one branch of a homotopy's end before it is updated; the right one needs 15 to 50.
        polishing_updates: how often that branch is updated before the next candidate.
        branch_iterations: on a known branch before it is updated; what needs more has an element that shrinks to
            nothing.
        branch_updates: how often that is updated.
        whole_step_iterations: with whole steps, after which the line search is used from the beginning.
        repair_trials: neighbours that a repair tries in all.
        repair_share: of the time that is left, which a repair may take: where it finds nothing the homotopy goes on.
        refinement_rounds: refinements to one accuracy, one after the other.
        enough_rounds: refinements after which a motion whose audit has something to spare is taken, although a local
            error is larger than asked for: errors that are not small by then, as of stiff springs or light links, cost
            a large problem each round.
        refinement_failures: finer transcriptions without solution, in all rounds together; each costs hundreds of
            iterations.
        refinement_repairs: how often refinement looks for other branches.
        descents: of a motion, one after the other.
        pivots: branches that are tried for one direction of descent.
        pivot_iterations: on each of these; those that descend need about 30.
        pivot_seconds: on each of these; where its equations are singular, IPOPT's corrections of them take minutes and
            lead nowhere.
        descent_gain: of the cost, relative to the larger of it and one; less is no descent: where a foot grazes the
            ground without force, linearised constraints allow a little that the real ones do not.
        shift_rounds: improvements of a solution of optimal control without robots, one after the other.
        shift_iterations: on the branch of a neighbour there.
        shift_fillings: how often elements there that have shrunk to nothing are put to use again.
        certificate_seconds: for a certificate: whether a branch descends, and the kind of a stationary point.
        conflict_seconds: for the conflicting constraints of a task that is not solved.

    Raises:
        OptionError: a number that is negative, or none.
    """

    search_starts: int = 1
    least_patience: float = 3e7
    most_patience: float = 5e7
    most_work: float = 1.5e8
    neighbour_gain: float = 1e-3
    worthwhile_gain: float = 5e-3
    hope: float = 0.1
    sequence_rounds: int = 6
    guess_iterations: int = 100
    freed_iterations: int = 150
    free_iterations: int = 200
    neighbour_iterations: int = 80
    settled_iterations: int = 60
    lost_nlps: int = 12
    polishing_iterations: int = 40
    polishing_updates: int = 4
    branch_iterations: int = 120
    branch_updates: int = 1
    whole_step_iterations: int = 60
    repair_trials: int = 60
    repair_share: float = 0.3
    refinement_rounds: int = 20
    enough_rounds: int = 8
    refinement_failures: int = 6
    refinement_repairs: int = 4
    descents: int = 3
    pivots: int = 3
    pivot_iterations: int = 50
    pivot_seconds: float = 10.0
    descent_gain: float = 1e-4
    shift_rounds: int = 100
    shift_iterations: int = 60
    shift_fillings: int = 2
    certificate_seconds: float = 45.0
    conflict_seconds: float = 10.0

    def __post_init__(self) -> None:
        for one in fields(self):
            value = getattr(self, one.name)
            if not value >= 0:
                raise OptionError(f"{one.name} must not be negative, found {value:g}")

    @classmethod
    def of(cls, level: EffortLevel) -> SearchEffort:
        """Return the effort that a task names.

        Args:
            level: quick: contacts stay as they were found; balanced: they change as long as that pays; best: until no
                neighbour of the three cheapest first motions is cheaper.
        """
        if level == "quick":
            return cls(search_starts=0, descents=0)
        if level == "best":
            return cls(search_starts=3, least_patience=math.inf, most_patience=math.inf, most_work=math.inf)
        return cls()
