"""How a plan was solved again during a run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fesd_robot.in_mujoco.driving import Controller
    from fesd_robot.replanning import MovedGoal, Update


@dataclass(frozen=True)
class Replanned:
    """The updates of a run.

    Attributes:
        updates: in their order.
        period: between two of them, s.
        real_time: whether each counted only once the time had passed that it took.
        goals: values of the goal that were others from a time on.
    """

    updates: Sequence[Update]
    period: float
    real_time: bool
    goals: Sequence[MovedGoal]

    @classmethod
    def of(cls, controller: Controller) -> Replanned:
        """Return how a `ReplanningController` that has driven a run solved the plan again."""
        from fesd_robot.replanning import ReplanningController  # loads slowly

        assert isinstance(controller, ReplanningController)
        return cls(controller.updates, controller.replanner.period, controller.real_time, controller.goals)

    def entry(self) -> dict[str, Any]:
        """Return it as a part of an entry of ``replay.json``: times in s, shares of all updates."""
        from fesd_robot.replanning import Statistics
        from fesd_robot.replanning.replanner import EXACT

        statistics, count = Statistics(list(self.updates)), len(self.updates)
        seconds = {
            name: dict(zip(("median", "percentile_99"), statistics.seconds(name), strict=True))
            for name in ("feedback_seconds", "prepare_seconds")
        }
        return {
            "period": self.period,
            "real_time": self.real_time,
            "goals": [asdict(each) for each in self.goals],
            "updates": count,
            "status": {name: found / count for name, found in Counter(each.status for each in self.updates).items()},
            "exact_at_once": sum(each.first <= EXACT for each in self.updates) / count,
            **seconds,
        }
