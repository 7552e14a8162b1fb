"""A sweep from its file to its table."""

from __future__ import annotations

import hashlib
import json
import logging
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import psutil

import fesd_robot
from fesd_robot.arguments import checked
from fesd_robot.errors import FesdRobotError, FolderInUseError, SweepError, TaskError
from fesd_robot.locks import locked
from fesd_robot.sweeps.content import TaskContent, content_of
from fesd_robot.sweeps.continuation import FromNearest, InTurn, Schedule
from fesd_robot.sweeps.executors import DaskCluster, Executor, LocalProcesses, usable_cores
from fesd_robot.sweeps.folder import SweepFolder, SweepRecord
from fesd_robot.sweeps.order import Answer, Limits, Order, Start, State, Verdict, Work
from fesd_robot.sweeps.page import write_sweep_page
from fesd_robot.sweeps.planned import planned
from fesd_robot.sweeps.rows import Rows, as_overrides
from fesd_robot.sweeps.scales import with_scales
from fesd_robot.sweeps.schema import CASE, TASK, Sweep, load_sweep
from fesd_robot.sweeps.settings import MOST_ROWS, SweepSettings
from fesd_robot.sweeps.table import Columns, SweepTable, type_of
from fesd_robot.sweeps.tally import Tally
from fesd_robot.task import Task, load_task

logger = logging.getLogger(__name__)

_WAIT = 0.5
"""s for which answers are waited for before progress is told."""

_LEAST_PAUSE, _PAUSE_RATIO = 5.0, 20.0
"""s between two files of the whole table, and a multiple of what writing it takes."""

_MEMORY_SHARE = 0.9
"""Of this machine's memory, for all processes together."""

FILE_KEYS = ("robot.model", "reference.path", "ground.file", "solver.warm_start")
"""Keys whose values are files that go to workers; models of bodies, too."""


@checked
def sweep(
    sweep: Path | str | Mapping[str, Any],
    out: Path | str,
    settings: SweepSettings | None = None,
    *,
    on_progress: Callable[[Tally], None] | None = None,
) -> SweepTable:
    """Plan a family of tasks, a row of a table each.

    Args:
        sweep: the sweep file, the name of one that comes with the program, or its keys and values.
        out: folder for table, page and plans; new, empty, or that of this sweep if it goes on.
        settings: how it is run.
        on_progress: called with how far it is, twice a second at least.

    Returns:
        the table, also in the folder as ``rows.csv``, and ``rows.parquet`` with pyarrow.

    Raises:
        TaskError: the sweep, or its task with the values of the first row, is not valid; names file, line and key.
        SweepError: the folder holds something else, the scheduler does not answer, or workers have another version.
        KeyboardInterrupt: after the rows that ran are noted as interrupted.
    """
    return swept(load_sweep(sweep), Path(out), settings or SweepSettings(), planned, on_progress)


def swept(
    loaded: Sweep,
    out: Path,
    settings: SweepSettings,
    work: Work,
    on_progress: Callable[[Tally], None] | None = None,
    measures: Mapping[str, type] | None = None,
) -> SweepTable:
    """Do work for every row of a sweep, as `sweep` does.

    Args:
        loaded, out, settings, on_progress: as there.
        work: makes the plan of a row, or what stands for it; a function of a module.
        measures: further columns that it answers with -> type.
    """
    rows = Rows(loaded)
    _check(loaded, rows, settings)
    content, ends = checked_tasks(loaded)
    columns = Columns({key: type_of(rows.values(key)) for key in rows.keys}, ends, measures or {})
    told = loaded.model_dump(mode="json", exclude_unset=True, exclude={"name"})
    identity = _hash(content.identity, told, fesd_robot.__version__)
    record = SweepRecord(loaded.name or "sweep", identity, fesd_robot.__version__, len(rows), columns, told)
    folder = SweepFolder(out, record)
    folder.begun(settings.resume or settings.retry_failed)
    with ExitStack() as held:
        try:
            held.enter_context(locked(out, patience=0.0))
        except FolderInUseError:
            raise SweepError(f"{out}: another program runs this sweep, expected one at a time") from None
        driver = _Driver(loaded, rows, folder, settings, content)
        executor = _executor(settings, work, content)
        held.callback(executor.end)
        driver.run(executor, on_progress or (lambda _: None))
    return SweepTable(folder.journal)


def _check(loaded: Sweep, rows: Rows, settings: SweepSettings) -> None:
    if len(rows) > MOST_ROWS and not settings.yes:
        raise loaded.error(("vary",), f"found {len(rows)} rows, expected at most {MOST_ROWS}; --yes plans them all")
    if loaded.warm == "nearest" and settings.keep not in ("all", "solved"):
        raise loaded.error(
            ("warm",), f"found keep '{settings.keep}', expected 'all' or 'solved': rows begin from plans that are kept"
        )
    if loaded.warm == "nearest" and len(rows.first_rows) > 1:
        raise loaded.error(
            ("warm",), f"found {len(rows.first_rows)} tasks, expected one: plans of others are nothing to begin from"
        )


