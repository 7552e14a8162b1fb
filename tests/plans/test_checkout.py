"""The commit where a task lies, read as text."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from fesd_robot.plans.checkout import NONE, checked_out_commit

COMMIT = "0123456789abcdef0123456789abcdef01234567"


def git(folder: Path, *words: str) -> str:
    settings = ["-c", "user.name=a", "-c", "user.email=a@b", "-c", "core.hooksPath=/dev/null"]
    return subprocess.run(["git", *settings, *words], cwd=folder, check=True, capture_output=True, text=True).stdout


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """A repository with one commit."""
    if not shutil.which("git"):
        pytest.skip("git is not installed")
    folder = tmp_path / "repository"
    (folder / "tasks").mkdir(parents=True)
    (folder / "tasks" / "task.yaml").write_text("name: a")
    git(folder, "init", "-q")
    git(folder, "add", ".")
    git(folder, "commit", "-qm", "a")
    return folder


def head(folder: Path) -> str:
    return git(folder, "rev-parse", "HEAD")[:12]


def test_the_commit_is_that_of_git(repository: Path) -> None:
    """On a branch, packed, detached, in a worktree, in a folder below."""
    assert checked_out_commit(repository / "tasks") == head(repository)
    git(repository, "pack-refs", "--all")
    assert checked_out_commit(repository) == head(repository)
    git(repository, "worktree", "add", "-q", "-b", "feature/one", "../worktree")
    worktree = repository.parent / "worktree"
    git(worktree, "commit", "-q", "--allow-empty", "-m", "b")
    assert checked_out_commit(worktree / "tasks") == head(worktree) != head(repository)
    git(repository, "checkout", "-q", "--detach")
    assert checked_out_commit(repository) == head(repository)


def test_no_program_of_the_folder_runs(repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever its configuration names; no program at all runs."""
    hacked = tmp_path / "HACKED"
    command = f"echo ran >> '{hacked}'; false"
    git(repository, "config", "core.fsmonitor", command)
    git(repository, "config", "filter.evil.clean", command)
    (repository / ".gitattributes").write_text("* filter=evil\n")
    commit = git(repository, "rev-parse", "HEAD")[:12]
    hacked.unlink(missing_ok=True)

    def started(*_: object, **__: object) -> None:
        raise AssertionError("a program was started")

    monkeypatch.setattr(subprocess, "Popen", started)
    monkeypatch.setattr(os, "system", started)
    assert checked_out_commit(repository) == commit and not hacked.exists()


BROKEN = {
    "empty": "",
    "not a reference": "master",
    "a reference outside": "ref: refs/../../secret",
    "an absolute reference": "ref: /etc/passwd",
    "a reference to itself": "ref: HEAD",
    "a reference that is not there": "ref: refs/heads/none",
    "too short": COMMIT[:30],
    "huge": COMMIT * 1000,
    "binary": "\x00\x01\x02",
}


@pytest.mark.parametrize("text", BROKEN.values(), ids=BROKEN)
def test_a_broken_head_is_none(tmp_path: Path, text: str) -> None:
    """No commit, no exception, and nothing from outside is read."""
    (tmp_path / "secret").write_text(COMMIT)
    (tmp_path / "a" / ".git" / "refs" / "heads").mkdir(parents=True)
    (tmp_path / "a" / ".git" / "HEAD").write_text(text)
    assert checked_out_commit(tmp_path / "a") == NONE


def test_references_in_a_circle_are_none(tmp_path: Path) -> None:
    """Two that refer to each other end."""
    heads = tmp_path / ".git" / "refs" / "heads"
    heads.mkdir(parents=True)
    (tmp_path / ".git" / "HEAD").write_text("ref: refs/heads/a\n")
    (heads / "a").write_text("ref: refs/heads/b\n")
    (heads / "b").write_text("ref: refs/heads/a\n")
    assert checked_out_commit(tmp_path) == NONE
    (heads / "b").write_text(COMMIT + "\n")
    assert checked_out_commit(tmp_path) == COMMIT[:12]


@pytest.mark.parametrize("text", ["", "gitdir:", "gitdir: .", "gitdir: nowhere", "gitdir: //host/share", "\x00"])
def test_a_broken_file_is_none(tmp_path: Path, text: str) -> None:
    """A file `.git` that names no repository."""
    (tmp_path / ".git").write_text(text)
    assert checked_out_commit(tmp_path) == NONE


@pytest.mark.skipif(sys.platform == "win32", reason="no FIFOs")
def test_pipes_and_devices_are_none(tmp_path: Path) -> None:
    """They would be waited for, or have no end."""
    (tmp_path / ".git").mkdir()
    os.mkfifo(tmp_path / ".git" / "HEAD")
    assert checked_out_commit(tmp_path) == NONE
    (tmp_path / ".git" / "HEAD").unlink()
    (tmp_path / ".git" / "HEAD").symlink_to("/dev/zero")
    assert checked_out_commit(tmp_path) == NONE
