"""Names of a package that are imported when they are first used (PEP 562)."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any


def lazy_exports(
    package: str, names_by_module: Mapping[str, Sequence[str]]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return the functions `__getattr__` and `__dir__` of a package whose names are imported on first use.

    Args:
        package: full name of the package.
        names_by_module: full name of a module -> what the package exports of it. A name for which the package has a
            module of its own stands for that module, as `dcs` of ``fesd_robot.dcs``.
    """
    home = {name: module for module, names in names_by_module.items() for name in names}

    def load(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        module = importlib.import_module(home[name])
        value = module if home[name] == f"{package}.{name}" else getattr(module, name)
        setattr(sys.modules[package], name, value)
        return value

    def names() -> list[str]:
        special = [name for name in vars(sys.modules[package]) if name.startswith("__")]
        return sorted([*special, *home])

    return load, names


def by_name(module: str, name: str) -> Any:
    """Return a named object of a module that stands above the caller, imported when it is needed.

    For methods of a value that users expect on it, but that need rooms above its own: a plan that shows itself.

    Args:
        module: full name of the module.
        name: of what it has.
    """
    return getattr(importlib.import_module(module), name)