def checked_tasks(loaded: Sweep) -> tuple[TaskContent, tuple[str, ...]]:
    """Return the tasks with their files, and the columns of their ends, after checking some rows.

    Rows that are checked: the first one of every task, and the last one.

    Raises:
        TaskError: a task is not valid with their values.
    """
    from fesd_robot.ocp import load_task_robot

    rows, ends = Rows(loaded), dict[str, None]()
    for number in dict.fromkeys((*rows.first_rows.values(), len(rows) - 1)):
        try:
            _, robot = load_task_robot(_task_of(loaded, rows.task(number), rows.values_of_task(number)))
        except FesdRobotError as error:
            raise _told_of_sweep(loaded, rows, number, error) from error
        ends |= dict.fromkeys(f"end.{name}" for name in robot.configuration_names)
    return content_of({name: _with_files(loaded, rows, name) for name in rows.first_rows}), tuple(ends)


def _task_of(loaded: Sweep, name: str, values: Mapping[str, Any]) -> Task:
    """Return a task with what is set, and with further values."""
    file = loaded.file_of(name)
    return load_task(file, with_scales(file, as_overrides({**loaded.set, **values})))


def _with_files(loaded: Sweep, rows: Rows, name: str) -> list[Task]:
    """Return a task as it is, as it is set, and with every file that varies in it."""
    tasks = [load_task(loaded.file_of(name)), _task_of(loaded, name, {})]
    varied = [(key, value) for key in rows.keys if _is_file(key) for value in rows.values(key)]
    for case in loaded.cases.values():
        if case.get(TASK, name) == name:
            varied += [(key, value) for key, value in case.items() if _is_file(key)]
    return tasks + [_task_of(loaded, name, {key: value}) for key, value in varied]


def _is_file(key: str) -> bool:
    return key in FILE_KEYS or key.endswith(".model")


def _told_of_sweep(loaded: Sweep, rows: Rows, number: int, error: FesdRobotError) -> FesdRobotError:
    """Return an error about a task as one about the sweep, where a key of the sweep has led to it."""
    key, inputs = getattr(error, "key", None) or "", rows.inputs(number)
    case = inputs.get(CASE, "")
    written = [("vary", own) for own in inputs] + [("set", own) for own in loaded.set]
    for place in (*[("cases", case, own) for own in loaded.cases.get(case, {})], *written):
        own = place[-1]
        if key == own or key.startswith(f"{own}.") or f"--set {own}=" in str(error):
            message = error.message if isinstance(error, TaskError) else str(error)
            return loaded.error(place, message.partition(" (from --set")[0])
    return error


def _hash(*parts: Any) -> str:
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def _executor(settings: SweepSettings, work: Work, content: TaskContent) -> Executor:
    jobs = settings.jobs or usable_cores()
    if settings.scheduler is None:
        return LocalProcesses(work, content, jobs)
    return DaskCluster(work, content, None if settings.scheduler == "local" else settings.scheduler, jobs)


