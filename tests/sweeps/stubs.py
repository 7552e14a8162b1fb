"""What stands for a plan in tests of sweeps: functions that a process of its own can import."""

from __future__ import annotations

import json
import os
import signal
import time
from pathlib import Path

from fesd_robot.errors import TaskError
from fesd_robot.sweeps import Answer, Order, Verdict


def value(order: Order, key: str) -> float:
    """Return the value of a key in an order."""
    return float(json.loads(next(one.partition("=")[2] for one in order.overrides if one.startswith(f"{key}="))))


def answer(order: Order, cost: float, files: dict[str, bytes] | None = None) -> Answer:
    """Return a solved answer."""
    values = {"cost": cost, "time": 1.0, "flights": 1, "slides": 0.25, "iterations": 7, "attempts": 1}
    return Answer(
        order.number, Verdict.SOLVED, {**values, "end.root_x": cost}, "Solved, with a comma.", files=files or {}
    )


def parabola(order: Order, task: Path) -> Answer:
    """Return a cost that is least in the middle; the task has to be there, with its model."""
    assert (task.parent / "../models/hopper/hopper.urdf").resolve().is_file()
    assert "hopper_one_jump" in task.read_text()
    x = value(order, "goal.configuration.root_x")
    return answer(order, (x - 1.0) ** 2, {"plan.json": str(x).encode()} if order.keep != "none" else None)


def slow(order: Order, task: Path) -> Answer:
    """Take thirty milliseconds."""
    time.sleep(0.03)
    return parabola(order, task)


def fragile(order: Order, task: Path) -> Answer:
    """Crash, hang, eat memory, fail or refuse where the number of the row says so."""
    number = order.number % 8
    if number == 1:
        os.kill(os.getpid(), signal.SIGSEGV)
    if number == 2:
        os._exit(7)
    if number == 3:
        time.sleep(1000.0)
    if number == 4:
        eaten = []
        while True:
            eaten.append(b"x" * 50_000_000)
            time.sleep(0.01)
    if number == 5:
        raise ZeroDivisionError("a mistake\nin two lines")
    if number == 6:
        raise TaskError("found nothing, expected something")
    return parabola(order, task)


def kills_itself_once(order: Order, task: Path) -> Answer:
    """End the Dask worker that this process belongs to, once; a file beside the task's name says that it was."""
    marker = Path(os.environ["FESD_ROBOT_TEST_MARKER"])
    if order.number == 5 and not marker.exists():
        marker.write_text("killed")
        grandparent = int(os.environ["FESD_ROBOT_TEST_WORKER"]) if "FESD_ROBOT_TEST_WORKER" in os.environ else 0
        if grandparent:
            os.kill(grandparent, signal.SIGKILL)
        time.sleep(5.0)
    return parabola(order, task)


def named(order: Order, task: Path) -> Answer:
    """Answer with the name that the task file has, and with the first override."""
    name = next(line for line in task.read_text().splitlines() if line.startswith("name:")).removeprefix("name: ")
    return Answer(order.number, Verdict.SOLVED, {"cost": 1.0, "name": name, "first": order.overrides[0]}, "Solved.")


def noted(order: Order, task: Path) -> Answer:
    """Say from which row it begins."""
    begun = order.start.number if order.start else None
    made = parabola(order, task)
    return Answer(order.number, Verdict.SOLVED, {**made.values, "start": begun}, "Solved.", files=made.files)


def alone_only(order: Order, task: Path) -> Answer:
    """End its process where it begins from another row."""
    if order.start:
        os._exit(7)
    return parabola(order, task)


def endless(order: Order, task: Path) -> Answer:
    """Say that it has begun, and never end."""
    Path(os.environ["FESD_ROBOT_TEST_MARKER"]).write_text(str(os.getpid()))
    time.sleep(1000.0)
    return parabola(order, task)
