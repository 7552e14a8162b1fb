"""Derivatives of a block, and what the cache notes of them: those that were compiled once need not be made again."""

from __future__ import annotations

import contextlib
import hashlib
import logging
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import casadi as ca
import numpy as np

from fesd_robot.native import Formula, cache_folder, is_whole, put

logger = logging.getLogger(__name__)

MADE_BY = (Path(__file__), Path(__file__).with_name("blocks.py"), Path(__file__).with_name("steering.py"))
"""Files on which derivatives depend, beside the relaxations."""

RECORDED = 2000
"""Instructions from which on finding derivatives again takes less time than making them."""


@dataclass(frozen=True, eq=False)
class BlockDerivatives:
    """One copy of a block, relaxed, as functions of (x, p, sigmas): x are its variables and, behind them, its slacks.

    Attributes:
        cost, rows: values, (1, 1) and (n_rows, 1).
        gradient: of the cost by the variables, its nonzeros (n, 1).
        jacobian: of the rows by x, its nonzeros.
        hessian: upper triangle of that of the Lagrangian weight * cost + multipliers' * rows, its nonzeros; has the
            weight and the Lagrange multipliers as further inputs.
        gradient_sparsity, jacobian_sparsity, hessian_sparsity: where the nonzeros are.
        lower, upper: bounds of the rows.
    """

    cost: Formula
    rows: Formula
    gradient: Formula
    jacobian: Formula
    hessian: Formula
    gradient_sparsity: ca.Sparsity
    jacobian_sparsity: ca.Sparsity
    hessian_sparsity: ca.Sparsity
    lower: np.ndarray
    upper: np.ndarray

    @property
    def formulas(self) -> tuple[Formula, ...]:
        """All functions, in the order in which they are recorded."""
        return self.cost, self.rows, self.gradient, self.jacobian, self.hessian

    @property
    def instructions(self) -> int:
        """Number of operations of one evaluation of all functions."""
        return sum(one.instructions for one in self.formulas)


def identity_of(*parts: bytes | str) -> str:
    """Return the word by which the derivatives of equations are found again.

    Args:
        parts: all that they depend on, beside the program and CasADi.
    """
    digest = hashlib.sha256(_program())
    for part in parts:
        digest.update((part.encode() if isinstance(part, str) else part) + b"\0")
    return digest.hexdigest()[:20]


@cache
def _program() -> bytes:
    sources = [*MADE_BY, *sorted((Path(__file__).parent / "relaxations").glob("*.py"))]
    return b"\0".join([ca.CasadiMeta.version().encode(), *(source.read_bytes() for source in sources)])


def _file(identity: str) -> Path:
    return cache_folder() / f"derivatives-{identity}.npz"


def recorded(identity: str, make: Callable[[], BlockDerivatives]) -> BlockDerivatives | None:
    """Return derivatives that the cache knows; their functions are made where one is asked for.

    Args:
        identity: of them.
        make: derivatives with functions.

    Returns:
        None where the cache knows nothing.
    """
    file = _file(identity)
    if not is_whole(file):
        return None
    once = cache(make)

    def function(number: int) -> ca.Function:
        return once().formulas[number].function

    try:
        with np.load(file, allow_pickle=False) as known:
            cost, rows, gradient, jacobian, hessian = (
                Formula(str(name), int(sizes[0]), int(sizes[1]), int(sizes[2]), partial(function, n))
                for n, (name, sizes) in enumerate(zip(known["names"], known["sizes"], strict=True))
            )
            patterns = _pattern(known["gradient"]), _pattern(known["jacobian"]), _pattern(known["hessian"])
            return BlockDerivatives(
                cost, rows, gradient, jacobian, hessian, *patterns, lower=known["lower"], upper=known["upper"]
            )
    except (OSError, ValueError, KeyError, TypeError, RuntimeError, zipfile.BadZipFile) as error:
        logger.debug("%s is not read: %s", file, error)
        return None


def record(identity: str, derivatives: BlockDerivatives) -> None:
    """Note in the cache what is known of derivatives; small ones, and where it cannot be written, are made again.

    Args:
        identity: of them.
        derivatives: with functions.
    """
    file = _file(identity)
    if derivatives.instructions < RECORDED or is_whole(file):
        return
    sizes = [(one.instructions, one.outputs, one.work) for one in derivatives.formulas]
    with (
        contextlib.suppress(OSError),
        tempfile.TemporaryDirectory(dir=file.parent, prefix=".derivatives-") as folder,
    ):
        made = Path(folder) / file.name
        np.savez(
            made,
            names=np.array([one.name for one in derivatives.formulas]),
            sizes=np.array(sizes),
            lower=derivatives.lower,
            upper=derivatives.upper,
            gradient=_numbers(derivatives.gradient_sparsity),
            jacobian=_numbers(derivatives.jacobian_sparsity),
            hessian=_numbers(derivatives.hessian_sparsity),
        )
        put(made, file)


def _numbers(pattern: ca.Sparsity) -> np.ndarray:
    """Return rows and columns of a pattern, and its compressed columns."""
    return np.array([*pattern.shape, *pattern.colind(), *pattern.row()], dtype=np.int64)


def _pattern(numbers: np.ndarray) -> ca.Sparsity:
    rows, columns = (int(size) for size in numbers[:2])
    return ca.Sparsity(rows, columns, numbers[2 : 3 + columns].tolist(), numbers[3 + columns :].tolist())
