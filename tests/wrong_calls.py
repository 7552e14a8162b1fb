"""Public functions with arguments that fit, and values that fit hardly anywhere."""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from ruamel.yaml import YAML

import fesd_robot
from fesd_robot import dcs, fesd, mpcc, optimal_control
from fesd_robot.mpcc.relaxations import relaxation_named
from fesd_robot.plans import read_plan
from fesd_robot.simulation import simulate_robot
from fesd_robot.task import load_task

ROOT = Path(__file__).parents[1]
PLANNED = ROOT / "tests" / "render" / "plans" / "hopper_one_jump.json"

WRONG: Mapping[str, Any] = {
    "None": None,
    "text": "nonsense",
    "empty text": "",
    "text with a zero byte": "a\0b",
    "number": 3,
    "negative": -1,
    "zero": 0,
    "fraction": 0.5,
    "NaN": float("nan"),
    "infinity": float("inf"),
    "yes": True,
    "bytes": b"x",
    "empty list": [],
    "empty mapping": {},
    "list of None": [None],
    "list of texts": ["a", "b"],
    "mapping of texts": {"a": "b"},
    "array of wrong shape": np.zeros((2, 3)),
    "array of NaN": np.full(2, np.nan),
    "array of texts": np.array(["a", "b"]),
    "long array": np.arange(7.0),
    "missing path": Path("/nowhere/at/all.yaml"),
    "symbol": ca.SX.sym("stranger"),
    "function": lambda *_: None,
    "object": object(),
}
"""What it is -> a value."""


HASTY = (
    "horizon.duration=0.2",
    "horizon.intervals=2",
    "reference={type: line}",
    "method.grid=uniform",
    "method.compile=never",
    "solver.time_limit=0.01",
    "solver.max_iterations=1",
    "solver.loose_iterations=1",
    "solver.retries=0",
)
"""Settings with which a plan is soon given up."""


EXACT = (
    "published_hopper_one_jump",
    (
        "horizon.duration=0.2",
        "horizon.intervals=2",
        "goal.configuration.root_x=0.12",
        "reference={type: line}",
        "costs.slipping={}",
        "solver.tolerance=1e-6",
    ),
)
"""A task that is solved in a second."""


class Public(NamedTuple):
    """A public function, or a value that users make, with arguments that fit."""

    name: str
    function: Callable[..., Any]
    fitting: Mapping[str, Any]

    @property
    def parameters(self) -> list[str]:
        """Names of what it takes."""
        single = (one for one in inspect.signature(self.function).parameters.values() if one.kind < one.VAR_KEYWORD)
        return [one.name for one in single if one.kind != one.VAR_POSITIONAL]


SWEEP = {
    "task": "published_hopper_one_jump",
    "set": {key: YAML(typ="safe", pure=True).load(value) for key, _, value in (one.partition("=") for one in HASTY)},
    "vary": {"goal.configuration.root_x": [0.1]},
}
"""A sweep of one row."""


@cache
def relay() -> dcs.ComplementaritySystem:
    """x' = -sign(x) + u / 2."""
    x, u = ca.SX.sym("x"), ca.SX.sym("u")
    fields = ca.horzcat(1 + u / 2, -1 + u / 2)
    return dcs.stewart(dcs.Model(x, u), dcs.Subsystem(fields, x, np.array([[-1], [1]])))


def problem(**changes: Any) -> fesd.OptimalControlProblem:
    """One step of the relay."""
    numbers: dict[str, Any] = {"initial_lower": [1.0], "initial_upper": [1.0]}
    bounds = {"control_lower": [-1.0], "control_upper": [1.0]}
    return fesd.OptimalControlProblem(relay(), duration=0.5, intervals=1, **numbers, **bounds, **changes)


@cache
def transcription() -> fesd.Transcription:
    """Of that problem."""
    return fesd.Transcription(problem(), fesd.FesdOptions(elements=1))


def _stop(iteration: int, objective: float) -> bool:
    return True


def _symbols(n: int) -> dict[str, Any]:
    return {"variables": ca.SX.sym("w", n), "parameters": ca.SX.sym("p", 0)}


def _mpcc_file(folder: Path) -> Path:
    """Write 0 <= w complementary to w >= 0 as files of suites have it."""
    w = ca.SX.sym("w")
    same = ca.Function("same", [w], [w]).serialize()
    file = folder / "mpcc.json"
    data = {"w0": [1], "lbw": [0], "ubw": [2], "f_fun": same, "G_fun": same, "H_fun": same}
    file.write_text(json.dumps(data), encoding="utf-8")
    return file


