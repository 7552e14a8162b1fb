"""The commit that is checked out where a task lies, read from git's files as text: no program runs for it."""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterator
from pathlib import Path

NONE = "none"

_COMMIT = re.compile(r"(?:[0-9a-f]{40}|[0-9a-f]{64})")
_REFERENCE = re.compile(r"ref: *(refs/[^\x00-\x20~^:?*\[\\]{1,1000})")
_FOLDER = re.compile(r"gitdir: *([^\x00-\x1f]{1,4096})")
_REMOTE = ("//", "\\\\")
"""Begins of paths of other computers, which Windows would log in to."""

_SHORT, _LONG = 2**13, 2**25
"""Bytes that are read of a file with one line, and of the packed references."""

_LINKS = 5
"""References that may refer to each other."""


def checked_out_commit(folder: Path) -> str:
    """Return the first 12 digits of the commit that is checked out in a folder, or in one above it; ``none`` without.

    Neither git nor anything that its configuration names runs, and whether files differ from the commit is not known.

    Args:
        folder: of a task.
    """
    try:
        folder = folder.resolve()
        for each in (folder, *folder.parents):
            if (each / ".git").exists():
                return next(_commits(each / ".git"), NONE)[:12]
    except (OSError, RuntimeError, ValueError):  # links that lead to each other, paths that are none
        pass
    return NONE


def _commits(place: Path) -> Iterator[str]:
    """Yield the commit of a folder ``.git``, or of a file of that name, which worktrees and submodules have."""
    if not place.is_dir():
        named = _FOLDER.fullmatch(_text(place, _SHORT).rstrip("\r\n"))
        if named is None or named[1].startswith(_REMOTE):
            return
        place = place.parent / named[1]
    common = _text(place / "commondir", _SHORT).strip()
    if common.startswith(_REMOTE):
        return
    places, text = (place, place / common), _text(place / "HEAD", _SHORT).strip()
    for _ in range(_LINKS):
        named = _REFERENCE.fullmatch(text)
        if named is None:
            break
        if ".." in named[1]:
            return
        text = next(filter(None, (_reference(each, named[1]) for each in places)), "")
    if _COMMIT.fullmatch(text):
        yield text


def _reference(place: Path, name: str) -> str:
    """Return what a reference refers to, empty if it is not there."""
    loose = _text(place / name, _SHORT).strip()
    if loose:
        return loose
    for line in _text(place / "packed-refs", _LONG).splitlines():
        commit, _, packed = line.partition(" ")
        if packed == name:
            return commit
    return ""


def _text(file: Path, length: int) -> str:
    """Return the text of a file that is one, empty if it is none or longer."""
    try:
        handle = os.open(file, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except OSError:
        return ""
    with os.fdopen(handle, "rb") as stream:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            return ""
        content = stream.read(length + 1)
    return content.decode(errors="replace") if len(content) <= length else ""
