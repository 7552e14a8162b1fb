"""The problems that are compared, by the name they have on the command line."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

from scripts.benchmarks.compare import cart_pole, hopper, motor, sliding_mode, switched, two_discs
from scripts.benchmarks.compare.outcome import Outcome, Settings
from scripts.benchmarks.compare.switched import SwitchedProblem


@dataclass(frozen=True)
class Problem:
    """A problem and how each tool solves it.

    Attributes:
        title: for tables.
        run: tool -> settings -> outcome.
        weighted: whether `Settings.multipliers` applies to the problem.
    """

    title: str
    run: Mapping[str, Callable[[Settings], Outcome]]
    weighted: bool = False


def _hopper(title: str, name: str) -> Problem:
    return Problem(title, {"ours": partial(hopper.ours, name), "nosnoc": partial(hopper.nosnoc, name)}, weighted=True)


def _switched(title: str, describe: Callable[[], SwitchedProblem]) -> Problem:
    return Problem(title, {"ours": partial(switched.ours, describe), "nosnoc": partial(switched.nosnoc, describe)})


PROBLEMS = {
    "five_jumps": _hopper("hopper, five jumps", "five_jumps"),
    "one_jump": _hopper("hopper, one jump", "one_jump"),
    "sliding_mode": _switched("sliding mode", sliding_mode.describe),
    "motor": _switched("motor with friction", motor.describe),
    "cart_pole": _switched("cart-pole with friction", cart_pole.describe),
    "two_discs": Problem("two-disc swap", {"ours": two_discs.ours, "nosnoc": two_discs.nosnoc}),
}
