"""Integration from switch to switch, with steps as long as the error allows."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fesd_robot.fesd.adaptive.ambiguity import repelling, several
from fesd_robot.fesd.adaptive.one_element import OneElement, SolvedElement
from fesd_robot.fesd.adaptive.point_modes import PointMode, PointModes
from fesd_robot.fesd.adaptive.zeno import ZenoWatch
from fesd_robot.fesd.simulation import Note

CLOSED = 1e-11
"""Largest G of a pair that counts as zero, in units of the largest G."""

FOLD = 1e-7
"""Part of the interval to which steps shrink where the multipliers of a mode cease to exist."""

MAX_ATTEMPTS = 60
"""Attempts at one element, each shorter or in another mode."""


@dataclass
class Accepted:
    """An accepted element: its start and mode, what was solved, and the work of all attempts."""

    start: float
    x_left: np.ndarray
    z_left: np.ndarray
    mode: np.ndarray
    solved: SolvedElement
    attempts: int
    iterations: int
    switched: bool


class IntegrationFailure(Exception):
    """Why an integration cannot go on."""


@dataclass
class Integration:
    """The state of an integration over one interval of constant control.

    Args:
        equations, points: of the system.
        u, p: control and parameters.
        rtol, atol: local errors are kept below atol + rtol |x|, in root mean square.
        longest: upper bound of a step.
        time, x, z: where it starts; z is a guess.
        likely: a mode it may start in.
    """

    equations: OneElement
    points: PointModes
    u: np.ndarray
    p: np.ndarray
    rtol: float
    atol: np.ndarray | float
    longest: float
    time: float
    x: np.ndarray
    z: np.ndarray
    likely: np.ndarray
    h: float = 0.0
    notes: list[Note] = field(default_factory=list)
    zeno: ZenoWatch = field(default_factory=ZenoWatch)
    _alternatives: list[PointMode] = field(default_factory=list)
    _repelling: bool = False
    _begun: float = 0.0
    _end: tuple[SolvedElement, PointMode] | None = None
    _last: SolvedElement | None = None
    _new: np.ndarray | None = None

    def begin(self, time: float, u: np.ndarray) -> None:
        """Begin an interval with another control."""
        self.time, self.u, self._last, self._begun = time, u, None, time
        self._select(None)

    # -- modes -----------------------------------------------------------------------------------------------------

    def _closed(self, G: np.ndarray) -> np.ndarray:
        return np.asarray(max(CLOSED, self.zeno.closeness) * (1.0 + np.abs(G).max(initial=0.0)) >= G)

    def _select(self, ended: int | None) -> None:
        """Choose the mode that goes on from here; ``ended`` is the pair at whose sign a mode ended, None at a start."""
        G, _ = self.points.sides(self.x, self.u, self.z, self.p)
        closed = self._closed(G)
        about = closed & ~self.likely
        if ended is not None:
            about[ended] = True
        found = self.points.fitting((self.x, self.u, self.z, self.p), closed, self.likely, about)
        if not found:
            raise IntegrationFailure("no mode has all signs right there")
        if text := several(self.points, found):
            self.notes.append(Note(self.time, text))
        self._alternatives = found
        self._take(found[0], closed)

    def _take(self, chosen: PointMode, closed: np.ndarray) -> None:
        self.likely, self.z, self.rate = chosen.mode, chosen.z, chosen.rate
        if self._sliding:
            self.x = self.points.projected(self.x, self.u, self.z, self.p, self.likely)
        self._repelling = False
        self._new, self._last = closed & ~chosen.mode, None

    def _name(self, mode: np.ndarray) -> str:
        return self.points.system.in_words(mode)

    @property
    def _sliding(self) -> int:
        """Number of groups with more than one active pair."""
        return sum(int(self.likely[own].sum() > 1) for own in self.points.groups.groups)

    def _leave_fold(self) -> None:
        """Go on where the H of a sliding mode on several surfaces cease to exist, if another mode fits there."""
        G, _ = self.points.sides(self.x, self.u, self.z, self.p)
        closed, ending = self._closed(G), self._name(self.likely)
        found = self.points.fitting((self.x, self.u, self.z, self.p), closed, self.likely, closed)
        others = [one for one in found if (one.mode != self.likely).any()]
        if not others:
            raise IntegrationFailure(f"the sliding mode {ending} ceases to exist, and no other mode fits")
        text = f"not unique: H of {ending} ceases to exist, the motion goes on in {self._name(others[0].mode)}"
        self.notes.append(Note(self.time, text))
        self._alternatives = others
        self._take(others[0], closed)

    def _look_around(self) -> None:
        """Note where other motions could leave a sliding mode on several surfaces."""
        if self._repelling:
            return
        point = (self.x, self.u, self.z, self.p)
        closed = self._closed(self.points.sides(*point)[0])
        if text := repelling(self.points, point, self.likely, closed, self.rate):
            self._repelling = True
            self.notes.append(Note(self.time, text))

    # -- steps -----------------------------------------------------------------------------------------------------

    @cached_property
    def _error_weight(self) -> float:
        """gamma of the embedded formula x_0 + h gamma (K_0 - ...): the mean size of the eigenvalues of A."""
        return float(abs(np.linalg.det(self.equations.tableau.A)) ** (1.0 / self.equations.stages))

    def _error(self, solved: SolvedElement) -> float:
        """Return the norm of the difference to the embedded formula with n_s + 1 nodes; at most 1 is accepted."""
        off = solved.h * self._error_weight * (self.rate - self.equations.to_left @ solved.slopes)
        scale = self.atol + self.rtol * np.maximum(np.abs(self.x), np.abs(solved.x[-1]))
        scaled = off / scale
        return float(np.sqrt(scaled @ scaled / len(scaled)))

    def _first_step(self, left: float) -> float:
        """Return about a hundredth of the time scale of the state, as in Hairer, Norsett and Wanner, II.4."""
        scale = self.atol + self.rtol * np.abs(self.x)
        size, speed = (float(np.sqrt(np.mean((v / scale) ** 2))) for v in (self.x, self.rate))
        return min(left, 0.05 * size / speed if min(size, speed) > 1e-5 else 1e-3 * left)

    def step(self, end: float) -> Accepted:
        """Return the next element, which ends at a switch, at `end` or where the error wants it to."""
        left, span = end - self.time, end - self._begun
        h = min(self.h or self._first_step(left), self.longest, left)
        if left - h < 0.1 * h:
            h = left if left <= self.longest else 0.5 * left
        tried, iterations = [self.likely.tobytes()], 0
        stages = self.equations.stages
        for attempt in range(1, MAX_ATTEMPTS + 1):
            if self._sliding > 1 and h <= FOLD * span:
                self._leave_fold()
                h = min(1e-3 * span, left)
            if h <= 1e-14 * max(abs(self.time), left):
                raise IntegrationFailure(f"the step had to become shorter than {h:.1e}")
            solved = self._solve(h)
            iterations += solved.iterations if solved else 0
            if solved is None:
                h *= 0.25
                continue
            error = self._error(solved)
            if error > 1.0:
                h *= max(0.1, 0.9 * error ** (-1.0 / (stages + 1)))
                continue
            event = self._event(solved)
            if event is None:
                self.h = h * min(5.0, 0.9 * max(error, 1e-10) ** (-1.0 / (stages + 1)))
                return self._accept(solved, attempt, iterations, end, None)
            time, pair, leaving = event
            if time <= 1e-13 * max(left, h) or (self._last is None and time * 1e8 < h):
                if self._other_mode(tried):
                    continue
                if self._last is None:
                    raise IntegrationFailure(f"after a switch no mode keeps its signs ({self._name(self.likely)})")
                self._switch_here(leaving, pair)
                tried = [self.likely.tobytes()]
                continue
            ended = self._end_at(solved, time, pair, leaving)
            if ended is None or self._passed(ended, pair):
                h = 0.7 * time if time > 0.05 * h else 0.3 * h
                continue
            self.h = max(h, ended.h)
            return self._accept(ended, attempt, iterations + ended.iterations, end, pair)
        raise IntegrationFailure(f"{MAX_ATTEMPTS} attempts at an element did not succeed")

    def _solve(self, h: float) -> SolvedElement | None:
        start = self.equations.predict(self._last, h) if self._last else self.equations.constant(self.rate, self.z)
        solved = self.equations.solve(start, self.x, h, self.u, self.p, self.likely)
        if solved is None and self._last:
            start = self.equations.constant(self.rate, self.z)
            solved = self.equations.solve(start, self.x, h, self.u, self.p, self.likely)
        return solved

    def _event(self, solved: SolvedElement) -> tuple[float, int, bool] | None:
        """Return time, pair and kind of the first wrong sign; the time counts from the left end."""
        places, with_left, stages_only = self.equations.samples
        G_left = np.maximum(self.points.sides(self.x, self.u, self.z, self.p)[0], 0.0)
        G = np.where(self.likely, 0.0, with_left @ np.vstack([G_left, solved.G]))
        H = np.where(self.likely, stages_only @ solved.H, 0.0)
        wrong_G = -1e-11 * (1.0 + np.abs(solved.G).max(axis=0)) > G
        wrong_H = H < -1e-9
        if self._new is not None and self._last is None:
            # Where a pair has just become inactive, a dip that ends inside the element is an error of its switch.
            wrong_G[:, self._new & (solved.G[-1] > 0.0)] &= G[:, self._new & (solved.G[-1] > 0.0)] < -1e-8
        rows = np.flatnonzero((wrong_G | wrong_H).any(axis=1))
        if not rows.size:
            return self._late_leaving(solved)
        k = int(rows[0])
        before = places[k - 1] if k else 0.0
        best: tuple[float, int, bool] | None = None
        for pair in np.flatnonzero(wrong_G[k] | wrong_H[k]).tolist():
            leaving = bool(wrong_H[k, pair])
            if leaving:
                polynomial = self.equations.coefficients @ solved.H[:, pair]
            else:
                values = np.append(G_left[pair], solved.G[:, pair])
                polynomial = self.equations.coefficients_with_left @ values
            time = solved.h * _zero(polynomial.tolist(), float(before), float(places[k]))
            if best is None or time < best[0]:
                best = (time, pair, leaving)
        return best

    def _late_leaving(self, solved: SolvedElement) -> tuple[float, int, bool] | None:
        """Return the end of a sliding mode that the stages do not see: H at the right end with hidden constraints."""
        if not self._sliding:
            return None
        exact = self._at_end(solved)
        if not exact.consistent:
            return None
        active = np.flatnonzero(self.likely & (exact.H < -1e-9))
        if not active.size:
            return None
        pair = int(active[np.argmin(exact.H[active])])
        start = self.points.solve(self.x, self.u, self.z, self.p, self.likely).H[pair]
        return (solved.h * start / (start - exact.H[pair]) if start > 0 else 0.0), pair, True

    def _at_end(self, solved: SolvedElement) -> PointMode:
        """Return the mode at the right end of an element, with hidden constraints."""
        if self._end is None or self._end[0] is not solved:
            self._end = (solved, self.points.solve(solved.x[-1], self.u, solved.z[-1], self.p, self.likely))
        return self._end[1]

    def _end_at(self, solved: SolvedElement, time: float, pair: int, leaving: bool) -> SolvedElement | None:
        """Return the element that ends at an event."""
        if not leaving:
            return self.equations.solve_to_zero(solved, self.x, time, self.u, self.p, self.likely, pair)
        before = (0.0, float(self.points.solve(self.x, self.u, self.z, self.p, self.likely).H[pair]))
        if before[1] <= 0.0:
            return None
        beyond = (solved.h, min(float(self._at_end(solved).H[pair]), float(solved.H[-1, pair])))
        h, best = float(np.clip(time, 1e-3 * solved.h, solved.h)), None
        for _ in range(12):
            start = self.equations.continued(solved, h / solved.h * self.equations.tableau.c)
            best = self.equations.solve(start, self.x, h, self.u, self.p, self.likely)
            if best is None:
                return None
            value = float(self._at_end(best).H[pair])
            if abs(value) <= 1e-12:
                return best
            if value > 0.0:
                before = (h, value)
            else:
                beyond = (h, value)
            if beyond[1] >= 0.0 or beyond[0] - before[0] <= 1e-14 * solved.h:
                return best
            h = before[0] + (beyond[0] - before[0]) * before[1] / (before[1] - beyond[1])
            share = (h - before[0]) / (beyond[0] - before[0])
            if not 0.02 < share < 0.98:
                h = before[0] + (beyond[0] - before[0]) * float(np.clip(share, 0.02, 0.98))
                if abs(value) < 1e-7:
                    h = before[0] + (beyond[0] - before[0]) * share
        return best

    def _passed(self, ended: SolvedElement, pair: int) -> bool:
        """Return whether an element that ends at an event has no length, or passes another event."""
        if ended.h <= 0.0:
            return True
        event = self._event(ended)
        return event is not None and event[1] != pair and event[0] < ended.h * (1.0 - 1e-9)

    def _other_mode(self, tried: list[bytes]) -> bool:
        """Take another mode that fits the point to first order, where the one that was tried is wrong at once."""
        if self._last is not None:
            return False
        for one in self._alternatives:
            if one.mode.tobytes() not in tried:
                tried.append(one.mode.tobytes())
                closed = self.likely | (self._new if self._new is not None else self.likely)
                self._take(one, closed)
                return True
        return False

    def _switch_here(self, leaving: bool, pair: int) -> None:
        """Switch at the left end of an element."""
        before = self.likely
        self._select(pair)
        if (self.likely == before).all() and not self._other_mode([before.tobytes()]):
            if not leaving:
                raise IntegrationFailure(f"a sign is wrong at once in {self._name(before)}, and no other mode fits")
            mode = before.copy()
            mode[pair] = False
            self._take(self.points.solve(self.x, self.u, self.z, self.p, mode), before)

    def _accept(self, solved: SolvedElement, attempts: int, iterations: int, end: float, ended: int | None) -> Accepted:
        switched = ended is not None
        accepted = Accepted(self.time, self.x, self.z, self.likely, solved, attempts, iterations, switched)
        self.time = end if abs(self.time + solved.h - end) <= 1e-14 * max(abs(end), 1.0) else self.time + solved.h
        self.x, self.z = solved.x[-1], solved.z[-1]
        if not switched:
            self.rate, self._last = solved.slopes[-1], solved
            if self._sliding:
                exact = self._at_end(solved)
                if exact.consistent:
                    self.rate = exact.rate
                if self._sliding > 1:
                    self._look_around()
            return accepted
        self._last = None
        self.zeno.note(self.time)
        if self.zeno.text and not any(note.text.startswith("Zeno") for note in self.notes):
            self.notes.append(Note(self.time, self.zeno.text))
        before = self.likely
        self._select(ended)
        if (self.likely == before).all():
            self._other_mode([before.tobytes()])
        return accepted


def _zero(coefficients: list[float], low: float, high: float) -> float:
    """Return where a polynomial becomes negative, between two fractions; the first if it is negative there."""

    def value(at: float) -> float:
        result = 0.0
        for coefficient in reversed(coefficients):
            result = result * at + coefficient
        return result

    for _ in range(14):
        middle = 0.5 * (low + high)
        if value(middle) < 0.0:
            high = middle
        else:
            low = middle
    before, after = value(low), value(high)
    return low + (high - low) * before / (before - after) if before > 0.0 > after else low
