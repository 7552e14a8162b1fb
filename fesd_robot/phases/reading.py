"""From a trajectory on its branch to the sequence of phases that it is."""

from __future__ import annotations

from fesd_robot.contact import ContactMode, Modes, acting_impulses, acting_sets, modes_of, names_of_modes
from fesd_robot.fesd.neighbours import KnownTrajectory
from fesd_robot.phases.sequence import Phase, Sequence, joined

SHORTEST = 1e-4
"""Of the duration: what is read as a phase lasts longer; a shorter mode comes from a point that is not exact."""


def sequence_of(known: KnownTrajectory) -> Sequence:
    """Return the phases of a trajectory: equal modes joined, elements without length and very short phases left out.

    Args:
        known: the trajectory, of a contact system in multipliers, or with impulses.
    """
    branch, elements, clock = known.branch, known.elements, known.clock
    names = names_of_modes(branch)
    shortest = SHORTEST * float(elements[-1].x[-1, clock])
    phases: list[Phase] = []
    pending: list[Modes] = []
    for e, element in enumerate(elements):
        if branch.without_length[e]:
            continue
        own = modes_of(branch, e)
        modes = tuple(own[name] for name in names)
        if any(mode.hits for mode in modes):
            pending += [modes] if not pending or pending[-1] != modes else []
            continue
        acting = acting_impulses(branch, e)
        if phases and any(acting.values()):
            before = phases[-1].modes
            pending = [
                tuple(
                    (mode if mode.closed else ContactMode.STICK).hitting
                    if acting.get(name) and before[i] is ContactMode.FLIGHT
                    else mode
                    for i, (name, mode) in enumerate(zip(names, modes, strict=True))
                )
            ]
        duration = float(element.x[-1, clock] - element.x_left[clock])
        phases.append(Phase(modes, duration, tuple(pending), acting=acting_sets(branch, e)))
        pending = []
    phases = list(joined(phases))
    short = [i for i, phase in enumerate(phases) if phase.duration < shortest]
    return Sequence(names, joined(Sequence(names, tuple(phases)).without(short).phases), tuple(pending))
