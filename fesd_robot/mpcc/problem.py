"""The MPCC as a value: variables, cost, constraints, and complementarity pairs that nothing has relaxed yet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import casadi as ca
import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.complementarity import Complementarity, Label, Place
from fesd_robot.errors import DimensionError, ModelError


@dataclass(frozen=True, eq=False)
class BlockEquations:
    """One small problem as expressions: what is the same in all problems that differ in their numbers only.

    Equations are equal to themselves alone. Functions and derivatives are made once for them, so whoever describes the
    same small problem again should do so with the same equations.

    Args:
        name: of the small problem.
        variables, parameters: SX symbols w (n_w) and p (n_p) of one copy.
        cost: f(w, p), SX scalar.
        rows: g(w, p), SX (n_g).
        lower, upper: bounds of g, shape (n_g,).
        constraints: label of every row of g within its copy.
        complementarities: conditions whose factors G and H are SX scalars in w and p.
        while_relaxed: what a homotopy adds to the cost while pairs of the velocity level are relaxed, SX scalar in w, p
            and sigma; nothing where complementarity holds and sigma is zero.
        if_exploited: what it adds instead where the first relaxed NLP, or one that is lost, has a negative cost.
        sigma: the SX symbol of the relaxation in both.

    Raises:
        DimensionError: shapes that do not fit each other.
        ModelError: a condition with a complement, which a block has as a factor of G.
    """

    name: str
    variables: ca.SX
    parameters: ca.SX
    cost: ca.SX
    rows: ca.SX
    lower: np.ndarray
    upper: np.ndarray
    constraints: Sequence[Label]
    complementarities: Sequence[Complementarity] = ()
    while_relaxed: ca.SX = field(default_factory=lambda: ca.SX(0))
    if_exploited: ca.SX = field(default_factory=lambda: ca.SX(0))
    sigma: ca.SX = field(default_factory=lambda: ca.SX.sym("sigma"))

    def __post_init__(self) -> None:
        n_g = self.rows.numel()
        for what, shape in (
            ("lower", self.lower.shape),
            ("upper", self.upper.shape),
            ("constraints", (len(self.constraints),)),
        ):
            if shape != (n_g,):
                raise DimensionError(f"block '{self.name}': {what} has shape {shape}, expected {(n_g,)}")
        for condition in self.complementarities:
            if condition.complement is not None:
                raise ModelError(
                    f"block '{self.name}': '{condition.label}' has a complement, expected it as a factor of G"
                )

    @cached_property
    def function(self) -> ca.Function:
        """(w, p) -> (f, g, G, H)."""
        sides = ([getattr(condition, side) for condition in self.complementarities] for side in "GH")
        G, H = (ca.vertcat(ca.SX(0, 1), *factors) for factors in sides)
        return ca.Function(self.name, [self.variables, self.parameters], [self.cost, self.rows, G, H])

    @cached_property
    def cost_while_relaxed(self) -> ca.Function:
        """(w, p, sigma) -> what is added to the cost while pairs of the velocity level are relaxed."""
        return ca.Function("relaxed", [self.variables, self.parameters, self.sigma], [self.while_relaxed])

    @cached_property
    def vanishing(self) -> np.ndarray:
        """Which conditions are vanishing constraints, (n_pairs,)."""
        return np.array([condition.vanishing for condition in self.complementarities], dtype=bool)

    @cached_property
    def velocity_level(self) -> np.ndarray:
        """Which conditions are of the velocity level, (n_pairs,)."""
        return np.array([condition.level == "velocity" for condition in self.complementarities], dtype=bool)

    @cached_property
    def row_pattern(self) -> np.ndarray:
        """Which rows contain which variables, (n_g, n_w) of bool."""
        return np.asarray(ca.DM(ca.jacobian_sparsity(self.rows, self.variables), 1).full()) > 0

    @property
    def pairs(self) -> int:
        """Number of complementarity conditions of one copy."""
        return len(self.complementarities)


@dataclass(frozen=True, eq=False)
class Block:
    """K copies of one small problem, each with its own choice of the variables and its own parameters.

    Args:
        equations: of one copy.
        places: where each copy is, length K.
        index: global index of each local variable, integers of shape (n_w, K); no repetition within a column.
        values: values of the parameters, shape (n_p, K).

    Raises:
        DimensionError: shapes that do not fit each other.
    """

    equations: BlockEquations
    places: Sequence[Place]
    index: np.ndarray
    values: np.ndarray

    def __post_init__(self) -> None:
        copies = self.index.shape[1]
        for what, shape, expected in (
            ("index", self.index.shape, (self.equations.variables.numel(), copies)),
            ("places", (len(self.places),), (copies,)),
            ("values", self.values.shape, (self.equations.parameters.numel(), copies)),
        ):
            if shape != expected:
                raise DimensionError(f"block '{self.name}': {what} has shape {shape}, expected {expected}")

    @property
    def name(self) -> str:
        """Of the small problem."""
        return self.equations.name

    @property
    def lower(self) -> np.ndarray:
        """Lower bounds of the rows of a copy, (n_g,)."""
        return self.equations.lower

    @property
    def upper(self) -> np.ndarray:
        """Upper bounds of the rows of a copy, (n_g,)."""
        return self.equations.upper

    @property
    def constraints(self) -> Sequence[Label]:
        """Label of every row of a copy, (n_g,)."""
        return self.equations.constraints

    @property
    def complementarities(self) -> Sequence[Complementarity]:
        """Conditions of a copy, (n_pairs)."""
        return self.equations.complementarities

    @property
    def vanishing(self) -> np.ndarray:
        """Which conditions are vanishing constraints, (n_pairs,)."""
        return self.equations.vanishing

    @property
    def velocity_level(self) -> np.ndarray:
        """Which conditions are of the velocity level, (n_pairs,)."""
        return self.equations.velocity_level

    @property
    def pairs(self) -> int:
        """Number of complementarity conditions of one copy."""
        return self.equations.pairs

    @property
    def copies(self) -> int:
        """Number of copies K."""
        return self.index.shape[1]

    def constraint_label(self, row: int, copy: int) -> Label:
        """Return the label of a row of g in a copy."""
        return self.constraints[row].at(self.places[copy])

    def pair_label(self, row: int, copy: int) -> Label:
        """Return the label of a complementarity condition in a copy."""
        return self.complementarities[row].label.at(self.places[copy])

    def evaluate(self, w: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return (f, g, G, H) with shapes (1, K), (n_g, K), (n_pairs, K), (n_pairs, K) at the global point w."""
        outputs = self.equations.function.map(self.copies)(w[self.index], self.values)
        return tuple(np.asarray(ca.DM(out)).reshape(out.shape) for out in outputs)


