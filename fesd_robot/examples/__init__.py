"""The tasks, sweeps and models that come with the program: what there is, and copies of them."""

from __future__ import annotations

from fesd_robot.examples.copying import copy_examples
from fesd_robot.examples.shipped import (
    Example,
    examples_by_name,
    find_sweep,
    find_task,
    shipped_examples,
    shipped_folder,
    shipped_sweeps,
)

__all__ = [
    "Example",
    "copy_examples",
    "examples_by_name",
    "find_sweep",
    "find_task",
    "shipped_examples",
    "shipped_folder",
    "shipped_sweeps",
]
