"""What readers of models in C++ say of mistakes: on stderr, and in exceptions with places in their sources."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Callable, Iterator


@contextlib.contextmanager
def captured_errors() -> Iterator[Callable[[], list[str]]]:
    """Collect the text that C++ code writes to stderr, the only place where the URDF parser reports mistakes."""
    try:
        saved = os.dup(2)
    except OSError:  # a process without stderr
        yield list
        return
    with tempfile.TemporaryFile() as sink:

        def complaints() -> list[str]:
            sink.seek(0)
            lines = [line.decode(errors="replace").strip() for line in sink.readlines()]
            return [line.removeprefix("Error:").strip() + "." for line in lines if line.startswith("Error:")]

        os.dup2(sink.fileno(), 2)
        try:
            yield complaints
        finally:
            os.dup2(saved, 2)
            os.close(saved)


def last_sentence(text: str) -> str:
    """Return the message of one of Pinocchio's errors without the place in its sources."""
    return " ".join(text.rpartition("message:\n")[2].split())
