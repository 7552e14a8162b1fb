"""The rooms of the package stand on each other in one order."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import fesd_robot

SOURCES = Path(fesd_robot.__file__).parent

GROUND_FLOOR = (
    "errors", "arguments", "lazy", "orientations", "instants", "exactness", "ranges", "printable", "locks", "writing",
)  # fmt: skip
"""Modules that all others may use."""

BELOW: dict[str, set[str]] = {
    "errors": set(),
    "arguments": set(),
    "locks": set(),
    "writing": set(),
    "lazy": set(),
    "orientations": set(),
    "instants": set(),
    "exactness": set(),
    "ranges": set(),
    "printable": set(),
    "complementarity": set(),
    "running": set(),
    "native": {"running"},
    "robot": set(),
    "examples": set(),
    "task": {"examples"},
    "dcs": {"complementarity"},
    "nlp": {"native", "running"},
    "mpcc": {"complementarity", "native", "nlp", "running"},
    "fesd": {"complementarity", "dcs", "mpcc", "nlp", "running"},
    "optimal_control": {"complementarity", "dcs", "fesd", "mpcc", "running"},
    "contact": {"complementarity", "dcs", "robot"},
    "recovery": {"complementarity", "contact", "fesd", "robot"},
    "replay": {"contact", "recovery", "running"},
    "plans": {"contact", "mpcc", "recovery", "replay", "robot", "running", "task"},
    "ocp": {
        "complementarity", "contact", "fesd", "mpcc", "nlp", "plans", "recovery", "replay", "robot", "running", "task",
    },
    "explanation": {"contact", "mpcc", "ocp", "plans", "recovery", "robot", "task"},
    "render": {"contact", "native", "ocp", "plans", "recovery", "robot", "running", "task"},
    "simulation": {"contact", "dcs", "fesd", "ocp", "plans", "recovery", "replay", "task"},
    "first_task": {"ocp", "robot", "task"},
    "phases": {"complementarity", "contact", "fesd", "mpcc", "nlp", "ocp", "robot", "running"},
    "refinement": {
        "complementarity", "contact", "fesd", "mpcc", "ocp", "plans", "recovery", "replay", "running", "task",
    },
    "starts": {
        "complementarity", "contact", "dcs", "fesd", "mpcc", "nlp", "ocp", "plans", "recovery", "refinement", "replay",
        "simulation", "task",
    },
    "tracking": {"contact", "ocp", "plans", "robot"},
    "planning": {
        "complementarity", "fesd", "mpcc", "native", "nlp", "ocp", "phases", "plans", "refinement", "replay", "running",
        "starts", "task", "tracking",
    },
    "replanning": {
        "complementarity", "contact", "fesd", "mpcc", "nlp", "ocp", "planning", "plans", "recovery", "running",
        "starts", "task", "tracking",
    },
    "in_mujoco": {"contact", "ocp", "plans", "render", "replanning", "robot", "simulation", "task", "tracking"},
    "sweeps": {"examples", "ocp", "planning", "plans", "render", "robot", "running", "task"},
    "actions": {"explanation", "fesd", "ocp", "phases", "plans", "recovery", "render", "robot", "task", "tracking"},
    "cli": {
        "actions", "examples", "explanation", "first_task", "in_mujoco", "mpcc", "ocp", "planning", "plans", "render",
        "replanning", "robot", "running", "simulation", "sweeps", "task",
    },
}  # fmt: skip
"""Room, or module beside the rooms -> what it may use, besides `GROUND_FLOOR`, from below it."""

BESIDE = 0.1
"""Most part of the names that rooms take from each other which may be taken from their modules."""


def _imports(tree: ast.AST) -> Iterator[str]:
    """Yield the modules of this package that a file imports, also for types and inside functions."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("fesd_robot."):
            yield node.module
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.startswith("fesd_robot."))


def _files(room: str) -> list[Path]:
    folder = SOURCES / room
    return list(folder.rglob("*.py")) if folder.is_dir() else [folder.with_suffix(".py")]


