"""Compile a few source files into a shared library, once per machine."""

from __future__ import annotations

import atexit
import hashlib
import logging
import os
import platform
import shlex
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from threading import Semaphore, Thread

from filelock import FileLock, Timeout

from fesd_robot.errors import FesdRobotError
from fesd_robot.native.cache import cache_folder, is_whole, put
from fesd_robot.running import check_time, seconds_to_wait

logger = logging.getLogger(__name__)

TIME_LIMIT = 600.0
"""Time limit of one compilation, s."""


class CompilationError(FesdRobotError):
    """A source file that could not be compiled, or no compiler; the message quotes the compiler's first error."""


class NotCompiledYet(FesdRobotError):
    """A compiler still works, and nobody wanted to wait for it.

    Attributes:
        libraries: the files that it makes.
    """

    def __init__(self, libraries: Sequence[Path]) -> None:
        super().__init__("the compiler still works")
        self.libraries = tuple(libraries)


def shared_library(
    name: str,
    sources: Sequence[Path],
    flags: Sequence[str],
    *,
    headers: Sequence[Path] = (),
    folders: Sequence[Path] = (),
) -> Path:
    """Return a shared library compiled from source files, from the cache if it was compiled before.

    The cache knows a library by the contents of its files, the flags, the compiler and the processor. A library appears
    there in one piece: processes that compile the same one at the same time do not meet.

    Args:
        name: begins the file's name.
        sources: C or C++ files, all of one language.
        flags: of the compiler.
        headers: files whose change asks for a new compilation.
        folders: where headers are; another folder alone does not ask for one.

    Raises:
        CompilationError: no compiler, or it failed.
        OutOfTime: the time limit came while it was waited for.
    """
    contents = [file.name.encode() + b"\0" + file.read_bytes() for file in [*sources, *headers]]
    language = "c" if sources[0].suffix == ".c" else "c++"
    return _Library.of(name, language, contents, flags, folders, lambda _: sources).made()


def shared_libraries(
    name: str,
    sources: Mapping[str, Callable[[], Callable[[], str]]],
    flags: Sequence[str],
    *,
    headers: Sequence[Path] = (),
    folders: Sequence[Path] = (),
    wait: bool = True,
) -> list[Path]:
    """Return shared libraries compiled from C that is written only if the cache has no such file, several made at once.

    Args:
        name: begins the files' names.
        sources: what prepares each text of C in this thread, by a word that says all that the text depends on; what it
            returns writes the text in another one.
        flags, headers, folders: as for a `shared_library`.
        wait: whether the caller waits until all are compiled; else they are compiled while this process works. A
            process that was forked waits, unless another one compiles.

    Raises:
        CompilationError: no compiler, or it failed while the caller waited.
        NotCompiledYet: the caller does not wait.
    """
    common = [file.read_bytes() for file in headers]

    def library(key: str) -> _Library:
        def written(folder: Path) -> list[Path]:
            (folder / f"{name}.c").write_text((texts.get(key) or sources[key]())())
            return [folder / f"{name}.c"]

        return _Library.of(name, "c", [key.encode(), *common], flags, folders, written)

    libraries = {key: library(key) for key in sources}
    texts = {key: sources[key]() for key, one in libraries.items() if not is_whole(one.target)}
    missing = [libraries[key] for key in texts]
    if missing and not wait:
        own = os.getpid() == _BACKGROUND.process
        for one in missing if own else []:
            _BACKGROUND.begin(one.target, one.made)
        if own or any(one.is_being_made() for one in missing):
            raise NotCompiledYet([one.target for one in missing])
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(_Library.made, libraries.values()))


def begin(library: Callable[[], Path]) -> None:
    """Compile a library while this process works; whoever needs it meanwhile waits for it, or meets its error."""

    def made() -> None:
        with suppress(CompilationError):
            library()

    _BACKGROUND.begin(library, made)


@dataclass(frozen=True)
class _Library:
    """A library that the cache has, or that can be made.

    Attributes:
        name: begins the file's name.
        command: the compiler with its flags.
        folders: where headers are.
        sources: writes the source files into a folder if it has to, and returns where they are.
        target: the file.
    """

    name: str
    command: Sequence[str]
    flags: Sequence[str]
    folders: Sequence[Path]
    sources: Callable[[Path], Sequence[Path]]
    target: Path

    @classmethod
    def of(
        cls,
        name: str,
        language: str,
        contents: Sequence[bytes],
        flags: Sequence[str],
        folders: Sequence[Path],
        sources: Callable[[Path], Sequence[Path]],
    ) -> _Library:
        """Return the library that these contents are compiled to."""
        compiler, suffix = find_compiler(language), ".dylib" if platform.system() == "Darwin" else ".so"
        digest = hashlib.sha256()
        for part in contents:
            digest.update(part + b"\0")
        for word in [*compiler, *flags, compiler_version(tuple(compiler)), processor()]:
            digest.update(word.encode() + b"\0")
        target = cache_folder() / f"{name}-{digest.hexdigest()[:20]}{suffix}"
        return cls(name, compiler, flags, folders, sources, target)

    @property
    def lock(self) -> Path:
        """The file that a process holds while it makes the library."""
        return self.target.with_name(f".{self.target.name}.lock")

    def is_being_made(self) -> bool:
        """Return whether another process makes it now."""
        if not self.lock.exists():
            return False
        try:
            with FileLock(self.lock, timeout=0):
                return False
        except Timeout:
            return True

    def made(self) -> Path:
        """Return the file, compiled if it has to be: each source by itself, several at once.

        Raises:
            CompilationError: the compiler failed.
            OutOfTime: the time limit came while it was waited for.
        """
        if is_whole(self.target):
            return self.target
        try:
            with _alone(self.lock), tempfile.TemporaryDirectory(dir=self.target.parent, prefix=f".{self.name}-") as at:
                if is_whole(self.target):  # another process has made it meanwhile
                    return self.target
                made, sources = Path(at) / self.target.name, list(self.sources(Path(at)))
                objects = [Path(at) / f"{source.name}.o" for source in sources]
                self._run([["-c", str(source), "-o", str(to)] for source, to in zip(sources, objects, strict=True)])
                self._run([["-shared", *map(str, objects), "-o", str(made)]])
                put(made, self.target)
        except (OSError, subprocess.TimeoutExpired) as error:
            check_time()
            raise CompilationError(f"{self.name} could not be compiled: {error}") from error
        return self.target

    def _run(self, calls: Sequence[Sequence[str]]) -> None:
        """Call the compiler several times at once."""
        where = [f"-I{folder}" for folder in self.folders]
        commands = [[*self.command, "-fPIC", *where, *words, *self.flags] for words in calls]
        logger.debug("compiling %s: %s", self.name, shlex.join(commands[0]))
        failed = [errors for code, errors in _BACKGROUND.run(commands) if code]
        if failed:
            lines = failed[0].strip().splitlines() or ["no message"]
            words = next((line for line in lines if "error" in line), lines[-1])
            raise CompilationError(f"{self.command[0]} could not compile {self.name}: {words}")


