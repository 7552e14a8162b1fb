"""Locks of folders, which end with the process that holds them."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from fesd_robot.errors import FolderInUseError

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

logger = logging.getLogger(__name__)

LOCK_FILE = ".fesd-robot.lock"
"""The file that is locked where a folder cannot be."""

PATIENCE = 60.0
"""Longest wait for another process, s."""

_SAID_AFTER, _POLL = 1.0, 0.02
"""s after which a wait is said, and between two tries."""


@contextmanager
def locked(folder: Path, patience: float = PATIENCE) -> Iterator[None]:
    """Hold the lock of a folder; another process or thread that asks for it waits.

    The operating system ends the lock with the process, however that ends. The folder itself is locked, so that no file
    appears in it; where folders cannot be locked (Windows, NFS) `LOCK_FILE` in it is. Where there are no locks at all
    the folder is used without one, but not by those that have no patience.

    Args:
        folder: which exists.
        patience: how long to wait, s.

    Raises:
        FolderInUseError: another one has held it all the time.
        OSError: the folder cannot be opened.
    """
    handle = _handle(folder)
    if handle is None:
        with _locked_file(folder, patience):
            yield
        return
    try:
        _wait(handle, folder, patience)
        yield
    finally:
        fcntl.flock(handle, fcntl.LOCK_UN)  # a process that was forked meanwhile has the handle, too
        os.close(handle)


def _handle(folder: Path) -> int | None:
    """Return an open folder that can be locked, None if this system or its file system cannot do so."""
    if fcntl is None:
        return None
    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return handle
    except OSError as error:
        logger.debug("%s cannot be locked itself: %s", folder, error)
        os.close(handle)
        return None
    fcntl.flock(handle, fcntl.LOCK_UN)
    return handle


def _wait(handle: int, folder: Path, patience: float) -> None:
    """Lock an open folder once nobody else holds it."""
    began, said = time.monotonic(), False
    while True:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        except BlockingIOError as error:
            waited = time.monotonic() - began
            if waited >= patience:
                raise FolderInUseError(_in_use(folder, patience)) from error
        if waited > _SAID_AFTER and not said:
            logger.warning("%s: another run writes there, which is waited for", folder)
            said = True
        time.sleep(_POLL)


@contextmanager
def _locked_file(folder: Path, patience: float) -> Iterator[None]:
    """Hold the lock of `LOCK_FILE` in a folder, if there are locks."""
    lock = FileLock(folder / LOCK_FILE)
    try:
        lock.acquire(timeout=patience)
    except Timeout as error:
        raise FolderInUseError(_in_use(folder, patience)) from error
    except NotImplementedError as error:
        if not patience:
            raise FolderInUseError(_in_use(folder, patience)) from error
        logger.debug("%s is used without a lock: %s", folder, error)
    try:
        yield
    finally:
        lock.release()


def _in_use(folder: Path, patience: float) -> str:
    return f"{folder}: another run writes there, and has not ended within {patience:.0f} s; choose another --out"