def public(folder: Path) -> Iterator[Public]:
    """Yield everything that users call, with arguments that fit; what is written goes to a folder."""
    task = load_task("published_hopper_one_jump", HASTY)
    planned, exact, system, own = read_plan(PLANNED), fesd_robot.plan(load_task(*EXACT)), relay(), problem()
    x, q, v = ca.SX.sym("x"), ca.SX.sym("q"), ca.SX.sym("v")
    model = dcs.Model(x)
    regions = dcs.Subsystem(ca.SX([[1, -1]]), x, np.array([[-1], [1]]))
    free = dcs.stewart(model, regions)
    mechanism = dcs.Mechanism(q, v, ca.SX(1), ca.SX(-9.81))
    contact = dcs.UnilateralContact("floor", q, ca.SX(1))
    alpha = ca.SX.sym("alpha")
    mathematical = transcription().problem
    w = np.array(mathematical.start)
    small = mpcc.Mpcc.from_expressions(w=x, f=x, G=x, H=1 - x, start=np.zeros(1))
    opti = ca.Opti()
    opti.minimize(opti.variable())
    quick = mpcc.Run(mpcc.HomotopyOptions(max_iterations=1))
    quiet: dict[str, Any] = {"progress": None}
    once = fesd_robot.SweepSettings(jobs=1, resume=True)
    table: list[tuple[Any, str, dict[str, Any]]] = [
        (fesd_robot, "load_task", {"path": "hopper_one_jump", "overrides": ["horizon.intervals=3"]}),
        (fesd_robot, "explain", {"task": task}),
        (fesd_robot, "draw_task", {"task": task, "page": folder / "task.html"}),
        (fesd_robot, "plan", {"task": task, "stop": _stop}),
        (fesd_robot, "write_plan", {"plan": planned, "folder": folder / "plan", "extras": None}),
        (fesd_robot, "read_plan", {"path": PLANNED}),
        (fesd_robot, "export_plan", {"plan": planned, "file": folder / "plan.csv", "kind": "csv"}),
        (
            fesd_robot,
            "render_plan",
            {
                "plan": planned,
                "folder": folder / "d",
                "overrides": ["output.figures=false"],
                "task_folder": ROOT / "tasks",
            },
        ),
        (fesd_robot, "report", {"plan": planned, "picture": None}),
        (fesd_robot, "simulate", {"what": task}),
        (fesd_robot, "sweep", {"sweep": SWEEP, "out": folder / "sweep", "settings": once}),
        (fesd_robot, "SweepSettings", {"jobs": 1}),
        (fesd_robot, "read_sweep", {"folder": folder / "sweep"}),
        (fesd_robot, "tracking_gains", {"plan": exact}),
        (fesd_robot, "Tracker", {"plan": exact}),
        (dcs, "stewart", {"model": model, "subsystems": regions}),
        (dcs, "heaviside", {"model": model, "steps": dcs.StepFunctions(alpha, x), "right_hand_side": 1 - 2 * alpha}),
        (dcs, "heaviside_from_regions", {"model": model, "subsystems": regions}),
        (dcs, "with_contacts", {"mechanism": mechanism, "contacts": [contact]}),
        (dcs, "state_of", {"mechanism": mechanism, "contacts": [contact], "q": np.ones(1), "v": np.zeros(1)}),
        (dcs, "Model", {"state": x}),
        (dcs, "StepFunctions", {"alpha": alpha, "switching": x}),
        (dcs, "Subsystem", {"fields": ca.SX([[1, -1]]), "switching": x, "sign_matrix": np.array([[-1], [1]])}),
        (dcs, "Mechanism", {"configuration": q, "velocity": v, "mass_matrix": ca.SX(1), "force": ca.SX(0)}),
        (dcs, "UnilateralContact", {"name": "floor", "gap": q, "normal": ca.SX(1)}),
        (fesd, "simulate", {"system": free, "initial": np.ones(1), "controls": (0.0, 0.1)}),
        (fesd, "initial_value_problem", {"system": system, "initial": [1.0], "duration": 0.5, "control": [0.0]}),
        (fesd, "make_tableau", {"scheme": "radau_iia", "stages": 2}),
        (fesd, "end_sensitivity", {"transcription": transcription(), "w": w}),
        (fesd, "FesdOptions", {}),
        (fesd, "SimulationSettings", {}),
        (fesd, "OptimalControlProblem", {"system": system, "duration": 0.5}),
        (fesd, "Span", {"begin": 0.0, "end": 1.0}),
        (fesd, "ControlGrid", {"lengths": (0.5, 0.5), "phases": (2,), "moving": False}),
        (fesd, "TrajectoryConstraint", {"name": "c", "kind": "path", "variables": ca.SX.sym("y", 2)}),
        (fesd, "Transcription", {"ocp": own, "options": fesd.FesdOptions(elements=1)}),
        (mpcc, "solve", {"problem": mathematical, "run": quick}),
        (mpcc, "assemble", {"problem": mathematical, "relaxation": relaxation_named("scholtes")}),
        (mpcc, "certify", {"problem": mathematical, "w": w, "time_limit": 0.1}),
        (mpcc, "solve_by_attempts", {"problem": small, "run": quick, "attempts": mpcc.ATTEMPTS[:1]}),
        (mpcc, "Attempt", {"name": "slow"}),
        (mpcc, "read_casadi_json", {"file": _mpcc_file(folder)}),
        (mpcc, "from_opti", {"opti": opti, "pairs": [(opti.x, 1 - opti.x)]}),
        (mpcc, "HomotopyOptions", {}),
        (mpcc, "PolishingLimits", {"iterations": 3, "updates": 3}),
        (mpcc, "Run", {}),
        (mpcc, "Mpcc", {"lower": w, "upper": w, "start": w, "blocks": mathematical.blocks}),
        (
            optimal_control,
            "optimize",
            {"problem": own, "settings": optimal_control.OptimalControlSettings(starts=1, time_limit=0.1), **quiet},
        ),
        (optimal_control, "EndTime", {"shortest": 0.1, "longest": 1.0}),
        (optimal_control, "OptimalControlSettings", {}),
    ]
    for room, name, fitting in table:
        yield Public(f"{room.__name__}.{name}", getattr(room, name), fitting)
    yield Public("fesd_robot.Plan.at", exact.at, {"time": 0.1})
    yield Public("fesd_robot.simulation.simulate_robot", simulate_robot, {"what": task, "duration": 0.01})


def wrong_calls(one: Public) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield what is wrong, and the arguments, for every argument and value, without one, and with one too many."""
    for parameter in one.parameters:
        for what, value in WRONG.items():
            yield f"{parameter} is {what}", {**one.fitting, parameter: value}
        if parameter in one.fitting:
            yield f"without {parameter}", {name: given for name, given in one.fitting.items() if name != parameter}
    yield "with an unknown argument", {**one.fitting, "nonsense": 1}
