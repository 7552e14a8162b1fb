"""The cores that a process has for itself."""

from __future__ import annotations


class Cores:
    """Cores that one process has for itself.

    Args:
        most: how many.
    """

    def __init__(self, most: int) -> None:
        self.most = most

    @property
    def share(self) -> int:
        """How many processes may work just now, at least one."""
        return self.most
