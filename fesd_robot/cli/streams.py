"""What the program prints on, in whatever encoding that is."""

from __future__ import annotations

import io
import sys


def set_up_streams() -> None:
    """Let stdout and stderr escape what their encoding cannot show, as the code page of a console."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