@pytest.mark.parametrize("room", BELOW)
def test_a_room_uses_the_rooms_below_it_only(room: str) -> None:
    """No file of a room, and no module beside the rooms, imports from above or beside itself."""
    allowed = BELOW[room] | {room, *GROUND_FLOOR}
    wrong = {
        f"{file.relative_to(SOURCES)}: {module}"
        for file in _files(room)
        for module in _imports(ast.parse(file.read_text(encoding="utf-8")))
        if module.split(".")[1] not in allowed
    }
    assert sorted(wrong) == []


def test_nothing_points_upward() -> None:
    """The order of the table is one of floors: what something uses stands above it in the list."""
    order = list(BELOW)
    assert [(room, use) for room in order for use in BELOW[room] if order.index(use) >= order.index(room)] == []


def test_every_module_is_in_the_order() -> None:
    """A new room, and a new module beside the rooms, has to say what it stands on."""
    rooms = {folder.name for folder in SOURCES.iterdir() if (folder / "__init__.py").is_file()}
    modules = {file.stem for file in SOURCES.glob("*.py")} - {"__init__", "__main__"}
    assert rooms | modules == set(BELOW)


def test_rooms_are_entered_by_their_front_doors() -> None:
    """Nearly all names that rooms take from each other are taken from a package, not from a module in it."""
    through, beside = 0, set[str]()
    for file in SOURCES.rglob("*.py"):
        own = file.relative_to(SOURCES).parts[0].removesuffix(".py")
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.ImportFrom) or not (node.module or "").startswith("fesd_robot."):
                continue
            parts = (node.module or "").split(".")[1:]
            if own == "__init__" or parts[0] == own or not (SOURCES / parts[0]).is_dir():
                continue
            if (SOURCES.joinpath(*parts) / "__init__.py").is_file():
                through += len(node.names)
            else:
                beside |= {f"{file.relative_to(SOURCES)}: {node.module}.{alias.name}" for alias in node.names}
    assert len(beside) <= BESIDE * (through + len(beside)), sorted(beside)


def test_the_table_of_the_architecture_is_this_order() -> None:
    """The documentation's column of what a room uses says what is tested here."""
    text = (SOURCES.parent / "docs" / "architecture.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)(?:/|\.py)` \|[^|]*\|([^|]*)\|$", text, re.MULTILINE)
    table = {room: set(re.findall(r"\w+", uses)) for room, uses in rows}
    assert table == BELOW


IPOPTS_OWN = re.compile(
    r"\"(mu_init|mu_strategy|perturb_always_cd|constr_viol_tol|acceptable_iter|max_iter|bound_push|bound_relax_factor"
    r"|honor_original_bounds|warm_start_init_point|max_wall_time|accept_every_trial_step|hsllib)\""
)
"""Some of IPOPT's names of its options."""


def test_one_file_knows_the_options_of_ipopt() -> None:
    """Everything else says how an NLP is solved in words of its own."""
    knows = [file for file in SOURCES.rglob("*.py") if IPOPTS_OWN.search(file.read_text(encoding="utf-8"))]
    assert [str(file.relative_to(SOURCES)) for file in knows] == ["nlp/ipopt.py"]


def test_no_function_takes_what_a_run_is() -> None:
    """Deadline, stop and report go together as one value; `planner.plan` and `attempt` have what a caller may give."""
    names = {"deadline", "stop", "progress", "report", "options"}
    wrong = [
        f"{file.relative_to(SOURCES)}: {node.name}"
        for file in SOURCES.rglob("*.py")
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef)
        and len(names & {one.arg for one in [*node.args.args, *node.args.kwonlyargs]}) > 1
        and {"deadline", "stop", "progress"} & {one.arg for one in [*node.args.args, *node.args.kwonlyargs]} > {"stop"}
    ]
    assert sorted(wrong) == ["planning/planner.py: attempt", "planning/planner.py: plan"]
