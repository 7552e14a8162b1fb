"""Compiled functions give the numbers of CasADi's own evaluation, and are compiled once."""

from __future__ import annotations

import logging
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from fesd_robot.mpcc import HomotopyOptions, Mpcc, solve
from fesd_robot.mpcc.assembly import assemble
from fesd_robot.mpcc.relaxations import scholtes
from fesd_robot.native import CompilationError, compile_functions
from fesd_robot.native.compiler import shared_library


@pytest.fixture
def empty_cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    monkeypatch.setenv("FESD_ROBOT_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def _functions() -> list[ca.Function]:
    x = ca.SX.sym("x", 3)
    f = ca.Function("f", [x], [ca.sin(x[0]) * x[1] ** 3 / (1 + x[2] ** 2), ca.jacobian(ca.sumsqr(x) * x, x)])
    many, y = f.map(5), ca.MX.sym("y", 3, 5)
    return [f, ca.Function("g", [y], many.call([y]))]


def test_compiled_equals_interpreted(empty_cache: Path) -> None:
    """To the last bit, for a function and its map."""
    generator = np.random.default_rng(0)
    for own, compiled in zip(_functions(), compile_functions("test", _functions()), strict=True):
        arguments = [generator.normal(size=own.size_in(i)) for i in range(own.n_in())]
        for expected, found in zip(own.call(arguments), compiled.call(arguments), strict=True):
            assert found.nonzeros() == expected.nonzeros()


def test_the_cache_is_used_and_whole(empty_cache: Path) -> None:
    """The second time nothing is compiled, another function has another library, and nothing half-made is left."""
    compile_functions("test", _functions())
    first = {file.name: file.stat().st_mtime_ns for file in empty_cache.iterdir()}
    compile_functions("test", _functions())
    assert {file.name: file.stat().st_mtime_ns for file in empty_cache.iterdir()} == first and len(first) == 1
    compile_functions("test", _functions()[:1])
    assert len(list(empty_cache.iterdir())) == 2


def test_errors_carry_the_words_of_the_compiler(empty_cache: Path, tmp_path: Path) -> None:
    """A source that does not compile is named, and leaves nothing behind."""
    source = tmp_path / "wrong.c"
    source.write_text("int f( {\n")
    with pytest.raises(CompilationError, match=r"could not compile wrong: "):
        shared_library("wrong", [source], [])
    assert list(empty_cache.iterdir()) == []


def _problem() -> Mpcc:
    """min (x - 1)² + (y - 2)² over 0 <= x _|_ y >= 0."""
    w = ca.SX.sym("w", 2)
    return Mpcc.from_expressions(
        w=w, f=(w[0] - 1) ** 2 + (w[1] - 2) ** 2, G=w[0], H=w[1], start=np.array([0.5, 1.0]), lower=np.zeros(2)
    )


def test_a_compiled_problem_takes_the_same_way() -> None:
    """IPOPT's iterates do not depend on whether the functions are compiled."""
    plain, compiled = (solve(_problem(), HomotopyOptions(compile=how)) for how in ("never", "always"))  # type: ignore[arg-type]
    assert compiled.solved and compiled.w.tolist() == plain.w.tolist()
    assert [r.iterations for r in compiled.reports] == [r.iterations for r in plain.reports]


def test_without_a_compiler(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    """``always`` is an error that says why; ``auto`` leaves a small problem alone without a word."""
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(CompilationError, match="no C compiler found"):
        assemble(_problem(), scholtes, "always")
    with caplog.at_level(logging.WARNING):
        assert solve(_problem(), HomotopyOptions(compile="auto")).solved
    assert not caplog.records


def test_a_large_problem_says_that_it_is_not_compiled(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """With ``auto`` a problem that is worth compiling is solved all the same, and one line of the log says why not."""
    monkeypatch.setenv("CC", "no-such-compiler")
    monkeypatch.setattr("fesd_robot.mpcc.assembly.WORTHWHILE", 1)
    with caplog.at_level(logging.WARNING):
        assert solve(_problem(), HomotopyOptions(compile="auto")).solved
    assert [r.message for r in caplog.records] == [
        "the functions of the NLP are not compiled: no C compiler found (set CC, or install one)"
    ]
