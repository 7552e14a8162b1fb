"""Files that nobody sees half of: temporary names in the same folder, and one move to their own."""

from __future__ import annotations

import os
import re
import secrets
import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from fesd_robot.errors import FolderInUseError
from fesd_robot.locks import fcntl, locked

UNFINISHED = re.compile(r"\.fesd-robot-[0-9a-f]{16}\.part")
"""Names of files and folders that are being written; one that no process holds was left by one that was killed."""

COMPLETE = ".files"
"""A file in a folder that is being written: it is complete, and its files are on the way to their places."""

_TRIES = 10


def write_atomically(path: Path, content: bytes) -> Path:
    """Write `content` into a temporary file beside `path`, then rename it onto `path`.

    The content is on the disk before the name is. What killed processes left unfinished in the folder is removed.

    Args:
        path: the file to create or replace; its folder is created if it is missing. A pipe or device is written to.
        content: all bytes of the file.

    Returns:
        `path`.
    """
    if path.exists() and not (path.is_file() or path.is_dir()):
        path.write_bytes(content)
        return path
    path.parent.mkdir(parents=True, exist_ok=True)
    remove_unfinished(path.parent)
    handle, part = _new_file(path.parent)
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
            if fcntl is not None:  # while it is held, so that nobody takes it for a leftover
                os.replace(part, path)
        if fcntl is None:  # Windows moves no file that is open
            os.replace(part, path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise
    sync_folder(path.parent)
    return path


@contextmanager
def staging_folder(folder: Path) -> Iterator[Path]:
    """Yield a new folder within `folder`, on the same disk, for files that take their places later.

    It is removed at the end, and so is `folder` if it was made for it and stays empty.

    Args:
        folder: created if it is missing.
    """
    with _made(folder), ExitStack() as held:
        stage = _held_stage(folder, held)
        try:
            yield stage
        finally:
            shutil.rmtree(stage, ignore_errors=True)
            held.close()
            with suppress(OSError):  # where the lock is a file in it, which was open
                stage.rmdir()


def remove_unfinished(folder: Path) -> None:
    """Remove what killed processes left unfinished in a folder; what is held by a process, or `COMPLETE`, stays."""
    with suppress(OSError):
        for entry in list(os.scandir(folder)):
            if UNFINISHED.fullmatch(entry.name) and not entry.is_symlink():
                with suppress(OSError, FolderInUseError):
                    (_remove_folder if entry.is_dir() else _remove_file)(Path(entry.path))


def sync_folder(folder: Path) -> None:
    """Bring the names in a folder to the disk, where the system lets a folder be opened."""
    if fcntl is None:
        return
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _new_name() -> str:
    return f".fesd-robot-{secrets.token_hex(8)}.part"


def _new_file(folder: Path) -> tuple[int, Path]:
    """Return a new file that is open and, where files can be locked, held."""
    for _ in range(_TRIES):
        part = folder / _new_name()
        handle = os.open(part, os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
        if fcntl is None:
            return handle, part
        with suppress(OSError):  # a file system without locks
            fcntl.flock(handle, fcntl.LOCK_EX)
        if part.exists():
            return handle, part
        os.close(handle)  # taken for a leftover before it was held
    raise FileNotFoundError(f"{folder}: files vanish")


def _held_stage(folder: Path, held: ExitStack) -> Path:
    """Return a new folder within a folder, held until `held` is closed."""
    for _ in range(_TRIES):
        stage = folder / _new_name()
        stage.mkdir(parents=True)
        try:
            held.enter_context(locked(stage))
        except FileNotFoundError:  # taken for a leftover before it was held
            continue
        if stage.is_dir():
            return stage
        held.close()
    raise FileNotFoundError(f"{folder}: folders vanish")


@contextmanager
def _made(folder: Path) -> Iterator[None]:
    """Make a folder with those above it, and remove at the end which of them are new and empty."""
    missing = [each for each in (folder, *folder.parents) if not each.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield
    finally:
        with suppress(OSError):
            for each in missing:
                each.rmdir()


def _remove_folder(stage: Path) -> None:
    """Remove a folder that no process holds."""
    with locked(stage, 0.0):
        if (stage / COMPLETE).exists():
            return
        shutil.rmtree(stage, ignore_errors=True)
    with suppress(FileNotFoundError):
        stage.rmdir()


def _remove_file(part: Path) -> None:
    """Remove a temporary file that no process holds."""
    if fcntl is None:
        return
    handle = os.open(part, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        part.unlink()
    finally:
        os.close(handle)
