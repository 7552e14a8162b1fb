"""The phases of an impact: what contacts do while their impulses grow, and when that ends."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.integrate import DOP853

from fesd_robot.contact import ContactMode
from fesd_robot.exactness import SINGULAR
from fesd_robot.recovery import cone_facets, normal_rows, tangential_rows
from fesd_robot.replay.headings import beginning_headings, slip_headings
from fesd_robot.replay.impact_state import ImpactState
from fesd_robot.replay.roots import crossing_time
from fesd_robot.replay.splits import widest_split

ZERO_OF_LARGEST = 1e-12
"""Ratio of a velocity to the largest one of an impact, and of a rate to the largest one, that counts as zero."""

SETTLED = 1e-9
"""The same as `ZERO_OF_LARGEST` of velocities in space, where phases are integrated."""

_HELD = float(np.sqrt(SINGULAR))
"""Rate of a velocity that is held, as a ratio of the largest one, that counts as zero: what such singular values leave,
which are the squares of those of J. Corners of a face that meet the ground together are not all equally high."""

_STEPS = 3000
"""Of the integration of one phase after which it counts as unfinished."""

_SLOW = 1e-7
"""m/s; slower velocities keep the direction that they had: where a slide begins or ends its direction is stiff."""

_BEGUN = 1e-5
"""m/s; a slide that begins has the direction that it accelerates in up to this speed. The direction of its velocity
follows that one within an impulse in proportion to the speed, and an explicit method would take as short steps."""

_PHASE_TOLERANCE = 1e-12
"""Relative tolerance of phases that are integrated."""

Choice = tuple[tuple[str, ContactMode] | None, ...]
"""Mode of every contact: it pushes or holds, and sticks or slips; None if it has no impulse."""


_End = tuple[ImpactState, Choice | None]
"""State at the end of a phase, and its choice if that ceased to be possible."""


@dataclass(frozen=True)
class ImpactPhase:
    """A choice that the law allows, the directions of slides that begin, (n_c, n_t), and its rates, (rows n_c)."""

    choice: Choice
    headings: np.ndarray
    rates: np.ndarray


@dataclass(frozen=True)
class ImpactProcess:
    """Rates of impulses at contact velocities J v, (rows n_c)."""

    jacobian: np.ndarray
    compliance: np.ndarray
    friction: np.ndarray
    touching: np.ndarray
    rows: int

    def settle(self, velocity: np.ndarray, small: float) -> None:
        """Set velocities to zero, in place, that are smaller than `small`: along the normal, and along all tangents."""
        normal, tangential = normal_rows(velocity, self.rows), tangential_rows(velocity, self.rows)
        normal[np.abs(normal) <= small] = 0.0
        tangential[np.linalg.norm(tangential, axis=1) <= small] = 0.0

    def phase(self, velocity: np.ndarray, left: Choice | None) -> ImpactPhase | None:
        """Return the phase that the law allows at a velocity, None if there is none.

        Args:
            left: a choice that has just ceased to be possible.
        """
        options: list[Sequence[tuple[str, ContactMode] | None]] = [
            self._options(*self._of(velocity, i)) if on else [None] for i, on in enumerate(self.touching)
        ]
        for choice in self._likely(velocity, options):
            if choice == left:
                continue
            headings = self._headings(choice, velocity)
            rates = self._rates_of(choice, headings)
            if self._allowed(choice, velocity, rates, headings, left):
                return ImpactPhase(choice, headings, rates)
        return None

    def _likely(
        self, velocity: np.ndarray, options: list[Sequence[tuple[str, ContactMode] | None]]
    ) -> Iterator[Choice]:
        """Yield all choices, in space those first that pivoting leads to.

        From the choice in which contacts that do not part stay, one that pulls gives up, one that would have to push
        more than others pushes as they do, and one outside its friction cone slides.
        """
        if self.rows > 2:
            stays = [max(own, key=_holding) for own in options]
            choice, seen = list(stays), set[Choice]()
            while tuple(choice) not in seen:
                seen.add(tuple(choice))
                yield tuple(choice)
                headings = self._headings(tuple(choice), velocity)
                rates = self._rates_of(tuple(choice), headings)
                rising = normal_rows(self.compliance @ rates, self.rows)
                for i, one in enumerate(choice):
                    push, friction = self._of(rates, i)
                    if one is None:
                        choice[i] = stays[i] if rising[i] < 0 else None
                    elif one[0] == "hold" and push < 0:
                        choice[i] = None
                    elif one[0] == "hold" and push > 1:
                        choice[i] = ("push", one[1])
                    elif one[1] is ContactMode.STICK and float(np.linalg.norm(friction)) > self.friction[i] * push:
                        choice[i] = (one[0], ContactMode.SLIP)
        yield from product(*options)

    def after(self, phase: ImpactPhase, state: ImpactState) -> _End | None:
        """Return the end of a phase; None if it has none."""
        slides = any(one and one[1].direction and self.friction[i] > 0 for i, one in enumerate(phase.choice))
        return self._integrated(phase, state) if self.rows > 2 and slides else self._straight(phase, state)

    def _hold(self, choice: Choice, velocity: np.ndarray) -> None:
        """Set velocities to zero, in place, that a choice has held: rates of redundant ones are not exactly zero."""
        for i, one in enumerate(choice):
            if one and one[0] == "hold":
                normal_rows(velocity, self.rows)[i] = 0.0
            if one and one[1] is ContactMode.STICK:
                tangential_rows(velocity, self.rows)[i] = 0.0

    def _straight(self, phase: ImpactPhase, state: ImpactState) -> _End | None:
        """Return the end of a phase in which all rates are constant; None if it has none."""
        velocity, slope = state.velocity, self.compliance @ phase.rates
        heading = np.repeat(self.touching, self.rows) & (velocity * slope < 0)
        lengths = np.full(len(velocity), np.inf)
        lengths[heading] = -velocity[heading] / slope[heading]
        row, spending = int(lengths.argmin()), state.lengths_to_spend(phase.rates, slope, self.rows)
        length = min(float(spending.min(initial=np.inf)), float(lengths[row]))
        if not np.isfinite(length):
            return None
        ended = state.advanced(phase.rates, slope, length, self.rows)
        self._hold(phase.choice, ended.velocity)
        if length < lengths[row]:
            return ended.spent(int(spending.argmin()), self.rows), None
        ended.velocity[row] = 0.0
        return ended, None

    def _integrated(self, phase: ImpactPhase, state: ImpactState) -> _End | None:
        """Return the end of a phase in which velocities turn: where one becomes zero, a restitution is spent, or its
        choice is not possible."""
        velocity = state.velocity
        scale = max(float(np.abs(velocity).max()), 1.0)
        count, headings = len(velocity), phase.headings.copy()

        def headings_at(y: np.ndarray) -> np.ndarray:
            turned = slip_headings(tangential_rows(y[:count], self.rows), headings, through_zero=True, slow=_SLOW)
            if not starting:
                return turned
            turned[starting] = headings[starting]
            found = self._beginning(phase.choice, turned, starting)
            return np.where(found.any(axis=1, keepdims=True), found, turned)

        def slope(_: float, y: np.ndarray) -> np.ndarray:
            rates = self._rates_of(phase.choice, headings_at(y))
            parting = normal_rows(y[:count], self.rows) + state.rebound
            return np.concatenate([self.compliance @ rates, rates, parting * normal_rows(rates, self.rows)])

        def watched(y: np.ndarray) -> np.ndarray:
            """Approach of every contact that pushes and parting of one that does not, slides, the room of the choice,
            and what is left of every restitution: what must stay positive."""
            normal, tangential = normal_rows(y[:count], self.rows), tangential_rows(y[:count], self.rows)
            approach = np.where(sides == 0, np.inf, sides * normal + beyond)
            slide = np.where(slipping, (tangential * headings).sum(axis=1) - SETTLED * scale, np.inf)
            room = self._room(phase.choice, self._rates_of(phase.choice, headings_at(y)))
            return np.concatenate([approach, slide, [room], np.where(state.rebound > 0, -y[2 * count :], np.inf)])

        sides = np.array([1 if one is None else -int(one[0] == "push") for one in phase.choice]) * self.touching
        beyond = np.where(normal_rows(velocity, self.rows) == 0, SETTLED * scale, 0.0)
        slipping = np.array([one is not None and one[1].direction != 0 for one in phase.choice])
        still = ~tangential_rows(velocity, self.rows).any(axis=1)
        starting = np.flatnonzero(slipping & still & (self.friction > 0)).tolist()
        stepper = DOP853(
            slope,
            0.0,
            np.concatenate([velocity, state.impulse, state.work]),
            np.inf,
            rtol=_PHASE_TOLERANCE,
            atol=1e-3 * _PHASE_TOLERANCE * scale,
        )
        before = watched(stepper.y)
        for _ in range(_STEPS):
            if stepper.status != "running":
                break
            stepper.max_step = self._before_stop(stepper.y[:count], stepper.f[:count], slipping)
            stepper.step()
            after = watched(stepper.y)
            ended = np.flatnonzero((before >= 0) & (after < 0))
            if ended.size:
                path = stepper.dense_output()
                values = _along(watched, path)
                times = [crossing_time(values, k, stepper.t_old, stepper.t) for k in ended.tolist()]
                first = int(np.argmin(times))
                return self._at_the_end(path(times[first]), int(ended[first]), phase.choice, state.rebound)
            if starting:
                headings[starting] = headings_at(stepper.y)[starting]
            slides = tangential_rows(stepper.y[:count], self.rows)
            starting = [i for i in starting if float(np.linalg.norm(slides[i])) <= _BEGUN]
            headings[:] = slip_headings(slides, headings, slow=_SLOW)
            before = after
        return None

    def _before_stop(self, velocity: np.ndarray, slope: np.ndarray, slipping: np.ndarray) -> float:
        """Return half of what is left of the slide that ends first, so that no step passes a stop: its direction has no
        derivative there."""
        tangential, drifting = (tangential_rows(each, self.rows)[slipping] for each in (velocity, slope))
        speeds = np.linalg.norm(tangential, axis=1)
        slowing = -(tangential * drifting).sum(axis=1) / np.maximum(speeds, _SLOW)
        ending = (slowing > 0) & (speeds > _SLOW)
        return float((0.5 * speeds[ending] / slowing[ending]).min(initial=np.inf))

    def _at_the_end(self, y: np.ndarray, which: int, choice: Choice, rebound: np.ndarray) -> _End:
        contacts = len(self.touching)
        velocity, impulse, work = np.split(y.copy(), [self.rows * contacts, 2 * self.rows * contacts])
        self._hold(choice, velocity)
        ended = ImpactState(velocity, impulse, rebound, work)
        if which < contacts:
            normal_rows(velocity, self.rows)[which] = 0.0
        elif which < 2 * contacts:
            tangential_rows(velocity, self.rows)[which - contacts] = 0.0
        elif which > 2 * contacts:
            return ended.spent(which - 2 * contacts - 1, self.rows), None
        return ended, None if which < 2 * contacts else choice

    def _of(self, values: np.ndarray, i: int) -> tuple[float, np.ndarray]:
        return float(normal_rows(values, self.rows)[i]), tangential_rows(values, self.rows)[i]

    def _options(self, normal: float, tangential: np.ndarray) -> list[tuple[str, ContactMode] | None]:
        if normal > 0:
            return [None]
        if self.rows > 2:
            slips = [ContactMode.SLIP] if tangential.any() else [ContactMode.STICK, ContactMode.SLIP]
        else:
            slips = {1: [ContactMode.SLIP_FORWARDS], -1: [ContactMode.SLIP_BACKWARDS], 0: list(_TANGENTIAL)}[
                int(np.sign(tangential[0]))
            ]
        pushes = ["push"] if normal < 0 else ["hold", "push"]
        return [*([None] if normal == 0 else []), *((push, slip) for push in pushes for slip in slips)]

    def _headings(self, choice: Choice, velocity: np.ndarray) -> np.ndarray:
        """Return the directions of all slides; of those that begin in space the one of their acceleration."""
        tangential = tangential_rows(velocity, self.rows)
        headings = slip_headings(tangential, slow=np.finfo(float).tiny)
        starting = [
            i
            for i, one in enumerate(choice)
            if one and one[1].direction and self.rows > 2 and self.friction[i] > 0 and not tangential[i].any()
        ]
        return self._beginning(choice, headings, starting) if starting else headings

    def _beginning(self, choice: Choice, headings: np.ndarray, starting: Sequence[int]) -> np.ndarray:
        """Return the directions of all slides, (n_c, n_t): of those in `starting` that of their acceleration."""
        held = tuple((one[0], ContactMode.STICK) if one and i in starting else one for i, one in enumerate(choice))
        pulls = -tangential_rows(self._rates_of(held, headings), self.rows)

        def drift(directions: np.ndarray) -> np.ndarray:
            return tangential_rows(self.compliance @ self._rates_of(choice, directions), self.rows)

        return beginning_headings(drift, pulls, headings, starting)

    def _rates_of(self, choice: Choice, headings: np.ndarray) -> np.ndarray:
        """Return rates of pushing contacts and those that hold velocities of others at zero."""
        size, count = self.rows, self.rows * len(choice)
        unit, pushed = np.eye(count), np.zeros(count)
        rows: list[int] = []
        columns: list[np.ndarray] = []
        bounds: list[np.ndarray] = []
        offsets: list[float] = []
        for i, chosen in enumerate(choice):
            if chosen is None:
                continue
            kind, slip = chosen
            tangents = range(size * i + 1, size * (i + 1))
            direction = unit[size * i].copy()
            direction[list(tangents)] -= self.friction[i] * slip.direction * headings[i]
            if kind == "push":
                pushed += direction
            else:
                rows.append(size * i)
                columns.append(direction)
                bounds += [unit[size * i], -unit[size * i]]
                offsets += [0.0, 1.0]
            if slip is ContactMode.STICK:
                rows += tangents
                columns += [unit[row] for row in tangents]
                for facet in cone_facets(size - 1):
                    bounds.append(self.friction[i] * unit[size * i] - facet @ unit[list(tangents)])
                    offsets.append(0.0)
        if not rows:
            return pushed
        spread, limits = np.array(columns).T, np.array(bounds)
        matrix, wanted = (self.compliance @ spread)[rows], -(self.compliance @ pushed)[rows]
        held = np.linalg.lstsq(matrix, wanted, rcond=SINGULAR)[0]
        held = widest_split(held, self.jacobian.T @ spread, limits @ spread, limits @ pushed + np.array(offsets))
        return np.asarray(pushed + spread @ held)

    def _room(self, choice: Choice, rates: np.ndarray) -> float:
        """Return the smallest of the rates that must not be negative, and a little more."""
        least = 1.0
        for i, chosen in enumerate(choice):
            if chosen is None:
                continue
            push, friction = self._of(rates, i)
            if chosen[0] == "hold":
                least = min(least, push, 1.0 - push)
            if chosen[1] is ContactMode.STICK:
                least = min(least, self.friction[i] * push - float(np.linalg.norm(friction)))
        return least + 1e3 * ZERO_OF_LARGEST

    def _allowed(
        self, choice: Choice, velocity: np.ndarray, rates: np.ndarray, headings: np.ndarray, left: Choice | None
    ) -> bool:
        """Return whether the law allows a choice.

        A slide that begins accelerates; by however little if its contact stuck in the choice that was just left, with a
        force that hardly left its cone.
        """
        slope = self.compliance @ rates
        scale = 1.0 + np.abs(self.compliance).max()
        small_rate, small_slope, small_held = 1e3 * ZERO_OF_LARGEST, 1e3 * ZERO_OF_LARGEST * scale, _HELD * scale
        for i, chosen in enumerate(choice):
            if not self.touching[i]:
                continue
            (normal, tangential), (rising, drifting) = self._of(velocity, i), self._of(slope, i)
            if chosen is None:
                if normal == 0 and rising < -small_slope:
                    return False
                continue
            kind, slip = chosen
            push, friction = self._of(rates, i)
            if kind == "push" and normal == 0 and rising > small_slope:
                return False
            if kind == "hold" and (not -small_rate <= push <= 1 + small_rate or abs(rising) > small_held):
                return False
            if slip is ContactMode.STICK:
                too_much = float(np.linalg.norm(friction)) > self.friction[i] * push + small_rate
                if too_much or np.abs(drifting).max() > small_held:
                    return False
            elif not tangential.any() and self.friction[i] > 0:
                before = left[i] if left else None
                stuck = before is not None and before[1] is ContactMode.STICK
                if slip.direction * headings[i] @ drifting <= (0.0 if stuck else small_slope):
                    return False
        return True


def _holding(choice: tuple[str, ContactMode] | None) -> tuple[bool, bool, bool]:
    """Return the order in which contacts are taken to do things at first: hold before push, stick before slip."""
    return (
        choice is not None,
        choice is not None and choice[0] == "hold",
        choice is not None and choice[1] is ContactMode.STICK,
    )


def _along(
    values: Callable[[np.ndarray], np.ndarray], path: Callable[[float], np.ndarray]
) -> Callable[[float], np.ndarray]:
    return lambda t: values(path(t))


_TANGENTIAL = (ContactMode.STICK, ContactMode.SLIP_FORWARDS, ContactMode.SLIP_BACKWARDS)
