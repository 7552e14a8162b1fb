"""A Dask cluster over TCP whose scheduler and workers are programs of their own, to be killed."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]


class Cluster:
    """A scheduler and two workers over TCP, each a program of its own.

    Args:
        folder: in which they run, and which has none of the files of who orders plans.
    """

    def __init__(self, folder: Path) -> None:
        self.folder, self.port = folder, _free_port()
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.scheduler = self.begin_scheduler()
        self.workers = [self.begin_worker(), self.begin_worker()]

    def begin_scheduler(self) -> subprocess.Popen[bytes]:
        """Return a new scheduler at the address."""
        return self._program("dask_scheduler", "--host", "127.0.0.1", "--port", str(self.port), "--no-dashboard")

    def begin_worker(self) -> subprocess.Popen[bytes]:
        """Return a new worker with one thread."""
        words = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory", str(self.folder))
        return self._program("dask_worker", self.address, *words)

    def _program(self, name: str, *words: str) -> subprocess.Popen[bytes]:
        path = os.pathsep.join([str(REPOSITORY), os.environ.get("PYTHONPATH", "")])
        return subprocess.Popen(
            [sys.executable, "-m", f"distributed.cli.{name}", *words],
            cwd=self.folder,  # none of the paths of the sender are there
            env={**os.environ, "PYTHONPATH": path},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    def end(self) -> None:
        """Kill all."""
        for process in [*self.workers, self.scheduler]:
            process.kill()
            process.wait()


def _free_port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


@contextmanager
def running(folder: Path) -> Iterator[Cluster]:
    """Run a cluster in a folder for a while."""
    cluster = Cluster(folder)
    try:
        yield cluster
    finally:
        cluster.end()
