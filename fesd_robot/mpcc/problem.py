"""The MPCC as a value: variables, cost, constraints, and complementarity pairs that nothing has relaxed yet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import casadi as ca
import numpy as np

from fesd_robot.errors import DimensionError


@dataclass(frozen=True)
class Block:
    """K copies of one small problem, each reading its own selection of the variables.

    Args:
        copy_names: what each copy is, e.g. ``interval 7``, length K.
        function: CasADi function (w, p) -> (f, g, G, H) of local variables and parameters.
        index: global index of each local variable, integers of shape (n_w, K); no repetition within a column.
        parameters: values of p, shape (n_p, K).
        lower, upper: bounds of g, shape (n_g,).
        constraint_names, pair_names: one name per row of g and per pair.
        one_sided: which pairs ask for H >= 0 and G H <= 0 only, with G of any sign (vanishing constraints); none if
            omitted.
        ranks: rank of each pair, 0 or 1; a homotopy may relax pairs of rank 1 further. All 0 if omitted.

    Raises:
        DimensionError: a shape does not fit the function's.
    """

    copy_names: Sequence[str]
    function: ca.Function
    index: np.ndarray
    parameters: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    constraint_names: Sequence[str]
    pair_names: Sequence[str]
    one_sided: np.ndarray | None = None
    ranks: np.ndarray | None = None

    def __post_init__(self) -> None:
        n_w, n_p = self.function.size1_in(0), self.function.size1_in(1)
        n_g, n_pairs = self.function.size1_out(1), self.function.size1_out(2)
        copies = self.index.shape[1]
        for what, found, expected in (
            ("index", self.index.shape, (n_w, copies)),
            ("copy_names", (len(self.copy_names),), (copies,)),
            ("parameters", self.parameters.shape, (n_p, copies)),
            ("lower", self.lower.shape, (n_g,)),
            ("upper", self.upper.shape, (n_g,)),
            ("constraint_names", (len(self.constraint_names),), (n_g,)),
            ("pair_names", (len(self.pair_names),), (n_pairs,)),
            ("one_sided", self.sign_free.shape, (n_pairs,)),
            ("ranks", self.pair_ranks.shape, (n_pairs,)),
            ("H", (self.function.size1_out(3),), (n_pairs,)),
        ):
            if found != expected:
                raise DimensionError(f"block '{self.function.name()}': {what} has shape {found}, expected {expected}")

    @property
    def sign_free(self) -> np.ndarray:
        """Which pairs are one-sided, (n_pairs,)."""
        return np.zeros(len(self.pair_names), dtype=bool) if self.one_sided is None else self.one_sided

    @property
    def pair_ranks(self) -> np.ndarray:
        """Rank of each pair, (n_pairs,)."""
        return np.zeros(len(self.pair_names), dtype=int) if self.ranks is None else self.ranks

    @property
    def copies(self) -> int:
        """Number of copies K."""
        return self.index.shape[1]

    @cached_property
    def mapped(self) -> ca.Function:
        """The function of all copies at once, columns are copies."""
        return self.function.map(self.copies)

    def evaluate(self, w: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return (f, g, G, H) with shapes (1, K), (n_g, K), (n_pairs, K), (n_pairs, K) at the global point w."""
        outputs = self.mapped(w[self.index], self.parameters)
        return tuple(np.asarray(ca.DM(out)).reshape(out.shape) for out in outputs)


@dataclass(frozen=True)
class Residuals:
    """How well a point satisfies an MPCC, recomputed from the point alone.

    Attributes:
        objective: f(w).
        constraint_violation: largest violation of a bound on w or g, or of G, H >= 0.
        complementarity: largest product G H over all pairs.
        natural_residual: largest min(G, H) over all pairs.
        worst_constraint, worst_pair: where these maxima sit, in words.
    """

    objective: float
    constraint_violation: float
    complementarity: float
    natural_residual: float
    worst_constraint: str
    worst_pair: str


