"""Following a plan: feedback gains along it, and a controller whose reference goes by landings."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fesd_robot.lazy import lazy_exports

__all__ = [
    "ContactState",
    "LinearMotion",
    "ModeDynamics",
    "Tracker",
    "TrackingWeights",
    "feed_forward",
    "gait_gains",
    "proportional_gains",
    "tracking_gains",
    "with_gains",
]

if TYPE_CHECKING:
    from fesd_robot.tracking.gains import feed_forward, gait_gains, proportional_gains, tracking_gains, with_gains
    from fesd_robot.tracking.mode_dynamics import ContactState, LinearMotion, ModeDynamics
    from fesd_robot.tracking.tracker import Tracker
    from fesd_robot.tracking.weights import TrackingWeights
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "fesd_robot.tracking.gains": [
                "feed_forward",
                "gait_gains",
                "proportional_gains",
                "tracking_gains",
                "with_gains",
            ],
            "fesd_robot.tracking.mode_dynamics": ["LinearMotion", "ModeDynamics", "ContactState"],
            "fesd_robot.tracking.tracker": ["Tracker"],
            "fesd_robot.tracking.weights": ["TrackingWeights"],
        },
    )
