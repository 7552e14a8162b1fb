"""What `import fesd_robot` offers: cheap to import, complete to look at, with an example that runs."""

from __future__ import annotations

import ast
import doctest
import importlib
import pydoc
import rlcompleter
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import fesd_robot
from fesd_robot.errors import FesdRobotError
from fesd_robot.task import Task

SOURCES = Path(fesd_robot.__file__).parent
ROOMS = (
    "explanation", "in_mujoco", "ocp", "planning", "plans", "recovery", "refinement", "render", "replanning", "replay",
    "robot", "running", "simulation", "starts", "sweeps", "task", "tracking",
)  # fmt: skip
LAZY = ("fesd_robot", *(f"fesd_robot.{room}" for room in ROOMS))
HEAVY = ("casadi", "pinocchio", "numpy", "scipy", "pydantic", "ruamel", "meshcat", "matplotlib", "typer", "rich")


def test_the_import_is_light() -> None:
    """`import fesd_robot` alone loads none of the packages that take time."""
    code = f"import sys, fesd_robot; print([name for name in {HEAVY!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("name", LAZY)
def test_all_names_can_be_looked_up(name: str) -> None:
    """`dir` lists everything in `__all__`, sorted and once, and every name can be got."""
    package = importlib.import_module(name)
    assert set(package.__all__) <= set(dir(package))
    assert dir(package) == sorted(set(dir(package)))
    for export in package.__all__:
        assert getattr(package, export) is not None
    with pytest.raises(AttributeError, match=f"module '{name}' has no attribute 'plam'"):
        package.plam  # noqa: B018


@pytest.mark.parametrize("name", LAZY)
def test_type_checkers_see_the_same_names(name: str) -> None:
    """What is imported for type checkers and what is imported on first use are the same things, those of `__all__`."""
    package = importlib.import_module(name)
    source = Path(package.__file__ or "").read_text(encoding="utf-8")
    (branch,) = (node for node in ast.parse(source).body if isinstance(node, ast.If))
    imports = [node for node in branch.body if isinstance(node, ast.ImportFrom)]
    typed = {alias.name: node.module or "" for node in imports for alias in node.names}
    assert sorted(typed) == sorted(package.__all__)
    for export, module in typed.items():
        owner = importlib.import_module(module)
        assert getattr(package, export) is getattr(owner, export)


def test_every_lazy_package_is_tested() -> None:
    """There is one way to export lazily, and the tests above know all packages that use it."""
    packages = {
        ".".join(["fesd_robot", *file.parent.relative_to(SOURCES).parts])
        for file in SOURCES.rglob("*.py")
        if "__getattr__" in file.read_text(encoding="utf-8") and file.name != "lazy.py"
    }
    assert packages == set(LAZY)


def test_tab_completion_offers_all_names() -> None:
    """After a tab, the interpreter offers what `__all__` says."""
    completer = rlcompleter.Completer({"fesd_robot": fesd_robot})
    offered = set()
    while (match := completer.complete("fesd_robot.", len(offered))) is not None:
        offered.add(match.rstrip("()"))
    assert {f"fesd_robot.{name}" for name in fesd_robot.__all__} <= offered


def test_help_shows_what_one_can_do() -> None:
    """`help(fesd_robot)` begins with the example and describes every function and class."""
    text = pydoc.plain(pydoc.render_doc(fesd_robot))
    assert text.index(">>> task = load_task(") < text.index("FUNCTIONS")
    for name in fesd_robot.__all__:
        if callable(getattr(fesd_robot, name)):
            assert f"class {name}(" in text or f"\n    {name}(" in text or f" = {name}(" in text, name


def test_every_error_can_be_caught_by_name() -> None:
    """All exceptions of the package that are not private can be reached from the top."""
    for module in ("fesd_robot.native", "fesd_robot.fesd", "fesd_robot.planning.planner"):
        importlib.import_module(module)

    def below(error: type[Exception]) -> set[type[Exception]]:
        return {error}.union(*(below(derived) for derived in error.__subclasses__()))

    errors = {error for error in below(FesdRobotError) if error.__module__.startswith("fesd_robot.")}
    assert errors == {
        value for name in fesd_robot.__all__ if isinstance(value := getattr(fesd_robot, name), type) and value in errors
    }


@pytest.mark.slow
def test_the_example_runs(
    load_short: Callable[..., Task], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The example of `help(fesd_robot)` runs as it is printed, here with a shorter motion of the same robot."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(fesd_robot, "load_task", lambda file: load_short("name=hopper_one_jump"))
    example = doctest.DocTestParser().get_doctest(fesd_robot.__doc__ or "", {}, "help(fesd_robot)", None, None)
    failed, tried = doctest.DocTestRunner().run(example, out=sys.stderr.write)
    assert failed == 0 and tried > 5, capsys.readouterr().err
    written = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*")}
    assert {"runs/jump/plan.json", "runs/jump/plan.html", "runs/jump/figures", "jump.csv"} <= written
