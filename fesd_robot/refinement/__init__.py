"""What makes a motion exact, finer and stationary: repair, refinement, postures that decide, descent."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fesd_robot.lazy import lazy_exports

__all__ = [
    "NO_MOTION",
    "Neighbourhood",
    "Repair",
    "SolvedMotion",
    "descended",
    "exact_end",
    "refined",
]

if TYPE_CHECKING:
    from fesd_robot.refinement.descent import descended
    from fesd_robot.refinement.neighbourhood import Neighbourhood
    from fesd_robot.refinement.refine import NO_MOTION, refined
    from fesd_robot.refinement.repair import Repair, exact_end
    from fesd_robot.refinement.solved_motion import SolvedMotion
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "fesd_robot.refinement.descent": ["descended"],
            "fesd_robot.refinement.neighbourhood": ["Neighbourhood"],
            "fesd_robot.refinement.refine": ["NO_MOTION", "refined"],
            "fesd_robot.refinement.repair": ["Repair", "exact_end"],
            "fesd_robot.refinement.solved_motion": ["SolvedMotion"],
        },
    )
