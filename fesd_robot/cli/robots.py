"""`fesd-robot robots`."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fesd_robot.explanation.table import aligned

if TYPE_CHECKING:
    from fesd_robot.robot.catalogue import Entry


def _names_beginning_with(incomplete: str) -> list[str]:
    """Return the names a shell may complete to."""
    from fesd_robot.robot import example_robots

    return [name for name in example_robots() if name.startswith(incomplete)]


def robots(
    pattern: Annotated[
        str | None,
        typer.Argument(
            metavar="PATTERN",
            help="Show only names that contain this, or that match it if it contains * or ?.",
            autocompletion=_names_beginning_with,
            show_default=False,
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """List the robots that a task can name as example-robot-data:NAME.

    Degrees of freedom are those of the joints, without a floating root; driven are those with an effort limit.
    """
    from fesd_robot.robot.catalogue import catalogue
    from fesd_robot.robot.library import examples_folder

    entries = catalogue(pattern)
    if as_json:
        typer.echo(json.dumps([asdict(entry) for entry in entries], indent=2))
        return
    folder = examples_folder()
    header = ["name", "degrees of freedom", "driven", "mass, kg", f"file below {folder}"]
    typer.echo("\n".join(aligned([header, *(_row(entry, folder) for entry in entries)])))
    unread = [entry for entry in entries if entry.error]
    if unread:
        typer.echo("\nThese cannot be read:")
        typer.echo("\n".join(f"  {entry.name}: {entry.error}" for entry in unread))


def _row(entry: Entry, folder: Path) -> list[str]:
    numbers = [entry.degrees_of_freedom, entry.driven, entry.mass]
    return [
        entry.name,
        *("-" if number is None else f"{number:.4g}" for number in numbers),
        str(Path(entry.file).relative_to(folder)),
    ]