class _Background:
    """Compilers that run while this process works, and end with it.

    Attributes:
        process: the one that began them; one that was forked from it has none of its threads.
    """

    def __init__(self) -> None:
        self.process = os.getpid()
        self._begun: dict[object, Thread] = {}
        self._running: set[subprocess.Popen[str]] = set()
        self._cores = Semaphore(os.cpu_count() or 1)
        self._ending = False

    def begin(self, what: object, make: Callable[[], object]) -> None:
        """Make a library in a thread of its own, unless that was begun before; the log says what fails."""
        if what in self._begun:
            return
        self._begun[what] = Thread(target=partial(self._make, make), daemon=True)
        self._begun[what].start()

    def _make(self, make: Callable[[], object]) -> None:
        with self._cores:
            if self._ending:
                return
            try:
                make()
            except CompilationError as error:
                if not self._ending:
                    logger.warning("%s", error)

    def run(self, commands: Sequence[Sequence[str]]) -> list[tuple[int, str]]:
        """Return exit code and error output of compilers that run at once; they end with this process."""
        started = list[subprocess.Popen[str]]()
        try:
            for command in commands:
                started.append(_begun(command))
                self._running.add(started[-1])
            errors = [one.communicate(timeout=seconds_to_wait(TIME_LIMIT))[1] for one in started]
            return [(one.returncode, words) for one, words in zip(started, errors, strict=True)]
        finally:
            for one in started:
                if one.poll() is None:
                    _killed(one)
                    one.wait()
                self._running.discard(one)

    def end(self) -> None:
        """End all compilers; nothing half made stays in the cache."""
        if os.getpid() != self.process:
            return
        self._ending = True
        for process in list(self._running):
            _killed(process)
        for thread in self._begun.values():
            thread.join()


def _begun(command: Sequence[str]) -> subprocess.Popen[str]:
    """Return a compiler that runs in a group of its own, with the programs that it calls."""
    return subprocess.Popen(
        command,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        start_new_session=True,
    )


def _killed(process: subprocess.Popen[str]) -> None:
    """End a compiler with the programs that it calls, which else would work on."""
    if not hasattr(os, "killpg"):
        process.kill()
        return
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)


_BACKGROUND = _Background()
atexit.register(_BACKGROUND.end)


@contextmanager
def _alone(lock: Path) -> Iterator[None]:
    """Let one process at a time make a file, so that two that need the same one do not compile it twice."""
    own = FileLock(lock)
    try:
        own.acquire(timeout=seconds_to_wait(TIME_LIMIT))
    except Timeout as error:
        check_time()
        raise CompilationError(f"another process has worked on it for {TIME_LIMIT:g} s ({lock})") from error
    try:
        yield
    finally:
        lock.unlink(missing_ok=True)
        own.release()


def find_compiler(language: str) -> list[str]:
    """Return the compiler of a language, ``c`` or ``c++``, as a command: CC or CXX, else the usual names.

    A program that is found in the current folder, where a stranger's task may lie, is not taken.

    Raises:
        CompilationError: there is none.
    """
    variable, names = {"c": ("CC", ("cc", "gcc", "clang")), "c++": ("CXX", ("c++", "g++", "clang++"))}[language]
    chosen = shlex.split(os.environ.get(variable, ""))
    for command in [chosen] if chosen else [[name] for name in names]:
        found = shutil.which(command[0])
        if found and (os.path.isabs(found) or os.path.dirname(command[0])):
            return command
    raise CompilationError(f"no {language.upper()} compiler found (set {variable}, or install one)")


@cache
def compiler_version(command: tuple[str, ...]) -> str:
    """Return the version that the compiler prints."""
    done = subprocess.run([*command, "--version"], capture_output=True, text=True, errors="replace", check=False)
    return done.stdout.split("\n", 1)[0]


@cache
def processor() -> str:
    """Identify this processor: code for one may not run on another that shares the cache."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
        flags = next((line for line in lines if line.startswith(("flags", "Features"))), "")
    except OSError:
        flags = platform.processor()
    return f"{platform.machine()} {flags}"


def instruction_set() -> str:
    """Return the compiler's flag for this processor.

    Where it can be, that is one common level: with the same instructions sums are rounded alike, so that a task ends in
    the same local optimum on other machines.
    """
    return "-march=x86-64-v3" if {"avx2", "fma", "bmi2"} <= set(processor().split()) else "-march=native"
