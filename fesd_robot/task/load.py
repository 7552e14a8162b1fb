"""Load a task file: text in, a checked task out, or one error that says what to change and where."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pydantic import ValidationError

from fesd_robot.arguments import checked
from fesd_robot.examples import find_task
from fesd_robot.task.document import read_document
from fesd_robot.task.messages import validation_error
from fesd_robot.task.printable_names import refuse_hidden
from fesd_robot.task.schema import Task


@checked
def load_task(path: str | Path, overrides: Sequence[str] = ()) -> Task:
    """Load and check a task file.

    Names are not compared with the robot here, see `fesd_robot.task.check_names`.

    Args:
        path: the YAML file, or the name of a task that comes with the program, e.g. ``hopper_one_jump``.
        overrides: ``key.path=value`` each, e.g. ``horizon.intervals=30``; values are YAML, the last one for a key wins.

    Raises:
        TaskError: the file cannot be read or is no valid task; the error names file, line and key.
    """
    data, origins = read_document(find_task(path), overrides)
    refuse_hidden(data, origins)
    try:
        task = Task.model_validate(data)
    except ValidationError as error:
        raise validation_error(error, origins) from error
    return task.with_origins(origins)
