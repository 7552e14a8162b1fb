"""The package's log records on stderr."""

from __future__ import annotations

import logging

import typer

from fesd_robot.printable import visible


class EchoHandler(logging.Handler):
    """Writes every record as one line ``level: message`` to stderr, wherever that points at the time."""

    def emit(self, record: logging.LogRecord) -> None:
        """Write one record."""
        typer.echo(f"{record.levelname.lower()}: {visible(self.format(record), lines=True)}", err=True)


def set_up_logging(verbose: bool) -> None:
    """Show the package's warnings on stderr, with `verbose` all of its records."""
    logger = logging.getLogger("fesd_robot")
    logger.setLevel(logging.DEBUG if verbose else logging.WARNING)
    if not any(isinstance(handler, EchoHandler) for handler in logger.handlers):
        logger.addHandler(EchoHandler())