class _Driver:
    """Orders rows and writes down what comes back.

    Args:
        loaded, rows: the sweep.
        folder: where it goes.
        settings: how it is run.
        content: the tasks.
    """

    def __init__(
        self, loaded: Sweep, rows: Rows, folder: SweepFolder, settings: SweepSettings, content: TaskContent
    ) -> None:
        self._sweep, self._rows, self._folder, self._settings = loaded, rows, folder, settings
        self._homes = {name: str(loaded.file_of(name).parent.absolute()) for name in rows.first_rows}
        self._files = content.overrides
        self._best: tuple[float, int] | None = None
        self._next_file, self._limits = time.monotonic() + _LEAST_PAUSE, self._limits_of(settings)
        self._done, self._tally = bytearray(len(rows)), Tally(len(rows))
        self._starts: dict[int, int] = {}
        self._abandoned: dict[int, tuple[int, float]] = {}

    def run(self, executor: Executor, on_progress: Callable[[Tally], None]) -> None:
        """Do all rows that are not there yet."""
        schedule, journal = self._schedule(), self._folder.journal
        try:
            more = True
            while more or executor.running:
                while more and self._room(executor) > 0:
                    following = schedule.next()
                    if following is None:
                        more = False
                    else:
                        self._submit(executor, *following)
                self._tally.running = len(executor.running)
                for answer in executor.answers(_WAIT) if executor.running else []:
                    if self._again_alone(answer, executor):
                        continue
                    self._note(answer)
                    if answer.verdict is Verdict.SOLVED:
                        schedule.solved(answer.number)
                on_progress(self._tally)
                if time.monotonic() > self._next_file:
                    self._write_files()
        except BaseException:
            with suppress(OSError, SweepError):  # what has ended it is told
                for number in executor.running:
                    self._append(Answer(number, Verdict.INTERRUPTED, message="the sweep was ended"))
            raise
        finally:
            if self._settings.keep == "best":
                journal.rewritten(self._without_plan)
            journal.close()
            self._write_files()

    def _room(self, executor: Executor) -> int:
        """Return how many rows may be ordered; none lies ready where a plan that is solved meanwhile is its start."""
        warm = self._sweep.warm == "nearest"
        return executor.workers - len(executor.running) if warm else executor.room

    def _schedule(self) -> Schedule:
        """Return the order of the rows that are not there; rows to be done again go from the table."""
        solved = []

        def kept(row: dict[str, Any]) -> dict[str, Any] | None:
            again = row["state"] == State.INTERRUPTED or (self._settings.retry_failed and row["state"] == State.FAILED)
            if again or not 0 <= row["number"] < len(self._rows) or self._done[row["number"]]:
                return None
            self._done[row["number"]] = 1
            self._tally.known += 1
            if row["verdict"] == Verdict.SOLVED:
                self._tally.known_solved += 1
                self._better(row["number"], row["cost"])
                solved.append(row["number"])
            return row

        self._folder.journal.rewritten(kept)
        if self._sweep.warm == "nearest":
            return FromNearest(self._rows.places, self._done, solved)
        return InTurn(len(self._rows), self._done)

    def _submit(self, executor: Executor, number: int, start: int | None) -> None:
        """Order a row, and remember which one it begins from."""
        order = self._order(number, start)
        if order.start is not None:
            self._starts[number] = order.start.number
        executor.submit(order)

    def _again_alone(self, answer: Answer, executor: Executor) -> bool:
        """Order a row from its task alone where the process that began from another one has failed."""
        start = self._starts.pop(answer.number, None)
        if start is None or answer.verdict.state is not State.FAILED or answer.verdict is Verdict.REFUSED:
            return False
        self._abandoned[answer.number] = (start, answer.seconds)
        self._submit(executor, answer.number, None)
        return True

    def _order(self, number: int, start: int | None) -> Order:
        plan = None if start is None else self._folder.plan_of(start)
        keep, task = self._settings.keep, self._rows.task(number)
        values = {**self._sweep.set, **self._rows.values_of_task(number)}
        return Order(
            number,
            (*self._files[task], *as_overrides(values)),
            self._limits,
            "solved" if keep == "best" else keep,
            self._best[0] if keep == "best" and self._best else None,
            None if plan is None or start is None else Start(start, plan, str(self._folder.place(start).absolute())),
            task,
            self._rows.inputs(number).get(CASE, ""),
            self._homes[task],
        )

    def _note(self, answer: Answer) -> None:
        """Write down what became of a row."""
        if answer.verdict is Verdict.INTERRUPTED:
            raise SweepError(f"the scheduler is gone ({answer.message}); --resume goes on where this stopped")
        before = self._best
        cost = answer.values.get("cost")
        kept = bool(answer.files)
        if answer.verdict is Verdict.SOLVED and cost is not None:
            better = self._better(answer.number, cost)
            kept = kept and (better or self._settings.keep != "best")
        place = self._folder.keep(answer.number, answer.files) if kept else ""
        self._append(answer, place)
        self._tally.add(answer.verdict)
        if self._settings.keep == "best" and before and before != self._best:
            self._folder.drop(before[1])

    def _append(self, answer: Answer, place: str = "") -> None:
        inputs = self._rows.inputs(answer.number)
        begun, spent = self._abandoned.pop(answer.number, (None, 0.0))
        row = {
            "number": answer.number,
            **inputs,
            "identity": _hash(self._folder.record.identity, as_overrides(inputs))[:16],
            "state": answer.verdict.state.value,
            "verdict": answer.verdict.value,
            "abandoned": begun,
            **answer.values,
            "seconds": round(answer.seconds + spent, 3),
            "memory": None if answer.megabytes is None else round(answer.megabytes, 1),
            "message": answer.message,
            "plan": place,
        }
        self._folder.journal.append(row)

    def _better(self, number: int, cost: float) -> bool:
        if self._best is None or cost < self._best[0]:
            self._best = (cost, number)
            return True
        return False

    def _without_plan(self, row: dict[str, Any]) -> dict[str, Any]:
        return row if self._folder.place(row["number"]).is_dir() else {**row, "plan": ""}

    def _write_files(self) -> None:
        """Write the table as Parquet and the page; the more rarely, the longer it takes."""
        begin = time.monotonic()
        try:
            self._folder.journal.to_parquet()
            write_sweep_page(self._folder, self._settings.against)
        except OSError as error:
            logger.warning("%s: table or page cannot be written (%s)", self._folder.folder, error.strerror)
        taken = time.monotonic() - begin
        self._next_file = time.monotonic() + max(_LEAST_PAUSE, _PAUSE_RATIO * taken)

    def _limits_of(self, settings: SweepSettings) -> Limits:
        memory = settings.memory
        if memory is None and settings.scheduler is None:
            memory = _MEMORY_SHARE * psutil.virtual_memory().total / 1e6 / (settings.jobs or usable_cores())
        return Limits(settings.timeout, memory)
