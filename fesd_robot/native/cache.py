"""The folder of compiled libraries: only what this user wrote there, and as it was written, is loaded."""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import logging
import os
import shutil
import stat
import tempfile
import threading
from functools import cache, partial
from pathlib import Path

from platformdirs import user_cache_path

logger = logging.getLogger(__name__)

CHOSEN_BY = "FESD_ROBOT_CACHE"
"""Environment variable that names another folder than the user's own."""

DIGEST = ".sha256"
"""Suffix of the file beside a library that holds its hash."""

OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
"""Permissions with which other users could put their code in the place of ours."""


_ONE_AT_A_TIME = threading.RLock()
"""Held by the thread that looks at the folder or a library, so that others find what it has found."""


def cache_folder() -> Path:
    """Return the folder that compiled libraries are kept in, FESD_ROBOT_CACHE or the user's cache folder.

    A folder that cannot be written to, or that others may write to, is not used: one warning says so, and what is
    compiled is kept in a temporary folder as long as this process lives.
    """
    with _ONE_AT_A_TIME:
        return _usable(os.environ.get(CHOSEN_BY, ""))


@cache
def _usable(chosen: str) -> Path:
    folder = Path(chosen).absolute() if chosen else user_cache_path("fesd_robot")
    reason = _unusable(folder, own=not chosen)
    if not reason:
        return folder
    logger.warning(
        "the cache folder %s is not used: %s; what is compiled is not kept (%s names another folder)",
        folder,
        reason,
        CHOSEN_BY,
    )
    private = Path(tempfile.mkdtemp(prefix="fesd-robot-"))
    atexit.register(partial(_removed, private, os.getpid()))
    return private


def _removed(folder: Path, process: int) -> None:
    if os.getpid() == process:
        shutil.rmtree(folder, ignore_errors=True)


def _unusable(folder: Path, own: bool) -> str:
    """Return why a folder cannot be used, made if it is missing; nothing if it can.

    Args:
        folder: of the cache.
        own: whether it is this program's, so that it may be closed to others.
    """
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        status = folder.stat()
        if own and _is_ours(status) and status.st_mode & OTHERS_WRITE:
            folder.chmod(stat.S_IMODE(status.st_mode) & ~OTHERS_WRITE)
            status = folder.stat()
        with tempfile.TemporaryFile(dir=folder):
            pass
        without_code = hasattr(os, "statvfs") and bool(os.statvfs(folder).f_flag & getattr(os, "ST_NOEXEC", 0))
    except OSError as error:
        return f"it cannot be written to ({error.strerror or error})"
    if not _is_ours(status):
        return f"it belongs to another user ({status.st_uid})"
    if os.name == "posix" and status.st_mode & OTHERS_WRITE:
        return f"other users may write to it (expected: chmod go-w {folder})"
    return "no code may be loaded from where it is mounted (noexec)" if without_code else ""


def _is_ours(status: os.stat_result) -> bool:
    """Return whether a file belongs to this user, or to root."""
    return os.name != "posix" or status.st_uid in (0, os.geteuid())


def is_whole(library: Path) -> bool:
    """Return whether a library is in the cache as it was written there; one that is not is removed.

    Its hash is compared with that beside it, once in a process. The first damaged library is named by a warning.
    """
    try:
        status = library.stat()
    except OSError:
        return False
    with _ONE_AT_A_TIME:
        return _is_whole(library, status.st_ino, status.st_mtime_ns, status.st_size)


@cache
def _is_whole(library: Path, inode: int, changed: int, size: int) -> bool:
    beside = _beside(library)
    try:
        known = beside.exists()
        writable = os.name == "posix" and any(one.stat().st_mode & OTHERS_WRITE for one in (library, beside) if known)
        safe = _is_ours(library.stat()) and not writable
        if known and safe and beside.read_text(encoding="ascii").strip() == digest_of(library):
            return True
    except (OSError, UnicodeDecodeError):
        known = True
    if known:  # one without a hash is of an earlier version
        _warn_of_damage(library.parent, library.name)
    with contextlib.suppress(OSError):
        library.unlink()
    return False


@cache
def _warned(folder: Path) -> list[str]:
    """Return the names of damaged files of a folder that a warning has named."""
    return []


def _warn_of_damage(folder: Path, name: str) -> None:
    if not _warned(folder):
        logger.warning("%s is damaged, and made anew, as is what else is damaged in this cache", folder / name)
    _warned(folder).append(name)


def digest_of(file: Path) -> str:
    """Return the hash of a file."""
    return hashlib.sha256(file.read_bytes()).hexdigest()


def _beside(library: Path) -> Path:
    return library.with_name(f"{library.name}{DIGEST}")


def put(made: Path, library: Path) -> None:
    """Move a file that was made in the folder of the cache, or below it, to its place there, its hash first.

    Both are on the disk before they are at their places, so that a machine that stops leaves none by halves.

    Raises:
        OSError: the folder or the disk does not allow it.
    """
    hashed = _beside(made)
    hashed.write_text(digest_of(made), encoding="ascii")
    for file, target in ((hashed, _beside(library)), (made, library)):
        file.chmod(0o700 if file is made else 0o600)
        with file.open("rb+") as stream:
            os.fsync(stream.fileno())
        os.replace(file, target)
