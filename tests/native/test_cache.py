"""The folder of compiled libraries: what is damaged, not ours, or not to be written to, is not loaded."""

from __future__ import annotations

import ctypes
import logging
import os
import shutil
import stat
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from fesd_robot.native import cache, compiler
from fesd_robot.native.cache import CHOSEN_BY, DIGEST, cache_folder, is_whole
from fesd_robot.native.compiler import CompilationError, begin, shared_library
from fesd_robot.running import Deadline, OutOfTime, held_to

pytestmark = pytest.mark.skipif(not shutil.which("cc"), reason="no C compiler")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty cache that nothing is known of."""
    monkeypatch.setenv(CHOSEN_BY, str(tmp_path / "cache"))
    _forget()
    yield tmp_path / "cache"
    _forget()


def _forget() -> None:
    for known in (cache._usable, cache._is_whole, cache._warned):
        known.cache_clear()


def _made(tmp_path: Path) -> Path:
    source = tmp_path / "one.c"
    source.write_text("int one(void) { return 1; }\n")
    return shared_library("one", [source], ["-O0"])


def _value(library: Path, tmp_path: Path) -> int:
    """Return what the function of a library says; a copy of it is loaded, for one that is loaded already stays."""
    copy = shutil.copyfile(library, tmp_path / f"{time.monotonic_ns()}.so")
    return int(ctypes.CDLL(str(copy)).one())


def _flipped(file: Path) -> None:
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 0xFF
    file.write_bytes(content)


def _folder_instead(file: Path) -> None:
    file.unlink()
    file.mkdir()


def _of_another_kind(file: Path) -> None:
    file.write_bytes(b"\x7fELF\x01\x02" + bytes(200))


DAMAGES: dict[str, Callable[[Path], object]] = {
    "cut off": lambda file: os.truncate(file, 3000),
    "empty": lambda file: os.truncate(file, 0),
    "longer": lambda file: file.write_bytes(file.read_bytes() + b"more"),
    "one byte": _flipped,
    "text": lambda file: file.write_text("no library\n"),
    "of another machine": _of_another_kind,
    "writable by all": lambda file: file.chmod(0o777),
    "hash cut off": lambda file: os.truncate(file.with_name(file.name + DIGEST), 10),
    "hash not text": lambda file: file.with_name(file.name + DIGEST).write_bytes(b"\xff\xfe"),
    "hash of another": lambda file: file.with_name(file.name + DIGEST).write_text("0" * 64),
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_a_damaged_library_is_made_anew(
    folder: Path, tmp_path: Path, damage: Callable[[Path], object], caplog: pytest.LogCaptureFixture
) -> None:
    """It is noticed before it is loaded, one warning names it, and the next process finds a whole one."""
    library = _made(tmp_path)
    damage(library)
    with caplog.at_level(logging.WARNING):
        assert _value(_made(tmp_path), tmp_path) == 1
        _forget()
        assert is_whole(library)
        assert _value(_made(tmp_path), tmp_path) == 1
    assert [record.getMessage() for record in caplog.records] == [
        f"{library} is damaged, and made anew, as is what else is damaged in this cache"
    ]


def test_a_library_without_a_hash_is_made_anew_without_a_word(
    folder: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """That is one of an earlier version."""
    library = _made(tmp_path)
    library.with_name(library.name + DIGEST).unlink()
    with caplog.at_level(logging.WARNING):
        assert _value(_made(tmp_path), tmp_path) == 1
    assert not caplog.records and is_whole(library)


def test_what_stands_in_the_place_of_a_library_ends_in_a_sentence(folder: Path, tmp_path: Path) -> None:
    """A folder of its name is not removed, and nothing can be put there."""
    _folder_instead(_made(tmp_path))
    with pytest.raises(CompilationError, match=r"one could not be compiled"):
        _made(tmp_path)


def test_only_whole_files_are_in_the_cache(folder: Path, tmp_path: Path) -> None:
    """A library and its hash, for this user alone, and nothing that was needed to make them."""
    library = _made(tmp_path)
    assert sorted(file.name for file in folder.iterdir()) == [library.name, library.name + DIGEST]
    assert all(not stat.S_IMODE(file.stat().st_mode) & 0o077 for file in (folder, *folder.iterdir()))


def _no_folder(folder: Path) -> None:
    folder.parent.mkdir(exist_ok=True)
    folder.write_text("a file\n")


def _open_to_all(folder: Path) -> None:
    folder.mkdir(parents=True)
    folder.chmod(0o777)


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (_no_folder, "it cannot be written to (File exists)"),
        (_open_to_all, "other users may write to it (expected: chmod go-w"),
    ],
)
def test_a_folder_that_cannot_be_trusted_is_not_used(
    folder: Path,
    tmp_path: Path,
    spoil: Callable[[Path], None],
    reason: str,
    caplog: pytest.LogCaptureFixture,
) -> None:
    """One warning says why, and what is compiled lies in a folder of this process."""
    spoil(folder)
    with caplog.at_level(logging.WARNING):
        library = _made(tmp_path)
        assert _made(tmp_path) == library
    assert library.parent != folder and stat.S_IMODE(library.parent.stat().st_mode) == 0o700
    assert _value(library, tmp_path) == 1
    (record,) = caplog.records
    assert f"the cache folder {folder} is not used: {reason}" in record.getMessage()
    assert CHOSEN_BY in record.getMessage()


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root gives files away")
def test_a_folder_of_another_user_is_not_used(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Its owner could put other code there."""
    folder.mkdir()
    os.chown(folder, 12345, 12345)
    with caplog.at_level(logging.WARNING):
        assert _made(tmp_path).parent != folder
    assert "it belongs to another user (12345)" in caplog.text