Bounds = tuple[np.ndarray | float | None, np.ndarray | float | None]
"""Lower and upper bounds."""


@dataclass(frozen=True)
class Residuals:
    """How well a point satisfies an MPCC, recomputed from the point alone.

    Attributes:
        objective: f(w).
        constraint_violation: largest violation of a bound on w or g, or of G, H >= 0.
        complementarity: largest product G H over all pairs.
        natural_residual: largest min(G, H) over all pairs.
        worst_constraint, worst_pair: where these maxima sit; None if everything holds exactly.
    """

    objective: float
    constraint_violation: float
    complementarity: float
    natural_residual: float
    worst_constraint: Label | None
    worst_pair: Label | None


@partial(checked, exact=True)
@dataclass(frozen=True, eq=False)
class Mpcc:
    """min f(w) s.t. lower <= w <= upper, g_lower <= g(w) <= g_upper, 0 <= G(w) complementary to H(w) >= 0.

    The problem is a sum of blocks: f is the sum of the blocks' costs, g, G, H are stacked.

    Args:
        lower, upper, start: bounds and initial point of the variables, shape (n,).
        blocks: the pieces of the problem.
        variables: what every variable is, for messages, (n); ``w[0]``, ``w[1]``, ... if omitted.

    Raises:
        DimensionError: bounds or start of different length, or a block that points outside.
    """

    lower: np.ndarray
    upper: np.ndarray
    start: np.ndarray
    blocks: Sequence[Block]
    variables: Sequence[Label] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        shapes = {self.lower.shape, self.upper.shape, self.start.shape}
        if len(shapes) != 1:
            raise DimensionError(f"lower, upper and start must have one shape, found {sorted(shapes)}")
        if self.variables and len(self.variables) != self.size:
            raise DimensionError(f"variables has shape ({len(self.variables)},), expected ({self.size},)")
        for block in self.blocks:
            if block.index.size and not 0 <= block.index.min() <= block.index.max() < self.size:
                raise DimensionError(f"block '{block.name}' reads variables outside 0..{self.size - 1}")

    @classmethod
    def from_expressions(
        cls,
        w: ca.SX,
        f: ca.SX,
        *,
        start: np.ndarray,
        g: ca.SX | None = None,
        G: ca.SX | None = None,
        H: ca.SX | None = None,
        bounds: Bounds = (None, None),
        g_bounds: Bounds = (0.0, 0.0),
    ) -> Mpcc:
        """Return the MPCC given by CasADi SX expressions of w.

        Args:
            w: variables, SX symbols (n).
            f: cost, SX scalar.
            start: initial point, (n).
            g: constraints, SX (n_g); none if omitted.
            G, H: the two sides of the pairs, SX (n_pairs) each; none if omitted.
            bounds: lower and upper bounds of w, (n) or one number each; None is unbounded.
            g_bounds: of g; an equality g = 0 if omitted.

        Raises:
            DimensionError: G and H of different shape.
        """
        g, G, H = (ca.SX(0, 1) if part is None else ca.vec(part) for part in (g, G, H))
        if G.shape != H.shape:
            raise DimensionError(f"G has shape {G.shape}, H has shape {H.shape}: they form pairs")
        n, n_g = w.numel(), g.numel()

        def filled(value: np.ndarray | float | None, default: float, size: int) -> np.ndarray:
            array = np.asarray(default if value is None else value, dtype=float)
            return np.full(size, array) if array.ndim == 0 else array.reshape(size)

        equations = BlockEquations(
            name="problem",
            variables=w,
            parameters=ca.SX(0, 1),
            cost=f,
            rows=g,
            lower=filled(g_bounds[0], -np.inf, n_g),
            upper=filled(g_bounds[1], np.inf, n_g),
            constraints=[Label(f"g[{i}]") for i in range(n_g)],
            complementarities=[Complementarity(Label(f"pair {i}"), G[i], H[i]) for i in range(G.numel())],
        )
        block = Block(equations, [Place()], np.arange(n).reshape(n, 1), np.zeros((0, 1)))
        return cls(
            lower=filled(bounds[0], -np.inf, n),
            upper=filled(bounds[1], np.inf, n),
            start=filled(start, 0.0, n),
            blocks=[block],
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
        return sum(block.pairs * block.copies for block in self.blocks)

    @property
    def values(self) -> np.ndarray:
        """Parameters of all copies, block by block and copy by copy."""
        return np.concatenate([np.zeros(0), *(block.values.ravel(order="F") for block in self.blocks)])

    def variable_label(self, i: int) -> Label:
        """Return what a variable is."""
        return self.variables[i] if self.variables else Label(f"w[{i}]")

    def bound_label(self, i: int) -> Label:
        """Return the label of the bounds of a variable."""
        label = self.variable_label(i)
        return replace(label, kind=f"bound of {label.kind}")

    @cached_property
    def pair_labels(self) -> tuple[Label, ...]:
        """Label of every pair, block by block and copy by copy."""
        return tuple(b.pair_label(row, copy) for b in self.blocks for copy in range(b.copies) for row in range(b.pairs))

    def residuals(self, w: np.ndarray) -> Residuals:
        """Recompute cost, feasibility and complementarity at w without any solver; NaN counts as infinitely wrong."""
        objective, product, natural, worst_pair = 0.0, 0.0, 0.0, None
        bounds = np.where(np.isnan(w), np.inf, np.maximum(self.lower - w, w - self.upper))
        at = int(np.argmax(bounds)) if self.size else 0
        violation = max(0.0, float(bounds[at])) if self.size else 0.0
        worst = self.bound_label(at) if violation > 0.0 else None
        for block in self.blocks:
            f, g, G, H = block.evaluate(w)
            objective += float(f.sum())
            for excess, label in (
                (np.maximum(block.lower[:, None] - g, g - block.upper[:, None]), block.constraint_label),
                (np.where(block.vanishing[:, None], -np.inf, -G), block.pair_label),
                (-H, block.pair_label),
            ):
                largest, row, copy = _largest(excess)
                if largest > violation:
                    violation, worst = largest, label(row, copy)
            if G.size:
                smaller = np.minimum(G, H)
                natural = max(natural, _largest(smaller)[0])
                largest, row, copy = _largest(np.maximum(G, 0.0) * H)
                if largest > product:
                    product, worst_pair = largest, block.pair_label(row, copy)
        return Residuals(objective, violation, product, natural, worst, worst_pair)


def _largest(values: np.ndarray) -> tuple[float, int, int]:
    """Return the largest entry, NaN as infinity, with its row and column; minus infinity if there is none."""
    if not values.size:
        return -np.inf, 0, 0
    values = np.where(np.isnan(values), np.inf, values)
    row, column = np.unravel_index(int(np.argmax(values)), values.shape)
    return float(values[row, column]), int(row), int(column)
