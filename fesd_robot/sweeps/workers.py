"""Processes that each do one thing after another, watched from outside: what goes wrong in one is an outcome."""

from __future__ import annotations

import contextlib
import ctypes
import faulthandler
import logging
import multiprocessing
import os
import pickle
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import IO, Any

import psutil

from fesd_robot.errors import FesdRobotError, SweepError
from fesd_robot.sweeps.order import UNLIMITED, Limits, Verdict

logger = logging.getLogger(__name__)

PRELOADED = ("fesd_robot.sweeps.planned",)
"""Modules that the process has imported from which workers are forked."""

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Variables of the environment by which numerical libraries of a worker keep to its core."""

_GLANCE = 0.1
"""s between two looks at the memory of a process."""

_TO_START = 120.0
"""s that a process may take to begin, in which the first one imports the program."""

_RESTED_MEGABYTES = 1500.0
"""Memory at rest from which on a process makes place for a new one."""

_PARENT_DEATH_SIGNAL = 1
"""PR_SET_PDEATHSIG of prctl(2)."""

_FIRST_TO_GO = "1000"
"""oom_score_adj: of all processes, the system ends workers first where memory is short."""

_STARTING = threading.Lock()


@dataclass(frozen=True)
class Outcome:
    """What became of an argument.

    Args:
        value: of the function, None where none came.
        verdict: why none came, None where one did.
        message: one sentence about that.
        seconds: that it took.
        megabytes: most memory that the process had, None where the system does not say it.
    """

    value: Any = None
    verdict: Verdict | None = None
    message: str = ""
    seconds: float = 0.0
    megabytes: float | None = None


class Worker:
    """A process for one argument after another, which is replaced where it does not survive one.

    Args:
        function: argument -> value; both are pickled, and so is it: a function of a module, or a partial of one.
    """

    def __init__(self, function: Callable[[Any], Any]) -> None:
        self._function = function
        self._process: Any = None
        self._connection: Connection | None = None
        self._said: IO[bytes] | None = None

    def outcome(self, argument: Any, limits: Limits = UNLIMITED) -> Outcome:
        """Return what becomes of an argument, whatever happens in the process.

        Args:
            argument: of the function.
            limits: what it may take.
        """
        try:
            process, connection, said = self._started()
            begin = time.monotonic()
            connection.send(argument)
        except (OSError, EOFError, SweepError) as error:
            self.end()
            return Outcome(verdict=Verdict.CRASHED, message=f"its process could not be started: {error!r}")
        try:
            most, verdict, message = _watched(process, connection, limits, begin)
        except OSError:  # it was ended from another thread
            most, verdict, message = None, Verdict.CRASHED, ""
        if verdict is None:
            try:
                outcome, at_rest = connection.recv()
                if at_rest > _RESTED_MEGABYTES:
                    self.end()
                megabytes = outcome.megabytes or most
                return replace(outcome, seconds=time.monotonic() - begin, megabytes=megabytes)
            except (EOFError, OSError, pickle.UnpicklingError):
                verdict = Verdict.CRASHED
        if verdict is Verdict.CRASHED:
            message = _last_words(process, said)
        self.end()
        return Outcome(None, verdict, message, time.monotonic() - begin, most)

    def end(self) -> None:
        """End the process at once, whatever it does."""
        process, self._process = self._process, None
        if self._connection:
            self._connection.close()
            self._connection = None
        if process is not None:
            process.kill()
            process.join(5.0)
        if self._said:
            self._said.close()
            self._said = None

    def _started(self) -> tuple[Any, Connection, IO[bytes]]:
        """Return the process, the connection to it and what it says, new ones where there are none."""
        if self._process is not None and self._process.is_alive() and self._connection and self._said:
            return self._process, self._connection, self._said
        self.end()
        self._said = tempfile.TemporaryFile()  # noqa: SIM115, closed in `end`
        context = _context()
        with _STARTING:  # what is inherited is that of one process
            own, other = context.Pipe()
            said = _inheritable(self._said)
            self._process = context.Process(target=_serve, args=(other, said, self._function), name="plan")
            self._process.start()
            other.close()
        self._connection = own
        if not wait([own, self._process.sentinel], _TO_START) or not own.poll():
            raise SweepError(f"it does not begin within {_TO_START:g} s")
        own.recv()
        return self._process, own, self._said


def _watched(
    process: Any, connection: Connection, limits: Limits, begin: float
) -> tuple[float | None, Verdict | None, str]:
    """Wait for an answer; return the most memory seen, MB, and why none will come, None if one is there."""
    most: float | None = None
    watched = psutil.Process(process.pid) if psutil.pid_exists(process.pid) else None
    killed_after = limits.killed_after
    while True:
        ready = wait([connection, process.sentinel], _GLANCE)
        if connection in ready or (ready and connection.poll()):
            return most, None, ""
        if ready:
            return most, Verdict.CRASHED, ""
        if watched is not None:
            with contextlib.suppress(psutil.Error):
                most = max(most or 0.0, watched.memory_info().rss / 1e6)
        if limits.megabytes is not None and (most or 0.0) > limits.megabytes:
            return most, Verdict.MEMORY, f"its process had {most:.0f} MB, more than {limits.megabytes:.0f} MB"
        if killed_after is not None and time.monotonic() - begin > killed_after:
            return most, Verdict.TIMEOUT, f"it did not end within its time limit of {limits.seconds:g} s"


def _last_words(process: Any, said: IO[bytes]) -> str:
    """Return how a process ended."""
    process.join(5.0)
    code, words = process.exitcode, ""
    with contextlib.suppress(ValueError):  # closed from another thread
        said.seek(0)
        lines = said.read().decode(errors="replace").splitlines()
        words = next((line.strip() for line in lines if line.strip()), "")
    if code is not None and code < 0:
        name = signal.Signals(-code).name if -code in set(signal.Signals) else str(-code)
        short = ", as where memory is short" if -code == signal.SIGKILL else ""
        how = f"its process was ended by {name}{short}"
    else:
        how = f"its process ended with status {code}"
    return f"{how}: {words}" if words else how


def _context() -> Any:
    """Return how processes start: forked from one that has imported the program and does nothing else."""
    process = multiprocessing.current_process()
    if process.daemon:  # as of Dask; workers end with the process that they are forked from, which ends with this one
        process._config["daemon"] = False  # type: ignore[attr-defined]
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    with _STARTING, _one_thread():
        context.set_forkserver_preload(list(PRELOADED))
        from multiprocessing import forkserver

        forkserver.ensure_running()
    return context


@contextlib.contextmanager
def _one_thread() -> Iterator[None]:
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update({name: "1" for name in ONE_THREAD if before[name] is None})
    try:
        yield
    finally:
        for name in (name for name, value in before.items() if value is None):
            os.environ.pop(name, None)


def _inheritable(file: IO[bytes]) -> Any:
    """Return an open file as it is sent to another process."""
    if sys.platform == "win32":
        return None
    from multiprocessing.reduction import DupFd

    return _Sent(file.fileno(), DupFd)


class _Sent:
    """An open file that is on its way to another process."""

    def __init__(self, number: int, duplicate: Any) -> None:
        self._number, self._duplicate = number, duplicate

    def __reduce__(self) -> Any:
        return _received, (self._duplicate(self._number),)


def _received(duplicate: Any) -> int:
    return int(duplicate.detach())


def _serve(connection: Connection, said: int | None, function: Callable[[Any], Any]) -> None:
    """Return the values of arguments until none come."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _leave_forkserver()
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PARENT_DEATH_SIGNAL, signal.SIGKILL)
        with contextlib.suppress(OSError):
            Path("/proc/self/oom_score_adj").write_text(_FIRST_TO_GO)
    if said is not None:
        os.dup2(said, 1)
        os.dup2(said, 2)
        sys.stdout = sys.stderr = open(2, "w", buffering=1, errors="replace", closefd=False)  # noqa: SIM115
        faulthandler.enable()
    connection.send(None)
    while True:
        try:
            argument = connection.recv()
        except (EOFError, OSError):
            return
        if said is not None:
            os.ftruncate(said, 0)
            os.lseek(said, 0, os.SEEK_SET)
        _reset_peak()
        outcome = replace(_tried(function, argument), megabytes=_memory("VmHWM"))
        try:
            connection.send((outcome, _memory("VmRSS") or 0.0))
        except (EOFError, BrokenPipeError):
            return
        except Exception as error:
            broken = Outcome(None, Verdict.ERROR, f"its value cannot be sent: {error}", megabytes=outcome.megabytes)
            connection.send((broken, 0.0))


def _leave_forkserver() -> None:
    """Close the pipe by which a process keeps alive the one that it is forked from.

    That one then ends with the program that started it, and this one with it, whatever it does.
    """
    if "forkserver" in multiprocessing.get_all_start_methods():
        from multiprocessing import forkserver

        known: Any = forkserver._forkserver
        alive, known._forkserver_alive_fd = known._forkserver_alive_fd, None
        if alive is not None:
            os.close(alive)


def _tried(function: Callable[[Any], Any], argument: Any) -> Outcome:
    try:
        return Outcome(function(argument))
    except FesdRobotError as error:
        return Outcome(None, Verdict.REFUSED, str(error))
    except MemoryError as error:
        return Outcome(None, Verdict.MEMORY, f"no memory was left {error}".rstrip())
    except Exception as error:
        return Outcome(None, Verdict.ERROR, f"{type(error).__name__}: {error}")


def _reset_peak() -> None:
    """Begin to measure the most memory of this process anew, where the system can."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def _memory(entry: str) -> float | None:
    """Return an entry of what Linux says about this process's memory, MB."""
    with contextlib.suppress(OSError):
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith(f"{entry}:"):
                return int(line.split()[1]) / 1e3
    return None