def test_a_folder_mounted_without_code_is_not_used(
    folder: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """What lies there could not be loaded."""
    real = os.statvfs

    class NoCode:
        f_flag = os.ST_NOEXEC

    monkeypatch.setattr(os, "statvfs", lambda path: NoCode if str(path) == str(folder) else real(path))
    with caplog.at_level(logging.WARNING):
        assert cache_folder() != folder
    assert "(noexec)" in caplog.text


def test_the_user_s_own_folder_is_closed_to_others(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Where a umask lets a group write, the folder that nobody has chosen is made safe instead of left out."""
    monkeypatch.delenv(CHOSEN_BY)
    monkeypatch.setattr(cache, "user_cache_path", lambda _: folder)
    _open_to_all(folder)
    assert cache_folder() == folder and stat.S_IMODE(folder.stat().st_mode) == 0o755 and not caplog.records


def _slow_compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A compiler that leaves its work to a program of its own, as gcc does, for a minute; returns its list of these."""
    listed, script = tmp_path / "listed", tmp_path / "slow-cc"
    script.write_text(f"#!/bin/sh\n[ \"$1\" = --version ] && exit 0\nsh -c 'echo $$ >> {listed}; exec sleep 60'\n")
    script.chmod(0o700)
    monkeypatch.setenv("CC", str(script))
    return listed


def _gone(process: int) -> bool:
    """Whether it has ended, or ends within two seconds: the kernel ends a killed process when it next runs."""
    end_at = time.monotonic() + 2.0
    while time.monotonic() < end_at:
        try:
            if Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] in "ZX":
                return True
        except OSError:
            return True
        time.sleep(0.01)
    return False


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="looks for processes in /proc")
def test_a_compiler_is_waited_for_until_the_time_limit(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Then it ends, with the programs that it has called."""
    listed, begin_at = _slow_compiler(tmp_path, monkeypatch), time.monotonic()
    with held_to(Deadline(1.0)), pytest.raises(OutOfTime):
        _made(tmp_path)
    assert time.monotonic() - begin_at < 3.0
    processes = [int(line) for line in listed.read_text().split()]
    assert processes and all(map(_gone, processes))


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="looks for processes in /proc")
def test_compilers_end_with_the_program(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever they have called is ended, too, so that nobody waits for it."""
    listed, background = _slow_compiler(tmp_path, monkeypatch), compiler._Background()
    monkeypatch.setattr(compiler, "_BACKGROUND", background)
    begin(lambda: _made(tmp_path))
    while not listed.exists():
        time.sleep(0.05)
    begin_at = time.monotonic()
    background.end()
    assert time.monotonic() - begin_at < 3.0 and all(_gone(int(line)) for line in listed.read_text().split())
