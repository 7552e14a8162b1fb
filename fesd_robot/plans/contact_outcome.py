"""Flights, slides and impacts of the contacts, measured on a motion's samples with Pinocchio's kinematics."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from fesd_robot.contact import ContactMode
from fesd_robot.instants import SAME_EVENT
from fesd_robot.plans.outcome import ContactImpact, ContactOutcome, Flight, FrictionUse, Push, Slide
from fesd_robot.recovery import SLIP_VELOCITY, NumericPhysics, PhysicalMotion, normal_rows, tangential_rows


def contact_outcomes(
    motion: PhysicalMotion, physics: NumericPhysics, names: Sequence[str]
) -> dict[str, ContactOutcome]:
    """Return flights, slides and impacts of every contact.

    A sample closes the step from the sample before it, and says in which mode the contact was there; a flight or a
    slide is an unbroken row of steps in its mode. A flight ends where the contact takes part in an impact, also if it
    flies on. Its height is the largest of the cubics through gaps and their rates, exact for a throw; a contact that
    begins or ends the motion in flight has a flight that is open there. The distance of a slide is the integral of
    |J_t v| by the samples' quadrature weights. A contact that creeps, slower than `SLIP_VELOCITY`, sticks.

    Args:
        motion: the trajectory in physical time.
        physics: gaps, contact points and Jacobians.
        names: of the contacts, in their order.
    """
    samples = _Samples(motion, physics)
    return {
        name: ContactOutcome(
            flights=list(samples.flights(contact)),
            slides=list(samples.slides(contact)),
            impacts=list(samples.impacts(contact)),
            sticking=samples.sticking(contact),
            landing=samples.landing(contact),
        )
        for contact, name in enumerate(names)
    }


def compliant_outcomes(motion: PhysicalMotion, physics: NumericPhysics) -> dict[str, ContactOutcome]:
    """Return the flights and pushes of every compliant contact.

    Largest depth, height and force are those of the samples and, of gaps, of the cubics between them, as of flights.

    Args:
        motion: the trajectory in physical time.
        physics: gaps, contact points and Jacobians.
    """
    if motion.compliance is None:
        return {}
    states = list(zip(motion.configuration, motion.velocity, strict=True))
    gaps = np.array([physics.compliant_gaps(q) for q, _ in states])
    rates = np.array([physics.compliant_jacobian(q) @ v for q, v in states])
    points = np.array([physics.compliant_points(q) for q, _ in states])
    return {
        name: _compliant_outcome(motion, i, gaps[:, i], rates[:, i], points[:, i])
        for i, name in enumerate(physics.compliant)
    }


def _compliant_outcome(
    motion: PhysicalMotion, contact: int, gap: np.ndarray, rate: np.ndarray, point: np.ndarray
) -> ContactOutcome:
    assert motion.compliance is not None
    time, force, flights, pushes, end = motion.time, motion.compliance.force[:, contact], [], [], len(motion.time) - 1
    modes = [motion.compliance.mode[k, contact] for k in range(1, end + 1)]
    first = 0
    for mode, steps in itertools.groupby(modes):
        last = first + len(list(steps))
        span = {"start": float(time[first]), "end": float(time[last])}
        cut = {"open_start": first == 0, "open_end": last == end}
        farthest = _farthest(time, gap, rate, range(first, last + 1), 1 if mode is ContactMode.FLIGHT else -1)
        if mode is ContactMode.FLIGHT:
            length = float(np.linalg.norm((point[last] - point[first])[:2]))
            flights.append(Flight(**span, **cut, length=length, height=farthest))
        else:
            pushes.append(Push(**span, **cut, depth=farthest, force=float(force[first : last + 1].max())))
        first = last
    return ContactOutcome(flights=flights, pushes=pushes)


def _farthest(time: np.ndarray, gap: np.ndarray, rate: np.ndarray, samples: range, sign: int) -> float:
    """Return the largest gap, or with sign -1 the largest depth, of the cubics between samples, m."""
    tops = [
        _top(
            float(time[b] - time[a]),
            (sign * float(gap[a]), sign * float(gap[b])),
            (sign * float(rate[a]), sign * float(rate[b])),
        )
        for a, b in itertools.pairwise(samples)
    ]
    return max([float((sign * gap[samples.start : samples.stop]).max()), *tops])


NO_FORCE = 1e-3
"""Of the largest normal force, or impulse, of all contacts: at less the use of friction means nothing."""


class _Samples:
    """Kinematics of all contacts at all samples: gap, contact point, velocity along the normal, speed of slip."""

    def __init__(self, motion: PhysicalMotion, physics: NumericPhysics) -> None:
        count, contacts = len(motion.time), len(physics.friction)
        self._motion, self._friction = motion, physics.friction
        self._impact_before = {impact.after: impact for impact in motion.impacts}
        self._gap, self._rate, self._speed = (np.zeros((count, contacts)) for _ in range(3))
        self._point = np.zeros((count, contacts, 3))
        for k, (q, v) in enumerate(zip(motion.configuration, motion.velocity, strict=True)):
            self._gap[k], self._point[k] = physics.gaps(q), physics.contact_points(q)
            velocity = physics.contact_jacobian(q).reshape(physics.rows * contacts, len(v)) @ v
            self._rate[k] = normal_rows(velocity, physics.rows)
            self._speed[k] = np.linalg.norm(tangential_rows(velocity, physics.rows), axis=1)

    def flights(self, contact: int) -> Iterator[Flight]:
        """Yield the flights of a contact."""
        time, point = self._motion.time, self._point[:, contact]
        for first, last in self._stretches(contact, ContactMode.FLIGHT):
            yield Flight(
                start=float(time[first]),
                end=float(time[last]),
                length=float(np.linalg.norm((point[last] - point[first])[:2])),
                height=self._height(contact, first, last),
                open_start=first == 0,
                open_end=self._at_the_end(contact, last),
            )

    def slides(self, contact: int) -> Iterator[Slide]:
        """Yield the slides of a contact."""
        motion = self._motion
        for first, last in self._stretches(contact, ContactMode.SLIP):
            inside = slice(first + 1, last + 1)
            distance = motion.weight[inside] @ self._speed[inside, contact]
            yield Slide(start=float(motion.time[first]), end=float(motion.time[last]), distance=float(distance))

    def impacts(self, contact: int) -> Iterator[ContactImpact]:
        """Yield the impacts that a contact takes part in."""
        for impact in self._motion.impacts:
            if impact.taking_part[contact]:
                yield ContactImpact(
                    time=float(self._motion.time[impact.after]),
                    normal_impulse=float(impact.impulse[contact, 0]),
                    approach_velocity=-float(self._rate[impact.before, contact]),
                )

    def sticking(self, contact: int) -> FrictionUse | None:
        """Return the largest use of friction where a contact sticks, without the slow ends of slides."""
        motion, least = self._motion, NO_FORCE * float(self._motion.force[:, :, 0].max(initial=0.0))
        slips = np.pad(motion.mode[:, contact] == ContactMode.SLIP, 1)
        sticks = (motion.mode[:, contact] == ContactMode.STICK) & ~slips[:-2] & ~slips[2:]
        found = [(motion.force[k, contact], float(motion.time[k])) for k in np.flatnonzero(sticks)]
        return self._most(contact, found, least)

    def landing(self, contact: int) -> FrictionUse | None:
        """Return the largest use of friction by the impulse of an impact after which a contact sticks."""
        motion, impacts = self._motion, self._motion.impacts
        least = NO_FORCE * max((float(one.impulse[:, 0].max()) for one in impacts), default=0.0)
        lands = [one for one in impacts if one.taking_part[contact]]
        lands = [one for one in lands if motion.mode[one.after, contact] is ContactMode.STICK]
        return self._most(contact, [(one.impulse[contact], float(motion.time[one.after])) for one in lands], least)

    def _most(self, contact: int, forces: Sequence[tuple[np.ndarray, float]], least: float) -> FrictionUse | None:
        """Return the largest use of friction by forces, (rows), at their times, of those larger than the least."""
        mu = float(self._friction[contact])
        uses = [
            FrictionUse(share=float(np.linalg.norm(force[1:]) / (mu * force[0])), time=time)
            for force, time in forces
            if mu > 0 and force[0] > least
        ]
        return max(uses, key=lambda use: use.share, default=None)

    def _takes_part(self, contact: int, after: int) -> bool:
        """Return whether a sample is the one after an impact of the contact."""
        impact = self._impact_before.get(after)
        return impact is not None and bool(impact.taking_part[contact])

    def _at_the_end(self, contact: int, sample: int) -> bool:
        """Return whether nothing follows a sample, but for an impact of other contacts."""
        after = sample + 1
        if after + 1 < len(self._motion.time):
            return False
        return after == len(self._motion.time) or (self._jump(after) and not self._takes_part(contact, after))

    def _jump(self, sample: int) -> bool:
        """Return whether a sample is the one after an impact, which no time separates from the one before."""
        return sample in self._impact_before

    def _stretches(self, contact: int, mode: ContactMode) -> Iterator[tuple[int, int]]:
        """Yield (first, last) sample of every unbroken row of steps in a mode."""
        steps = [k for k in range(1, len(self._motion.time)) if not self._jump(k) and self._mode(k, contact) is mode]
        rows: list[list[int]] = []
        for k in steps:
            if rows and self._goes_on(contact, rows[-1][-1], k, mode):
                rows[-1].append(k)
            else:
                rows.append([k])
        for row in rows:
            yield row[0] - 1, row[-1]

    def _goes_on(self, contact: int, last: int, step: int, mode: ContactMode) -> bool:
        """Return whether a step continues that of sample `last`: it is the next, or only an impact lies between them.

        A flight does not go on over an impact of its own contact.
        """
        if step == last + 1:
            return True
        over_impact = step == last + 2 and self._jump(last + 1)
        return over_impact and not (mode is ContactMode.FLIGHT and self._takes_part(contact, last + 1))

    def _mode(self, sample: int, contact: int) -> ContactMode:
        """Return the mode in the step that ends with a sample; one before an impact only says that it hits."""
        mode: ContactMode = self._motion.mode[sample, contact]
        if mode is not ContactMode.IMPACT:
            return mode
        time = self._motion.time[sample]
        if any(
            switch.contact == contact and switch.kind == "touchdown" and abs(switch.time - time) <= SAME_EVENT
            for switch in self._motion.switches
        ):
            return ContactMode.FLIGHT
        return ContactMode.SLIP if self._speed[sample, contact] >= SLIP_VELOCITY else ContactMode.STICK

    def _height(self, contact: int, first: int, last: int) -> float:
        time, gap, rate = self._motion.time, self._gap[:, contact], self._rate[:, contact]
        tops = [
            _top(float(time[b] - time[a]), (float(gap[a]), float(gap[b])), (float(rate[a]), float(rate[b])))
            for a, b in itertools.pairwise(range(first, last + 1))
        ]
        return max([float(np.max(gap[first : last + 1])), *tops])


def _top(duration: float, values: tuple[float, float], rates: tuple[float, float]) -> float:
    """Return the largest value of the cubic with these values and rates at both ends of a step.

    p(s) = a s^3 + b s^2 + c s + p(0), s in [0, 1], with p'(0) = c = h rate(0) and p'(1) = d = h rate(1), has one top
    inside if it rises first and falls then.
    """
    start, end = values
    if not (duration > 0 and rates[0] > 0 > rates[1]):
        return max(values)
    c, d = rates[0] * duration, rates[1] * duration
    a, b = 2 * (start - end) + c + d, 3 * (end - start) - 2 * c - d
    fall = math.sqrt(max(b * b - 3 * a * c, 0.0)) - b
    if not fall > 0:  # rates whose squares are no numbers
        return max(values)
    s = c / fall
    return ((a * s + b) * s + c) * s + start
