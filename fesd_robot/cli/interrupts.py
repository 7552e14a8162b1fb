"""Ctrl-C: before a solve it ends the command, during one it asks for the best iterate, later it ends the drawing."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from enum import Enum, auto
from types import FrameType, TracebackType
from typing import Any

from fesd_robot.cli.exits import ExitCode


class RunStage(Enum):
    """Stage of a run, which decides what an interrupt ends."""

    ABORTABLE = auto()
    """Nothing that needs care: KeyboardInterrupt."""
    SOLVING = auto()
    """The solver, which can stop with its best iterate; the second interrupt ends the process."""
    WRITING = auto()
    """The files of a plan, which are finished first."""
    DRAWING = auto()
    """Pictures of a plan, which are left out: KeyboardInterrupt."""


class Interrupts:
    """Takes over SIGINT while a `with` block runs, and gives it back afterwards.

    Python runs signal handlers between bytecodes of the main thread only, so not while IPOPT works on an iteration. A
    thread therefore reads the bytes that `signal.set_wakeup_fd` sends, and both count the interrupts of a solve: the
    handler may see two as one, the thread may see one too late. CasADi swallows exceptions of signal handlers, so an
    interrupt is remembered and raised again where it may have been lost.

    Args:
        on_request: called at the first interrupt of a solve, from another thread.
        on_abort: called before the second one ends the process, from either thread.
    """

    def __init__(self, on_request: Callable[[], None], on_abort: Callable[[], None]) -> None:
        self._on_request, self._on_abort = on_request, on_abort
        self._stage = RunStage.ABORTABLE
        self._requested = self._aborted = self._late = False
        self._handled = 0
        self._aborting = threading.Lock()
        self._restore = contextlib.ExitStack()

    @property
    def stop(self) -> bool:
        """Whether the solver has to stop."""
        return self._requested or self._aborted

    @property
    def received(self) -> bool:
        """Whether there was any interrupt."""
        return self.stop or self._late

    def solving(self) -> bool:
        """Say that the solver is running; returns whether it was not before."""
        begins = self._stage is not RunStage.SOLVING
        self._stage = RunStage.SOLVING
        return begins

    def solved(self) -> None:
        """Say that there is a plan, which is kept; raises KeyboardInterrupt if one came before it could take a step."""
        self._stage = RunStage.WRITING
        self._raise_lost()

    @contextlib.contextmanager
    def drawing(self) -> Iterator[None]:
        """Say that pictures are drawn; an interrupt raises KeyboardInterrupt out of the block."""
        if self._late:
            raise KeyboardInterrupt
        self._stage = RunStage.DRAWING
        try:
            yield
        finally:
            self._stage = RunStage.WRITING

    def written(self) -> None:
        """Say that all files are in place."""
        self._stage = RunStage.ABORTABLE

    def __enter__(self) -> Interrupts:
        if (
            threading.current_thread() is not threading.main_thread()
            or signal.getsignal(signal.SIGINT) == signal.SIG_IGN
        ):
            return self
        reader, writer = socket.socketpair()
        writer.setblocking(False)
        watcher = threading.Thread(target=self._watch, args=(reader,), name="interrupts", daemon=True)
        watcher.start()
        handler = signal.signal(signal.SIGINT, self._handle)
        wakeup = signal.set_wakeup_fd(writer.fileno(), warn_on_full_buffer=False)
        # Undone from the last to the first.
        self._restore.callback(reader.close)
        self._restore.callback(watcher.join)
        self._restore.callback(writer.close)
        self._restore.callback(signal.set_wakeup_fd, wakeup)
        self._restore.callback(signal.signal, signal.SIGINT, handler)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._restore.close()
        if kind is None or not issubclass(kind, KeyboardInterrupt):
            self._raise_lost()

    def _raise_lost(self) -> None:
        if self._aborted:
            raise KeyboardInterrupt

    def _handle(self, number: int, frame: FrameType | None) -> Any:
        if self._stage is RunStage.SOLVING:
            self._requested = True
            self._handled += 1
            if self._handled > 1:
                self._abort()
        elif self._stage is RunStage.WRITING:
            self._late = True
        elif self._stage is RunStage.DRAWING:
            self._late, self._stage = True, RunStage.WRITING
            raise KeyboardInterrupt
        else:
            self._aborted = True
            raise KeyboardInterrupt

    def _watch(self, reader: socket.socket) -> None:
        presses = 0
        while numbers := reader.recv(64):
            for number in numbers:
                if number != signal.SIGINT or self._stage is not RunStage.SOLVING:
                    continue
                presses += 1
                if presses == 1:
                    self._requested = True
                    with contextlib.suppress(Exception):
                        self._on_request()
                else:
                    self._abort()

    def _abort(self) -> None:
        """End the process without waiting for the solver; nothing has been written yet."""
        # Both threads may get here; the second waits for the first to end the process, but not for ever.
        if self._aborting.acquire(timeout=1.0):
            with contextlib.suppress(Exception):
                self._on_abort()
        os._exit(ExitCode.INTERRUPTED)
