"""Results of a function in the order of its arguments, computed by any number of processes."""

from __future__ import annotations

import multiprocessing
import os
import sys
import time
from pathlib import Path

import pytest

from fesd_robot.running import processes as cores
from fesd_robot.running.lookahead import Lookahead
from fesd_robot.running.processes import Cores, cores_for, free_cores

TASK = Path(__file__).parents[2] / "tasks" / "published_hopper_one_jump.yaml"

on_linux = pytest.mark.skipif(sys.platform != "linux", reason="processes are forked on Linux only")


class Squares:
    """Squares of numbers, and the process that they come from; the larger ones are there sooner."""

    def __init__(self) -> None:
        self.offset, self.left_alone = 0, False

    def __call__(self, number: int) -> tuple[int, int]:
        if number < 0:
            os._exit(1)
        time.sleep(0.02 * max(5 - number, 0))
        return number**2 + self.offset, os.getpid() if self.left_alone else 0

    def alone(self) -> None:
        self.left_alone = True


def ahead(count: int, stop: bool = False) -> Lookahead[int, tuple[int, int]]:
    squares = Squares()
    return Lookahead(squares, Cores(count), (lambda *_: stop), squares.alone)


@on_linux
def test_order_and_values_do_not_depend_on_the_number_of_processes() -> None:
    """The same squares in the same order from one process and from three, of which this one is none."""
    one, three = ahead(1), ahead(3)
    numbers = list(range(8))
    here, there = list(one.results(numbers)), list(three.results(numbers))
    assert [square for square, _ in here] == [square for square, _ in there] == [n**2 for n in numbers]
    assert {process for _, process in here} == {0}
    assert 1 < len({process for _, process in there}) <= 3 and os.getpid() not in {process for _, process in there}
    three.close()


@on_linux
def test_what_is_not_asked_for_is_dropped() -> None:
    """After a generator is left, the next arguments have their own results; what runs is not mistaken for them."""
    several = ahead(2)
    for square, _ in several.results([0, 1, 2, 3, 4]):
        assert square == 0
        break
    assert [square for square, _ in several.results([7, 6])] == [49, 36]
    several.close()


@on_linux
def test_a_stop_ends_the_results() -> None:
    """Nothing is yielded once the user wants to stop, and nothing hangs."""
    stopped = ahead(2, stop=True)
    assert list(stopped.results([0, 1, 2])) == []
    stopped.close()


@on_linux
def test_cores_that_become_free_are_used() -> None:
    """With one core results are of this process; with two and with four they are of as many others, and back again."""
    squares, cores = Squares(), Cores(1)
    several = Lookahead(squares, cores, None, squares.alone)
    numbers = [number % 2 for number in range(28)]
    results = several.results(numbers)
    busy = [next(results) for _ in range(2)]
    cores.most = 2
    half = [next(results) for _ in range(6)]
    cores.most = 4
    alone = [next(results) for _ in range(10)]
    cores.most = 1
    rest = list(results)
    several.close()
    assert [square for square, _ in busy + half + alone + rest] == numbers
    assert {process for _, process in busy} == {0} and len({process for _, process in half}) == 2
    assert len({process for _, process in alone}) >= 4 and 0 not in {process for _, process in alone}
    assert rest[-1][1] == 0


@on_linux
def test_a_lost_process_is_replaced_by_this_one(caplog: pytest.LogCaptureFixture) -> None:
    """Where a process dies, as by the kernel when memory is short, a warning says so and this process goes on."""
    squares = Squares()
    parent = os.getpid()

    def fragile(number: int) -> int:
        if number == 2 and os.getpid() != parent:
            os._exit(1)
        return squares(number)[0]

    several = Lookahead(fragile, Cores(2), None, squares.alone)
    assert list(several.results([0, 1, 2, 3])) == [0, 1, 4, 9]
    assert "was ended; the search goes on in one process" in caplog.text
    assert list(several.results([5])) == [25]


def test_processes_of_others_have_one_core() -> None:
    """A process that was started beside others has no further ones, even if its task asks for some; this one may."""
    assert 1 <= free_cores() <= (os.cpu_count() or 1)
    assert cores_for(3).share == 3 and cores_for(None).share <= (os.cpu_count() or 1)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert pool.apply(cores_for, (None,)).share == 1
        assert pool.apply(cores_for, (3,)).share == 1


def test_busy_cores_are_not_free(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the cores that this process may use those are free that do nothing; one of them is always its own."""
    monkeypatch.setattr(cores.os, "sched_getaffinity", lambda _: {0, 1, 2, 5, 9}, raising=False)
    for busy, free in (
        ([0.0] * 10, 5),
        ([100.0, 0.0, 95.0, 100.0, 100.0, 0.0, 100.0, 0.0, 0.0, 5.0], 3),
        ([100.0] * 10, 1),
        ([0.0] * 4, 3),
    ):
        monkeypatch.setattr(cores.psutil, "cpu_percent", lambda busy=busy, **_: busy)
        assert free_cores() == free
