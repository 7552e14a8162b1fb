"""Compile a few source files into a shared library, once per machine."""

from __future__ import annotations

import hashlib
import logging
import os
import platform
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from filelock import FileLock
from platformdirs import user_cache_path

from fesd_robot.errors import FesdRobotError

logger = logging.getLogger(__name__)

TIME_LIMIT = 600.0
"""Time limit of one compilation, s."""


class CompilationError(FesdRobotError):
    """A source file that could not be compiled, or no compiler; the message quotes the compiler's first error."""


def cache_folder() -> Path:
    """Return the folder that compiled libraries are kept in, FESD_ROBOT_CACHE or the user's cache folder."""
    chosen = os.environ.get("FESD_ROBOT_CACHE")
    return Path(chosen) if chosen else user_cache_path("fesd_robot")


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
    """
    language = "c" if sources[0].suffix == ".c" else "c++"
    contents = [file.name.encode() + b"\0" + file.read_bytes() for file in [*sources, *headers]]
    return _cached(name, language, contents, flags, folders, lambda _: sources)


def shared_libraries(
    name: str,
    sources: Mapping[str, Callable[[], str]],
    flags: Sequence[str],
    *,
    headers: Sequence[Path] = (),
    folders: Sequence[Path] = (),
) -> list[Path]:
    """Return shared libraries compiled from C that is written only if the cache has no such file, several made at once.

    Args:
        name: begins the files' names.
        sources: what makes each text of C, by a word that says all that the text depends on.
        flags, headers, folders: as for a `shared_library`.

    Raises:
        CompilationError: no compiler, or it failed.
    """
    common = [file.read_bytes() for file in headers]

    def made(key: str) -> Path:
        def written(folder: Path) -> list[Path]:
            (folder / f"{name}.c").write_text(sources[key]())
            return [folder / f"{name}.c"]

        return _cached(name, "c", [key.encode(), *common], flags, folders, written)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(made, sources))


def _cached(
    name: str,
    language: str,
    contents: Sequence[bytes],
    flags: Sequence[str],
    folders: Sequence[Path],
    sources: Callable[[Path], Sequence[Path]],
) -> Path:
    """Return the file that these contents are compiled to; `sources` writes them into a folder if it has to."""
    compiler, suffix = find_compiler(language), ".dylib" if platform.system() == "Darwin" else ".so"
    digest = hashlib.sha256()
    for part in contents:
        digest.update(part + b"\0")
    for word in [*compiler, *flags, compiler_version(tuple(compiler)), processor()]:
        digest.update(word.encode() + b"\0")
    target = cache_folder() / f"{name}-{digest.hexdigest()[:20]}{suffix}"
    if target.exists():
        return target
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with _alone(target), tempfile.TemporaryDirectory(dir=target.parent, prefix=f".{name}-") as place:
            if target.exists():  # another process has made it meanwhile
                return target
            made = Path(place) / target.name
            where = [f"-I{folder}" for folder in folders]
            command = [*compiler, "-shared", "-fPIC", *where, *map(str, sources(Path(place))), *flags, "-o", str(made)]
            logger.debug("compiling %s: %s", name, shlex.join(command))
            done = subprocess.run(command, capture_output=True, text=True, timeout=TIME_LIMIT, check=False)
            if done.returncode:
                lines = done.stderr.strip().splitlines() or ["no message"]
                words = next((line for line in lines if "error" in line), lines[-1])
                raise CompilationError(f"{compiler[0]} could not compile {name}: {words}")
            os.replace(made, target)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise CompilationError(f"{name} could not be compiled: {error}") from error
    return target


@contextmanager
def _alone(target: Path) -> Iterator[None]:
    """Let one process at a time make a file, so that two that need the same one do not compile it twice."""
    lock = target.with_name(f".{target.name}.lock")
    with FileLock(lock):
        try:
            yield
        finally:
            lock.unlink(missing_ok=True)


def find_compiler(language: str) -> list[str]:
    """Return the compiler of a language, ``c`` or ``c++``, as a command: CC or CXX, else the usual names.

    Raises:
        CompilationError: there is none.
    """
    variable, names = {"c": ("CC", ("cc", "gcc", "clang")), "c++": ("CXX", ("c++", "g++", "clang++"))}[language]
    chosen = shlex.split(os.environ.get(variable, ""))
    for command in [chosen] if chosen else [[name] for name in names]:
        if shutil.which(command[0]):
            return command
    raise CompilationError(f"no {language.upper()} compiler found (set {variable}, or install one)")


@cache
def compiler_version(command: tuple[str, ...]) -> str:
    """Return what the compiler says about itself."""
    done = subprocess.run([*command, "--version"], capture_output=True, text=True, check=False)
    return done.stdout.split("\n", 1)[0]


@cache
def processor() -> str:
    """Return what distinguishes this processor: code for one may not run on another that shares the cache."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
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
