"""Where a replayed motion leads."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fesd_robot.recovery import SwitchRecord
from fesd_robot.replay.contacts import Drift, ReplayNote


@dataclass(frozen=True)
class Replay:
    """Where a motion leads.

    Attributes:
        configuration, velocity: at the end, (n_q) and (n_v).
        events: changes of the contacts' modes in time order, after the modes at the start.
        drift: what was taken out at the start.
        notes: what is not as it should be; the state is NaN where it could not be integrated.
        joint_events: changes of joints between sticking and sliding, in time order; their contact is a number of a
            joint with dry friction.
        compliant_events: where compliant contacts begin and cease to push, in time order; their contact is a number of
            one.
        arriving: velocity before what hits within `SAME_EVENT` of the end, (n_v); that at the end if nothing does.
    """

    configuration: np.ndarray
    velocity: np.ndarray
    events: tuple[SwitchRecord, ...]
    drift: Drift
    notes: frozenset[ReplayNote]
    joint_events: tuple[SwitchRecord, ...] = ()
    compliant_events: tuple[SwitchRecord, ...] = ()
    arriving: np.ndarray = field(default_factory=lambda: np.zeros(0))
