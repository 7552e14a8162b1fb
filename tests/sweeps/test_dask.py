"""A sweep on a Dask cluster: the same rows as by processes, whatever dies meanwhile."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

import fesd_robot
from fesd_robot.errors import SweepError
from fesd_robot.sweeps import SweepSettings, SweepTable, load_sweep, read_sweep, swept
from tests.sweeps.cluster import REPOSITORY, Cluster, running
from tests.sweeps.stubs import alone_only, fragile, parabola, slow

pytest.importorskip("distributed")
SWEEP = {"task": "hopper_one_jump", "vary": {"goal.configuration.root_x": {"range": [0.9, 1.1], "count": 40}}}
SAME = ("number", "identity", "state", "verdict", "cost", "end.root_x", "message")


@pytest.fixture
def cluster(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Cluster]:
    """A cluster whose workers may take half a minute to come."""
    monkeypatch.setattr("fesd_robot.sweeps.dask_workers.SECONDS_TO_ANSWER", 60.0)
    (tmp_path / "cluster").mkdir()
    with running(tmp_path / "cluster") as made:
        yield made


def on(cluster: Cluster, **further: object) -> SweepSettings:
    return SweepSettings(scheduler=cluster.address, **further)  # type: ignore[arg-type]


def same(first: SweepTable, second: SweepTable) -> bool:
    return all(first.columns[name] == second.columns[name] for name in SAME)


def test_the_same_rows_as_processes(tmp_path: Path, cluster: Cluster) -> None:
    """Two workers over TCP give the rows, and the plans, that processes of this machine give."""
    local = swept(load_sweep(SWEEP), tmp_path / "local", SweepSettings(jobs=2), parabola)
    table = swept(load_sweep(SWEEP), tmp_path / "dask", on(cluster), parabola)
    assert same(local, table)
    assert table.columns["plan"] == local.columns["plan"]
    for plan in table.columns["plan"]:
        assert (tmp_path / "dask" / plan / "plan.json").read_bytes() == (
            tmp_path / "local" / plan / "plan.json"
        ).read_bytes()


def test_failures_are_rows(tmp_path: Path, cluster: Cluster) -> None:
    """What crashes, hangs or eats memory does so in a process beside the worker, which lives on."""
    sweep = load_sweep({**SWEEP, "vary": {"goal.configuration.root_x": {"range": [0.9, 1.1], "count": 8}}})
    table = swept(sweep, tmp_path / "out", on(cluster, timeout=3.0, memory=700.0, keep="none"), fragile)
    expected = ["solved", "crashed", "crashed", "timeout", "memory", "error", "refused", "solved"]
    assert table.columns["verdict"] == expected
    assert all(worker.poll() is None for worker in cluster.workers)


def test_a_row_that_fails_from_its_neighbour_is_planned_alone(tmp_path: Path, cluster: Cluster) -> None:
    """The second order of a row is done, too, and is no copy of the first one's failure."""
    vary = {"goal.configuration.root_x": {"range": [0.9, 1.1], "count": 8}}
    table = swept(load_sweep({**SWEEP, "warm": "nearest", "vary": vary}), tmp_path / "out", on(cluster), alone_only)
    assert table.columns["verdict"] == ["solved"] * 8
    assert sum(row is not None for row in table.columns["abandoned"]) >= 4


def test_a_worker_that_is_killed_loses_no_row(tmp_path: Path, cluster: Cluster) -> None:
    """The other worker does its rows."""

    def kill(tally: object) -> None:
        if tally.done > 5 and cluster.workers[0].poll() is None:
            cluster.workers[0].send_signal(signal.SIGKILL)
            cluster.workers[0].wait()

    table = swept(load_sweep(SWEEP), tmp_path / "out", on(cluster), slow, kill)
    assert cluster.workers[0].poll() is not None
    assert table.columns["number"] == list(range(40))
    assert table.columns["verdict"] == ["solved"] * 40


def test_a_scheduler_that_is_killed_ends_the_sweep_which_goes_on_later(tmp_path: Path, cluster: Cluster) -> None:
    """One sentence says so; with another scheduler --resume does the rest."""
    sweep = load_sweep({**SWEEP, "vary": {"goal.configuration.root_x": {"range": [0.9, 1.1], "count": 400}}})

    def kill(tally: object) -> None:
        if tally.done > 5 and cluster.scheduler.poll() is None:
            cluster.scheduler.send_signal(signal.SIGKILL)
            cluster.scheduler.wait()

    with pytest.raises(SweepError, match=r"the scheduler is gone.*--resume goes on where this stopped"):
        swept(sweep, tmp_path / "out", on(cluster), slow, kill)
    before = read_sweep(tmp_path / "out")
    done = before.columns["state"].count("completed")
    assert 5 < done < 400
    cluster.end()
    (tmp_path / "second").mkdir()
    with running(tmp_path / "second") as second:
        table = swept(sweep, tmp_path / "out", on(second, resume=True), parabola)
    assert table.columns["number"] == list(range(400))
    assert table.columns["state"] == ["completed"] * 400


def test_a_driver_that_is_killed_leaves_the_cluster_to_the_next(tmp_path: Path, cluster: Cluster) -> None:
    """The sweep goes on with the same scheduler."""
    program = tmp_path / "program.py"
    program.write_text(
        f"""
import sys
from pathlib import Path
from fesd_robot.sweeps import SweepSettings, load_sweep, swept
from tests.sweeps.stubs import slow
if __name__ == "__main__":
    swept(load_sweep({SWEEP!r}), Path(sys.argv[1]), SweepSettings(scheduler={cluster.address!r}), slow)
"""
    )
    path = os.pathsep.join([str(REPOSITORY), os.environ.get("PYTHONPATH", "")])
    out, environment = tmp_path / "out", {**os.environ, "PYTHONPATH": path}
    driver = subprocess.Popen([sys.executable, str(program), str(out)], env=environment)
    while not (out / "rows.csv").is_file() or (out / "rows.csv").read_bytes().count(b"\n") < 6:
        assert driver.poll() is None
        time.sleep(0.02)
    driver.kill()
    driver.wait()
    assert 5 <= len(read_sweep(out)) <= 40
    table = swept(load_sweep(SWEEP), out, on(cluster, resume=True), slow)
    assert table.columns["number"] == list(range(40))


def test_workers_of_another_version_are_refused(
    tmp_path: Path, cluster: Cluster, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The sentence names a worker and both versions."""
    known = re.escape(fesd_robot.__version__)
    monkeypatch.setattr("fesd_robot.__version__", "9.9")
    with pytest.raises(
        SweepError, match=rf"found version {known} of fesd-robot on tcp://.*expected 9\.9, that of this"
    ):
        swept(load_sweep(SWEEP), tmp_path / "out", on(cluster), parabola)