@dataclass(frozen=True)
class Mpcc:
    """min f(w) s.t. lower <= w <= upper, g_lower <= g(w) <= g_upper, 0 <= G(w) complementary to H(w) >= 0.

    The problem is a sum of blocks: f is the sum of the blocks' costs, g, G, H are stacked.

    Args:
        lower, upper, start: bounds and initial point of the variables, shape (n,).
        blocks: the pieces of the problem.

    Raises:
        DimensionError: bounds or start of different length, or a block that points outside.
    """

    lower: np.ndarray
    upper: np.ndarray
    start: np.ndarray
    blocks: Sequence[Block]
    names: Sequence[str] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        shapes = {self.lower.shape, self.upper.shape, self.start.shape}
        if len(shapes) != 1:
            raise DimensionError(f"lower, upper and start must have one shape, found {sorted(shapes)}")
        for block in self.blocks:
            if block.index.size and not 0 <= block.index.min() <= block.index.max() < self.size:
                raise DimensionError(f"block '{block.function.name()}' reads variables outside 0..{self.size - 1}")

    @classmethod
    def from_expressions(
        cls,
        *,
        w: ca.SX,
        f: ca.SX,
        g: ca.SX | None = None,
        G: ca.SX | None = None,
        H: ca.SX | None = None,
        start: np.ndarray,
        lower: np.ndarray | None = None,
        upper: np.ndarray | None = None,
        g_lower: np.ndarray | None = None,
        g_upper: np.ndarray | None = None,
    ) -> Mpcc:
        """Return the MPCC given by CasADi SX expressions of w; g is an equality g = 0 unless bounds are given."""
        g, G, H = (ca.SX(0, 1) if part is None else ca.vec(part) for part in (g, G, H))
        if G.shape != H.shape:
            raise DimensionError(f"G has shape {G.shape}, H has shape {H.shape}: they form pairs")
        n, n_g = w.numel(), g.numel()

        def filled(value: np.ndarray | None, default: float, size: int) -> np.ndarray:
            return np.full(size, default) if value is None else np.asarray(value, dtype=float).reshape(size)

        block = Block(
            copy_names=["problem"],
            function=ca.Function("problem", [w, ca.SX(0, 1)], [f, g, G, H]),
            index=np.arange(n).reshape(n, 1),
            parameters=np.zeros((0, 1)),
            lower=filled(g_lower, 0.0, n_g),
            upper=filled(g_upper, 0.0, n_g),
            constraint_names=[f"g[{i}]" for i in range(n_g)],
            pair_names=[f"pair {i}" for i in range(G.numel())],
        )
        return cls(
            lower=filled(lower, -np.inf, n),
            upper=filled(upper, np.inf, n),
            start=filled(start, 0.0, n),
            blocks=[block],
            names=[f"w[{i}]" for i in range(n)],
        )

    @property
    def size(self) -> int:
        """Number of variables n."""
        return len(self.start)

    @property
    def constraints(self) -> int:
        """Number of rows of g."""
        return sum(len(block.lower) * block.copies for block in self.blocks)

    @property
    def pairs(self) -> int:
        """Number of complementarity pairs."""
        return sum(len(block.pair_names) * block.copies for block in self.blocks)

    def residuals(self, w: np.ndarray) -> Residuals:
        """Recompute cost, feasibility and complementarity at w without any solver; NaN counts as infinitely wrong."""
        objective, product, natural, worst_pair = 0.0, 0.0, 0.0, "none"
        bounds = np.where(np.isnan(w), np.inf, np.maximum(self.lower - w, w - self.upper))
        at = int(np.argmax(bounds)) if self.size else 0
        violation = max(0.0, float(bounds[at])) if self.size else 0.0
        worst = "none" if violation == 0.0 else f"bound of {self.names[at] if self.names else f'w[{at}]'}"
        for block in self.blocks:
            f, g, G, H = block.evaluate(w)
            objective += float(f.sum())
            rows = (
                (np.maximum(block.lower[:, None] - g, g - block.upper[:, None]), block.constraint_names),
                (np.where(block.sign_free[:, None], -np.inf, -G), block.pair_names),
                (-H, block.pair_names),
            )
            for excess, labels in rows:
                excess = np.where(np.isnan(excess), np.inf, excess)
                if excess.size and excess.max() > violation:
                    row, copy = np.unravel_index(int(np.argmax(excess)), excess.shape)
                    violation = float(excess.max())
                    worst = f"{labels[int(row)]} in {block.copy_names[int(copy)]}"
            if G.size:
                smaller, products = np.minimum(G, H), np.maximum(G, 0.0) * H
                smaller, products = (np.where(np.isnan(part), np.inf, part) for part in (smaller, products))
                natural = max(natural, float(smaller.max()))
                if products.max() > product:
                    row, copy = np.unravel_index(int(np.argmax(products)), products.shape)
                    product = float(products.max())
                    worst_pair = f"{block.pair_names[int(row)]} in {block.copy_names[int(copy)]}"
        return Residuals(objective, violation, product, natural, worst, worst_pair)
