"""nosnoc's settings that all problems share, and what its results say, read off the last point alone."""

from __future__ import annotations

import copy
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fesd_robot.fesd import Tableau
from scripts.benchmarks.compare.outcome import Outcome
from scripts.benchmarks.compare.samples import Samples

if TYPE_CHECKING:
    from nosnoc import NosnocModel, NosnocOcp, NosnocOpts, NosnocSolver


@dataclass(frozen=True)
class Found:
    """What nosnoc returned.

    Attributes:
        solver: it, with the problem.
        w: the last point.
        success: nosnoc's own verdict.
        status: IPOPT's word on the last NLP.
        homotopy: sigma, iterations, seconds, objective and residuals of every NLP.
        build_seconds, wall_seconds, cpu_seconds: of the construction; of all.
    """

    solver: NosnocSolver
    w: np.ndarray
    success: bool
    status: str
    homotopy: list[dict[str, Any]]
    build_seconds: float
    wall_seconds: float
    cpu_seconds: float

    def outcome(self, cost: float, further: dict[str, str] | None = None, **details: Any) -> Outcome:
        """Return the run in the words of the comparison."""
        last = self.homotopy[-1]
        problem = self.solver.problem
        return Outcome(
            verdict="solved" if self.success else "not solved",
            last_nlp=self.status.replace("_", " ").lower(),
            wall_seconds=self.wall_seconds,
            cpu_seconds=self.cpu_seconds,
            iterations=sum(step["iterations"] for step in self.homotopy),
            complementarity=last["complementarity"],
            constraint_violation=last["constraint_violation"],
            objective=last["objective"],
            cost=cost,
            variables=len(problem.lbw),
            constraints=len(problem.lbg),
            further=further or {},
            homotopy=self.homotopy,
            details={
                "stage_complementarity": last["stage_complementarity"],
                "build_seconds": self.build_seconds,
                "solve_seconds": self.wall_seconds - self.build_seconds,
                **details,
            },
        )

    def samples(self, tableau: Tableau) -> Samples:
        """Return the trajectory; in the differential form the stage states follow from the stage derivatives."""
        problem, w = self.solver.problem, self.w
        left, points, controls = np.asarray(self.solver.model.x0, dtype=float), [], []
        steps = w[np.array(problem.ind_h).ravel()]
        remaining = iter(steps)
        for k, stages in enumerate(problem.ind_x):
            for n, indices in enumerate(stages):
                h = next(remaining)
                slopes = np.array(problem.ind_v[k][n], dtype=int)
                states = left + h * tableau.A @ w[slopes] if slopes.size else w[np.array(indices)]
                points.append(np.vstack([left, states]))
                controls.append(w[np.array(problem.ind_u[k], dtype=int)])
                left = w[np.array(indices[-1])]
        return Samples(tableau, steps, np.array(points), np.array(controls))


def options() -> NosnocOpts:
    """Return nosnoc's default options in a dictionary of their own; nosnoc shares IPOPT's between all."""
    import nosnoc

    opts = nosnoc.NosnocOpts()
    opts.opts_casadi_nlp = copy.deepcopy(opts.opts_casadi_nlp)
    opts.print_level = 1
    return opts


def run(opts: NosnocOpts, model: NosnocModel, ocp: NosnocOcp, begin: tuple[float, float], states: Any = None) -> Found:
    """Build nosnoc's problem, run its homotopy, and recompute what it reached.

    Args:
        begin: `time.perf_counter` and `time.process_time` before the description of the problem.
        states: start of the states at the ends of the intervals, (intervals, n_x); as `opts` says if omitted.
    """
    from nosnoc import NosnocSolver, Status

    solver = NosnocSolver(opts, model, ocp)
    if states is not None:
        solver.set("x", states)
    build_seconds = time.perf_counter() - begin[0]
    results = solver.solve()
    wall, cpu = time.perf_counter() - begin[0], time.process_time() - begin[1]
    homotopy, sigma = [], opts.sigma_0
    for iterations, seconds, point in zip(
        results["nlp_iter"], results["cpu_time_nlp"], results["w_all"][1:], strict=False
    ):
        homotopy.append(
            {"sigma": sigma, "iterations": iterations, "seconds": seconds, **_residuals(solver, point, sigma)}
        )
        sigma = solver.homotopy_sigma_update(sigma)
    return Found(
        solver=solver,
        w=results["w_sol"],
        success=results["status"] == Status.SUCCESS,
        status=solver.solver.stats()["return_status"],
        homotopy=homotopy,
        build_seconds=build_seconds,
        wall_seconds=wall,
        cpu_seconds=cpu,
    )


def _residuals(solver: NosnocSolver, w: np.ndarray, sigma: float) -> dict[str, float]:
    problem = solver.problem
    solver.setup_p_val(sigma, 0.0)
    g = np.asarray(problem.g_fun(w, solver.p_val)).ravel()
    pairs = np.concatenate([rows for interval in problem.ind_comp for element in interval for rows in element])
    excess = np.concatenate([problem.lbg - g, g - problem.ubg, problem.lbw - w, w - problem.ubw])
    return {
        "objective": float(problem.cost_fun(w, solver.p_val)),
        "complementarity": float(g[pairs].max() + sigma),
        "stage_complementarity": float(problem.comp_res(w, solver.p_val)),
        "constraint_violation": max(0.0, float(excess.max())),
    }
