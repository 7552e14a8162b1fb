"""`fesd-robot robots`."""

from __future__ import annotations

import io
import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fesd_robot.cli.arguments import Page
from fesd_robot.explanation import aligned

if TYPE_CHECKING:
    from fesd_robot.robot import Entry, Robot


_SUFFIXES = (".urdf", ".xml", ".mjcf", ".sdf")
"""Of model files, whether they exist or not."""


def _names_beginning_with(incomplete: str) -> list[str]:
    """Return the names a shell may complete to."""
    from fesd_robot.robot import example_robots

    return [name for name in example_robots() if name.startswith(incomplete)]


def robots(
    pattern: Annotated[
        str | None,
        typer.Argument(
            metavar="PATTERN|MODEL",
            help="Show only names that contain this, or that match it if it contains * or ?; or show what is in a "
            "model: a file, package://NAME/PATH or example-robot-data:NAME.",
            autocompletion=_names_beginning_with,
            show_default=False,
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
    frames: Annotated[bool, typer.Option("--frames", help="Of a model, list its frames and their places.")] = False,
    shapes: Annotated[
        bool, typer.Option("--shapes", help="Of a model, list the shapes of its bodies that can touch.")
    ] = False,
    sagittal: Annotated[
        bool, typer.Option("--sagittal", help="Propose what to lock and couple so that a model moves in the x-z plane.")
    ] = False,
    page: Page = None,
) -> None:
    """List the robots that a task can name as example-robot-data:NAME, or what a task can name of a model.

    Degrees of freedom are those of the joints, without a floating root; driven are those with an effort limit. Of a
    model, positions are those of its neutral configuration, m.
    """
    if pattern is not None and _is_model(pattern):
        if sagittal:
            _propose_sagittal(pattern, as_json=as_json)
        if page is None and sagittal:
            return
        from fesd_robot.robot import load_robot

        robot = load_robot(pattern)
        if not sagittal:
            _show_model(robot, frames=frames, shapes=shapes, as_json=as_json)
        if page is not None:
            from fesd_robot.actions import draw_robot

            written = draw_robot(robot, page)
            if not (as_json or sagittal):
                typer.echo(f"\nwritten to {written}")
        return
    if frames or shapes or sagittal or page:
        raise typer.BadParameter(
            "found no model for --frames, --shapes, --sagittal or --page, expected a file, package://NAME/PATH or "
            "example-robot-data:NAME"
        )
    from fesd_robot.robot import examples_folder
    from fesd_robot.robot.catalogue import catalogue

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


def _is_model(text: str) -> bool:
    """Return whether an argument names a model rather than a pattern of names."""
    from fesd_robot.task import EXAMPLE_ROBOT_PREFIX, PACKAGE_PREFIX

    suffix = Path(text).suffix.lower()
    return text.startswith((EXAMPLE_ROBOT_PREFIX, PACKAGE_PREFIX)) or suffix in _SUFFIXES or Path(text).is_file()


def _show_model(robot: Robot, *, frames: bool, shapes: bool, as_json: bool) -> None:
    from fesd_robot.robot import immovable_joints
    from fesd_robot.robot.inventory import inventory

    asked = [name for name, yes in (("frames", frames), ("shapes", shapes)) if yes]
    tables = inventory(robot, asked or ["coordinates", "motors", "postures"])
    limits = list(robot.limit_notes.values())
    velocities = -robot.velocity_limit, robot.velocity_limit
    immovable = immovable_joints(robot, (robot.lower_position, robot.upper_position), velocities)
    said = {"warnings": [*robot.warnings, *immovable], "limits": limits, "left out": list(robot.notes)}
    if as_json:
        typer.echo(json.dumps({**tables, **said}, indent=2))
        return
    typer.echo(f"{robot.name}: {robot.model.nv} degrees of freedom, {sum(i.mass for i in robot.model.inertias):.6g} kg")
    for name, rows in tables.items():
        typer.echo(f"\n{name.capitalize()}:" if rows else f"\nNo {name}.")
        if rows:
            columns = list(dict.fromkeys(key for row in rows for key in row))
            cells = [[_cell(row.get(column)) for column in columns] for row in rows]
            typer.echo("\n".join(aligned([columns, *cells])))
    for label, sentences in said.items():
        if sentences:
            typer.echo(f"\n{label.capitalize()}:")
            typer.echo("\n".join(f"  {sentence}" for sentence in sentences))


def _propose_sagittal(source: str, *, as_json: bool) -> None:
    """Print the section `robot` of a task, as YAML or JSON."""
    from ruamel.yaml import YAML

    from fesd_robot.errors import JointError, RobotError
    from fesd_robot.robot import load_robot, propose_sagittal

    try:
        proposal = propose_sagittal(load_robot(source, root="sagittal").model)
    except JointError as error:
        raise RobotError(f"{source}: cannot be held in the x-z plane: {error}") from error
    section = {"model": source, "root": "sagittal", "locked": proposal.locked, "coupled": proposal.coupled}
    if as_json:
        typer.echo(json.dumps({"robot": section}, indent=2))
        return
    yaml, stream = YAML(typ="safe", pure=True), io.StringIO()
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    yaml.dump({"robot": section}, stream)
    typer.echo(stream.getvalue(), nl=False)


def _cell(value: object) -> str:
    if value is None:
        return "-"
    if isinstance(value, dict):
        return ", ".join(f"{name} {_cell(one)}" for name, one in value.items()) or "-"
    if isinstance(value, list):
        return f"[{', '.join(_cell(one) for one in value)}]"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
