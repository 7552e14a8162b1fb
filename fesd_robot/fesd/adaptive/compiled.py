"""CasADi functions with dense results that are called without copies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np


class DenseFunction:
    """A CasADi function that reads and writes arrays of its own.

    Args:
        name: for messages.
        arguments: SX symbols.
        results: SX, each evaluated densely.

    Attributes:
        results: views of what the last call computed, in the shapes of the expressions; vectors are (n).
    """

    def __init__(self, name: str, arguments: Sequence[ca.SX], results: Sequence[ca.SX]) -> None:
        function = ca.Function(name, list(arguments), [ca.densify(result) for result in results])
        self._buffer, self._evaluate = function.buffer()
        buffer: Any = self._buffer
        self._function = function
        self._given = [np.zeros(max(argument.numel(), 1)) for argument in arguments]
        self._sizes = [argument.numel() for argument in arguments]
        flat = [np.zeros(max(result.numel(), 1)) for result in results]
        for i, array in enumerate(self._given):
            buffer.set_arg(i, array.data)
        for i, array in enumerate(flat):
            buffer.set_res(i, array.data)
        self.results = [
            array[: result.numel()] if result.shape[1] == 1 else array[: result.numel()].reshape(result.shape[::-1]).T
            for array, result in zip(flat, results, strict=True)
        ]

    def __call__(self, *arguments: np.ndarray | float) -> list[np.ndarray]:
        """Return the results; they are overwritten by the next call."""
        for own, size, given in zip(self._given, self._sizes, arguments, strict=True):
            own[:size] = given
        self._evaluate()
        return self.results
