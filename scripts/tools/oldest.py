"""Print the dependencies of the program at the lowest versions that pyproject.toml allows, as requirements of pip."""

from __future__ import annotations

import re
import sys
from pathlib import Path

LOWEST = re.compile(r'^    "([\w-]+)>=([\w.]+)",$', re.MULTILINE)


def lowest_versions(project: str) -> list[str]:
    """Return ``name==version.*`` of every dependency.

    Args:
        project: text of pyproject.toml, with a dependency a line.
    """
    listed = project.partition("\ndependencies = [\n")[2].partition("\n]")[0] + "\n"
    return [f"{name}=={version}.*" for name, version in LOWEST.findall(listed)]


if __name__ == "__main__":
    project = Path(__file__).parents[2] / "pyproject.toml"
    sys.stdout.write("\n".join(lowest_versions(project.read_text(encoding="utf-8"))) + "\n")
