"""Files that nobody sees half of, and locks that end with their process."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fesd_robot import locks, writing
from fesd_robot.errors import FolderInUseError
from fesd_robot.locks import locked
from fesd_robot.writing import COMPLETE, UNFINISHED, remove_unfinished, staging_folder, write_atomically

FORK = multiprocessing.get_context("fork")


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def killed(work: Callable[[], Any]) -> None:
    """Do something in a process of its own that is killed where it waits."""
    process = FORK.Process(target=work)
    process.start()
    deadline = time.monotonic() + 30
    while process.is_alive() and time.monotonic() < deadline:
        time.sleep(0.01)
    assert process.exitcode == -signal.SIGKILL


def die() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_file_survives_a_failed_write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file is replaced whole or not at all."""
    path = tmp_path / "plan.html"
    path.write_text("old")

    def fail(source: str, target: Path) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(writing.os, "replace", fail)
    with pytest.raises(OSError, match="disk full"):
        write_atomically(path, b"new")
    assert path.read_text() == "old" and names(tmp_path) == {"plan.html"}


def test_a_new_file_has_the_permissions_of_new_files(tmp_path: Path) -> None:
    """It is as readable as one that is simply opened."""
    write_atomically(tmp_path / "a", b"")
    (tmp_path / "b").write_text("")
    assert (tmp_path / "a").stat().st_mode == (tmp_path / "b").stat().st_mode


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no FIFOs")
def test_a_pipe_is_written_to_and_stays(tmp_path: Path) -> None:
    """A file in its place would keep what its reader waits for; so would one in the place of /dev/null."""
    os.mkfifo(tmp_path / "pipe")
    reader = os.open(tmp_path / "pipe", os.O_RDONLY | os.O_NONBLOCK)
    write_atomically(tmp_path / "pipe", b"content")
    assert os.read(reader, 10) == b"content" and (tmp_path / "pipe").is_fifo()
    os.close(reader)
    assert write_atomically(Path(os.devnull), b"content").is_char_device()


def test_the_longest_names_can_be_written(tmp_path: Path) -> None:
    """A temporary name is no longer because its file's is long."""
    assert write_atomically(tmp_path / ("x" * 255), b"new").read_bytes() == b"new"


def test_what_a_killed_process_left_is_removed_by_the_next(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Temporary files and folders go, and files with similar names stay."""
    monkeypatch.setattr(writing.os, "replace", lambda source, target: die())
    killed(lambda: write_atomically(tmp_path / "a", b"half"))
    monkeypatch.undo()

    def staging() -> None:
        with staging_folder(tmp_path):
            die()

    killed(staging)
    assert sorted(path.is_dir() for path in tmp_path.iterdir() if UNFINISHED.fullmatch(path.name)) == [False, True]
    (tmp_path / ".fesd-robot-notes.part").write_text("mine")
    (tmp_path / ".fesd-robot-0123456789abcdef.part").symlink_to(tmp_path)
    write_atomically(tmp_path / "b", b"whole")
    assert names(tmp_path) == {"b", ".fesd-robot-notes.part", ".fesd-robot-0123456789abcdef.part"}


def test_what_a_running_process_writes_stays(tmp_path: Path) -> None:
    """Neither its folder nor its file is a leftover."""
    with staging_folder(tmp_path) as stage:
        handle, part = writing._new_file(tmp_path)
        remove_unfinished(tmp_path)
        assert stage.is_dir() and part.exists()
        os.close(handle)
        remove_unfinished(tmp_path)
        assert stage.is_dir() and not part.exists()


def test_a_complete_stage_is_not_removed(tmp_path: Path) -> None:
    """Its files belong into their places."""
    stage = tmp_path / ".fesd-robot-0123456789abcdef.part"
    stage.mkdir()
    (stage / COMPLETE).write_text("plan.json")
    remove_unfinished(tmp_path)
    assert stage.is_dir()


@pytest.mark.parametrize("file", [False, True], ids=["folder", "file"])
def test_a_lock_is_waited_for_and_ends_with_its_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, file: bool
) -> None:
    """Nobody else gets it while a process lives; a killed one leaves it, where folders cannot be locked, too."""
    if file:
        monkeypatch.setattr(locks, "_handle", lambda folder: None)
    ready, go_on = FORK.Event(), FORK.Event()

    def hold() -> None:
        with locked(tmp_path):
            ready.set()
            go_on.wait()
            die()

    process = FORK.Process(target=hold)
    process.start()
    assert ready.wait(30)
    with pytest.raises(FolderInUseError, match="another run writes there"), locked(tmp_path, 0.1):
        pass
    go_on.set()
    with locked(tmp_path, 30):
        pass
    process.join()


def test_a_lock_is_free_although_a_forked_process_lives_on(tmp_path: Path) -> None:
    """What was forked while it was held does not keep it."""
    with locked(tmp_path):
        process = FORK.Process(target=time.sleep, args=(30,))
        process.start()
    with locked(tmp_path, 0.0):
        process.kill()
    process.join()


def test_without_locks_nothing_is_taken_for_a_leftover(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On a file system that has none, files are written, and what may be another one's stays."""

    class NoLock:
        def __init__(self, path: Path) -> None: ...

        def acquire(self, timeout: float) -> None:
            raise NotImplementedError

        def release(self) -> None: ...

    monkeypatch.setattr(locks, "_handle", lambda folder: None)
    monkeypatch.setattr(locks, "FileLock", NoLock)
    with staging_folder(tmp_path) as stage:
        remove_unfinished(tmp_path)
        assert stage.is_dir()
    assert names(tmp_path) == set()
