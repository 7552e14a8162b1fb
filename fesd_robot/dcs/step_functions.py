"""Set-valued step functions alpha_i in step(c_i) as part of a model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca

from fesd_robot.arguments import checked
from fesd_robot.dcs.checks import as_expression, as_symbols, check_content, check_shape, check_switching
from fesd_robot.dcs.model import OMITTED, Model
from fesd_robot.errors import DimensionError, ModelError


@checked
@dataclass(frozen=True, eq=False)
class StepFunctions:
    """The step functions of a model, alpha_i = 1 where c_i > 0, 0 where c_i < 0, anything between where c_i = 0.

    Args:
        alpha: SX symbols (n_c), one a step function.
        switching: c, SX (n_c) in x, p; may depend on alpha where a condition is gated by another step.
        names: for messages and results, (n_c); step0, step1, ... if omitted.
        excluded: step index -> H of lambda_n,i instead of alpha_i; must vanish only where alpha_i does.

    Raises:
        DimensionError: an expression or list of names of the wrong shape.
        ModelError: an entry of alpha that is no symbol, an excluded H of no step.
    """

    alpha: ca.SX
    switching: ca.SX
    names: Sequence[str] = OMITTED
    excluded: Mapping[int, ca.SX] = OMITTED

    def __post_init__(self) -> None:
        alpha = as_symbols("alpha", self.alpha)
        n_c = alpha.numel()
        names = list(self.names or [f"step{i}" for i in range(n_c)])
        if len(names) != n_c:
            raise DimensionError(f"names has shape ({len(names)},), expected ({n_c},), one a step variable alpha")
        switching = as_expression("switching", self.switching)
        check_shape("switching", switching, (n_c, 1), ", one entry a step variable alpha")
        excluded = {i: as_expression(f"excluded[{i}]", value) for i, value in (self.excluded or {}).items()}
        for i, value in excluded.items():
            if not 0 <= i < n_c:
                raise ModelError(f"excluded[{i}] belongs to no step, the indices are 0 to {n_c - 1}")
            check_shape(f"excluded[{i}]", value, (1, 1))
        object.__setattr__(self, "alpha", alpha)
        object.__setattr__(self, "switching", switching)
        object.__setattr__(self, "names", names)
        object.__setattr__(self, "excluded", excluded)

    @property
    def below(self) -> ca.SX:
        """H of every lambda_n, SX (n_c): alpha, or what it excludes instead."""
        below = ca.SX(self.alpha)
        for i, value in self.excluded.items():
            below[i] = value
        return below

    def check(self, model: Model, local: Mapping[str, ca.SX]) -> None:
        """Check the expressions against the symbols of the model they are used in.

        Args:
            local: name -> symbols of the groups that belong to one point, which an excluded H may use.

        Raises:
            ModelError: an unknown symbol, a constant that is not finite, switching functions of what may jump.
        """
        check_switching("switching", self.switching, {**model.continuous, "alpha": self.alpha}, model.discontinuous)
        for i, value in self.excluded.items():
            check_content(f"excluded[{i}]", value, local)
