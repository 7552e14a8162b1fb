"""`fesd-robot schema`."""

from __future__ import annotations

import typer


def schema() -> None:
    """Print the JSON schema of task files.

    Editors complete and check task files with it while they are written.
    """
    from fesd_robot.task import task_json_schema_text

    typer.echo(task_json_schema_text(), nl=False)
