"""How an optimal control problem is solved."""

from __future__ import annotations

from dataclasses import dataclass, field

from fesd_robot.arguments import checked
from fesd_robot.errors import OptionError
from fesd_robot.mpcc import HomotopyOptions
from fesd_robot.running import SearchEffort


@checked
@dataclass(frozen=True)
class OptimalControlSettings:
    """How an optimal control problem is solved.

    Args:
        tolerance: product G H asked for in every pair before switches are located exactly.
        starts: initial guesses: the problem's own, a straight line from start to end, then random controls.
        more_starts: further ones that are tried if none of these is solved.
        seed: of the random controls.
        search: whether switches are moved from interval to interval as long as that lowers the cost.
        time_limit: seconds; None for no limit. At its end the cheapest solution so far is returned.
        linear_solver: ``fesd``, ``auto`` or one of IPOPT's, see `HomotopyOptions`.
        velocity_level_ratio: see `HomotopyOptions`; a smaller one where relaxed friction and impulses lift what rests.
        effort: how much is tried.

    Raises:
        OptionError: a tolerance or time limit that is not positive, no start, or a ratio below one.
    """

    tolerance: float = 1e-8
    starts: int = 4
    more_starts: int = 4
    seed: int = 0
    search: bool = True
    time_limit: float | None = None
    linear_solver: str = "auto"
    velocity_level_ratio: float = 30.0
    effort: SearchEffort = field(default_factory=SearchEffort)

    def __post_init__(self) -> None:
        if not 0 < self.tolerance < 1:
            raise OptionError(f"tolerance must be between 0 and 1, found {self.tolerance:g}")
        if self.starts < 1 or self.more_starts < 0:
            raise OptionError(
                f"starts must be at least 1 and more_starts at least 0, found {self.starts} and {self.more_starts}"
            )
        if self.time_limit is not None and not self.time_limit > 0:
            raise OptionError(f"time_limit must be positive, found {self.time_limit:g}")
        if not self.velocity_level_ratio >= 1:
            raise OptionError(f"velocity_level_ratio must be at least 1, found {self.velocity_level_ratio:g}")

    def homotopy(self, *, polish: bool) -> HomotopyOptions:
        """Return the options of one homotopy.

        Args:
            polish: whether it is loose, and its end exact.
        """
        return HomotopyOptions(
            tolerance=self.tolerance,
            sigma_start=1.0,
            linear_solver=self.linear_solver,
            velocity_level_ratio=self.velocity_level_ratio,
            polish=polish,
        )
