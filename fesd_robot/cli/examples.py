"""`fesd-robot examples`."""

from __future__ import annotations

import shutil
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from fesd_robot.examples import Example

NEEDS_ROBOTS = "(needs pip install 'fesd-robot[robots]')"

_MOST_COLUMNS = 100
_INDENT = "    "


def _names_beginning_with(incomplete: str) -> list[str]:
    """Return the names a shell may complete to."""
    from fesd_robot.examples import examples_by_name

    return [name for name in sorted(examples_by_name()) if name.startswith(incomplete)]


def examples(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME ...]",
            help="Tasks, sweeps or models to copy, a task with the models and files that it needs.",
            autocompletion=_names_beginning_with,
            show_default=False,
        ),
    ] = None,
    everything: Annotated[bool, typer.Option("--all", help="Copy all of them.")] = False,
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder for the copies: tasks/, sweeps/, models/.")
    ] = Path(),
    force: Annotated[bool, typer.Option("--force", help="Replace files that have another content.")] = False,
) -> None:
    """List the tasks, sweeps and models that come with the program, or copy some of them to change them.

    `plan` and `check` take the name of such a task, `sweep` that of such a sweep: fesd-robot plan hopper_one_jump
    """
    from fesd_robot.examples import copy_examples, shipped_examples

    if names and everything:
        raise typer.BadParameter("found names beside --all, expected one of them")
    if not names and not everything:
        if out != Path() or force:
            raise typer.BadParameter("found --out or --force without a name, expected names of examples, or --all")
        typer.echo("\n".join(_listed(shipped_examples())))
        return
    from fesd_robot.task import SCHEMA_FILE

    written = copy_examples(names or [], out, schema=SCHEMA_FILE.read_bytes(), overwrite=force)
    typer.echo("\n".join(f"written: {path}" for path in written))
    told = [path for path in written if path.suffix == ".yaml"]
    if told:
        commands = {example.name: "simulate" for example in shipped_examples() if example.simulated}
        commands |= {example.name: "sweep" for example in shipped_examples() if example.kind == "sweep"}
        first = min(told, key=lambda path: path.stem in commands)
        typer.echo(f"\nNext: fesd-robot {commands.get(first.stem, 'check')} {first}")


def _listed(shipped: Sequence[Example]) -> list[str]:
    """Return the lines of the list, no longer than the terminal is wide."""
    columns = min(shutil.get_terminal_size().columns, _MOST_COLUMNS)
    lines: list[str] = []
    kinds = {
        "Tasks (fesd-robot plan NAME):": [
            each for each in shipped if each.kind == "task" and not each.simulated and not each.public
        ],
        "Tasks of other planners (fesd-robot plan NAME):": [each for each in shipped if each.public],
        "Tasks without controls (fesd-robot simulate NAME):": [each for each in shipped if each.simulated],
        "Sweeps (fesd-robot sweep NAME):": [each for each in shipped if each.kind == "sweep"],
        "Models:": [each for each in shipped if each.kind == "model"],
    }
    for title, examples_of_kind in kinds.items():
        lines += ["", title] if lines else [title]
        for example in examples_of_kind:
            words = f"{example.words} {NEEDS_ROBOTS}" if example.needs_robot_data else example.words
            lines.append(f"  {example.name}")
            lines += textwrap.wrap(
                words, columns - 1, initial_indent=_INDENT, subsequent_indent=_INDENT, break_on_hyphens=False
            )
    return [*lines, "", "To change one, copy it with what it needs: fesd-robot examples NAME"]
