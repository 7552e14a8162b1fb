"""The compiled functions of an NLP give the numbers of CasADi's own evaluation, and are compiled once."""

from __future__ import annotations

import ctypes
import logging
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from fesd_robot import load_task
from fesd_robot.fesd import Transcription
from fesd_robot.mpcc import HomotopyOptions, Mpcc, Run, solve
from fesd_robot.mpcc.assembly import RelaxedNlp, assemble
from fesd_robot.mpcc.block_derivatives import BlockDerivatives
from fesd_robot.mpcc.blocks import _differentiated
from fesd_robot.mpcc.problem import BlockEquations
from fesd_robot.mpcc.relaxations import RELAXATIONS, scholtes
from fesd_robot.mpcc.steering import Steering
from fesd_robot.native import CompilationError
from fesd_robot.native.compiler import shared_libraries, shared_library
from fesd_robot.native.lanes import OPERATIONS
from fesd_robot.ocp import formulate

pytestmark = pytest.mark.slow

TASKS = Path(__file__).parents[2] / "tasks"


@pytest.fixture(scope="module", autouse=True)
def module_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """What this module compiles is compiled here, and once."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("FESD_ROBOT_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture
def empty_cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    monkeypatch.setenv("FESD_ROBOT_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def _problem(target: float = 2.0) -> Mpcc:
    """min (x - 1)² + (y - target)² over 0 <= x _|_ y >= 0."""
    w = ca.SX.sym("w", 2)
    return Mpcc.from_expressions(
        w=w, f=(w[0] - 1) ** 2 + (w[1] - target) ** 2, G=w[0], H=w[1], start=np.array([0.5, 1.0]), bounds=(0.0, None)
    )


def _assert_same(plain: RelaxedNlp, compiled: RelaxedNlp, x: np.ndarray) -> None:
    """All functions agree in their interfaces, sparsities and, to the last bit, values."""
    multipliers, p = np.random.default_rng(7).normal(size=len(plain.lower)), plain.parameters([0.3, 20.0])
    assert np.array_equal(p, compiled.parameters([0.3, 20.0]))
    for name, arguments in (
        ("nlp", (x, p)),
        ("gradient", (x, p)),
        ("jacobian", (x, p)),
        ("hessian", (x, p, 0.7, multipliers)),
    ):
        own, other = getattr(plain.program, name), getattr(compiled.program, name)
        assert (other.name(), other.name_in(), other.name_out()) == (own.name(), own.name_in(), own.name_out())
        for expected, actual in zip(own.call(arguments), other.call(arguments), strict=True):
            assert actual.sparsity() == expected.sparsity()
            assert np.array_equal(actual.nonzeros(), expected.nonzeros(), equal_nan=True)


def _hopper(intervals: int, goal: float = 0.3, duration: float = 1.0) -> Mpcc:
    changes = [f"horizon.intervals={intervals}", f"goal.configuration.root_x={goal}", f"horizon.duration={duration}"]
    motion = formulate(load_task(TASKS / "published_hopper_one_jump.yaml", changes))
    return Transcription(motion.ocp, motion.fesd).problem


@pytest.mark.parametrize(
    ("relaxation", "steering"), [("scholtes", "direct"), ("natural_residual", "l1"), ("kanzow_schwartz", "linf")]
)
def test_compiled_equals_interpreted_on_a_contact_task(relaxation: str, steering: Steering) -> None:
    """Values agree to the last bit, with parameters, slacks, and copies that do not fill the last vector."""
    problem = _hopper(6)
    plain, compiled = (assemble(problem, RELAXATIONS[relaxation], how, steering) for how in ("never", "always"))  # type: ignore[arg-type]
    generator = np.random.default_rng(0)
    x = np.append(problem.start, np.ones(plain.slacks.count))
    _assert_same(plain, compiled, x + 0.1 * generator.uniform(size=len(x)))


@pytest.mark.parametrize("chunk", [3, 500])
def test_every_operation(chunk: int, empty_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each operation of CasADi in each of its cases, in pieces of code of any length, gives CasADi's bits."""
    monkeypatch.setattr("fesd_robot.native.lanes.CHUNK", chunk)
    w = ca.SX.sym("w", 4)
    a, b, small = w[0], w[1], 0.5 * ca.tanh(w[2])
    unary = [ca.sin, ca.cos, ca.tan, ca.exp, ca.sinh, ca.cosh, ca.tanh, ca.asinh, ca.atan, ca.floor, ca.ceil, ca.fabs]
    rows = ca.vertcat(
        *(function(a) for function in [*unary, ca.sign, ca.erf, ca.expm1, ca.logic_not]),
        *(function(small) for function in (ca.asin, ca.acos, ca.atanh, ca.log1p)),
        *(function(1.5 + small) for function in (ca.log, ca.sqrt, ca.acosh)),
        *(function(a, b) for function in (ca.atan2, ca.hypot, ca.fmin, ca.fmax, ca.fmod, ca.remainder, ca.copysign)),
        *(ca.if_else(condition, a * b, -b) for condition in (a < b, a <= b, a == b, a != b)),
        *(ca.if_else(both(a < b, b > 0), a, b) for both in (ca.logic_and, ca.logic_or)),
        *(a + b, a - b, a / b, a**2, 2 * a, 1 / a, -a, (1.5 + small) ** b, (1.5 + small) ** 2.5, w[3] * 1e300 * 1e10),
    )  # fmt: skip
    problem = Mpcc.from_expressions(w=w, f=ca.sumsqr(w), g=rows, start=np.zeros(4))
    function = ca.Function("rows", [w], [rows])
    used = {function.instruction_id(k) for k in range(function.n_instructions())}
    assert set(OPERATIONS) - used <= {ca.OP_ASSIGN}
    plain, compiled = (assemble(problem, scholtes, how) for how in ("never", "always"))  # type: ignore[arg-type]
    for x in ([0.3, 0.8, 0.1, 1.0], [-1.7, 0.8, -2.0, 0.0], [1.5, -0.5, 3.0, -1.0], [0.6, 0.6, 0.0, 2.0]):
        _assert_same(plain, compiled, np.array(x))


def test_an_operation_without_c() -> None:
    """The error names an operation that has no C form."""
    w = ca.SX.sym("w", 1)
    problem = Mpcc.from_expressions(w=w, f=ca.erfinv(w[0]), start=np.zeros(1))
    with pytest.raises(CompilationError, match="operation 86 has no C form"):
        assemble(problem, scholtes, "always")


def test_the_cache_is_used_and_whole(empty_cache: Path) -> None:
    """The second time nothing is compiled, and no partial file is left."""
    assemble(_hopper(4), scholtes, "always")
    files = {file.name: file.stat().st_mtime_ns for file in empty_cache.iterdir()}
    assemble(_hopper(4), scholtes, "always")
    assert {file.name: file.stat().st_mtime_ns for file in empty_cache.iterdir()} == files


def test_a_block_with_another_number_is_not_compiled_again(empty_cache: Path) -> None:
    """Where blocks change their places, their functions come from the cache, and values stay those of CasADi."""
    problem = _hopper(4)
    assemble(problem, scholtes, "always")
    files = set(empty_cache.iterdir())
    other = replace(problem, blocks=[*problem.blocks[1:], problem.blocks[0]])
    plain, compiled = assemble(other, scholtes, "never"), assemble(other, scholtes, "always")
    _assert_same(plain, compiled, other.start + 0.1)
    assert set(empty_cache.iterdir()) == files


def test_compiled_derivatives_are_not_made_again(empty_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What the cache knows is called without being made, with the same values; what is damaged is made anew."""
    problem, again, third = _hopper(4), _hopper(4), _hopper(4)
    assemble(problem, scholtes, "always")
    plain, made = assemble(problem, scholtes, "never"), list[str]()

    def counted(block: BlockEquations, *others: Any, **named: Any) -> BlockDerivatives:
        made.append(block.name)
        return _differentiated(block, *others, **named)

    monkeypatch.setattr("fesd_robot.mpcc.blocks._differentiated", counted)
    known = {file: file.read_bytes() for file in empty_cache.glob("derivatives-*.npz")}
    compiled = assemble(again, scholtes, "always")
    assert known and len(made) == len({id(block.equations) for block in again.blocks}) - len(known)
    _assert_same(plain, compiled, problem.start + 0.1)
    for file in known:
        file.write_bytes(b"no derivatives")
    _assert_same(plain, assemble(third, scholtes, "always"), problem.start + 0.1)
    assert {file: file.read_bytes() for file in known} == known


def test_another_goal_compiles_nothing(empty_cache: Path) -> None:
    """Another goal is another parameter of the same functions."""
    assemble(_hopper(4), scholtes, "always")
    files = set(empty_cache.iterdir())
    assemble(_hopper(4, goal=0.4), scholtes, "always")
    assert set(empty_cache.iterdir()) == files


def test_another_horizon_compiles_nothing(empty_cache: Path) -> None:
    """More intervals, which last as long as before, need no compiler; both NLPs keep their own tables and values."""
    problems = [_hopper(4), _hopper(8, duration=2.0)]
    compiled, files = [assemble(problems[0], scholtes, "always")], set(empty_cache.iterdir())
    compiled.append(assemble(problems[1], scholtes, "always"))
    assert set(empty_cache.iterdir()) == files
    assert compiled[1].program.size > compiled[0].program.size
    for problem, one in zip(problems, compiled, strict=True):
        _assert_same(assemble(problem, scholtes, "never"), one, problem.start + 0.1)


def test_the_build_grows_no_faster_than_the_horizon() -> None:
    """Four times the intervals take at most six times the processor time, from the transcription to the functions."""

    def seconds(intervals: int) -> float:
        begin = time.process_time()
        assemble(_hopper(intervals), scholtes)
        return time.process_time() - begin

    seconds(20)
    few, many = (min(seconds(intervals) for _ in range(2)) for intervals in (40, 160))
    assert many <= 6 * few


def test_the_same_file_compiled_by_several_at_once(empty_cache: Path) -> None:
    """All threads get the same complete file, and nothing else is left."""
    source = {"one": lambda: lambda: "int one(void) { return 1; }\n"}
    with ThreadPoolExecutor(4) as pool:
        made = [job.result() for job in [pool.submit(shared_libraries, "one", source, []) for _ in range(4)]]
    assert len({file for files in made for file in files}) == 1
    assert sorted(empty_cache.iterdir()) == [made[0][0], made[0][0].with_name(f"{made[0][0].name}.sha256")]


@pytest.mark.parametrize("steering", ["direct", "l1"])
def test_nothing_is_written_beside_the_results(
    steering: Steering, empty_cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Results and working memory end where the interface says, wherever they begin; null pointers mean zeros."""
    with monkeypatch.context() as patch:
        stays = SimpleNamespace(TemporaryDirectory=lambda **_: nullcontext(tmp_path))
        patch.setattr("fesd_robot.native.nlp_compiler.tempfile", stays)
        nlp = assemble(_hopper(5), scholtes, "always", steering).program
    (file,) = tmp_path.glob("nlp-*.so")
    library = ctypes.CDLL(str(file))
    generator = np.random.default_rng(0)
    for function in (nlp.nlp, nlp.gradient, nlp.jacobian, nlp.hessian):
        inputs = [generator.uniform(0.1, 1, function.nnz_in(i)) for i in range(function.n_in())]
        for zero in (False, True):
            expected = function.call([0.0 * inputs[0] if zero else inputs[0], *inputs[1:]])
            for shift in range(4):
                guarded = [np.full(value.nnz() + 8, 7.5) for value in expected]
                work = np.full(function.sz_w() + 8, 7.5)
                arguments = (ctypes.c_void_p * 8)(*(value.ctypes.data for value in inputs))
                arguments[0] = None if zero else arguments[0]
                results = (ctypes.c_void_p * 8)(*(value.ctypes.data + 32 for value in guarded))
                memory = ctypes.c_void_p(work.ctypes.data + 8 * shift)
                assert library[function.name()](arguments, results, None, memory, 0) == 0
                for value, result in zip(expected, guarded, strict=True):
                    assert result[4:-4].tolist() == value.nonzeros()
                    assert (result[:4] == 7.5).all() and (result[-4:] == 7.5).all()
                assert (work[:shift] == 7.5).all() and (work[shift + function.sz_w() :] == 7.5).all()


def test_nobody_waits_for_a_compiler_that_does_not_have_to(empty_cache: Path) -> None:
    """A large problem is interpreted at once, with the same numbers, until its machine code is there."""
    problem = _hopper(30)
    first = assemble(problem, scholtes, "auto")
    assert first.awaited and not first.outdated
    _assert_same(assemble(problem, scholtes, "never"), first, problem.start + 0.1)
    patience = time.monotonic() + 120
    while not first.outdated and time.monotonic() < patience:
        time.sleep(0.1)
    second = assemble(problem, scholtes, "auto")
    assert not second.awaited
    _assert_same(first, second, problem.start + 0.1)


def test_a_program_that_ends_leaves_nothing_half_compiled(empty_cache: Path) -> None:
    """Compilers end with the program that began them, and what they wrote so far is gone."""
    program = (
        "import time\n"
        "from fesd_robot.native.compiler import shared_libraries, NotCompiledYet\n"
        "text = 'int f(int x) { return ' + ' + '.join(['x * x'] * 300000) + '; }'\n"
        "try:\n    shared_libraries('long', {'long': lambda: lambda: text}, ['-O3'], wait=False)\n"
        "except NotCompiledYet:\n    time.sleep(0.3)\n"
    )
    begin = time.monotonic()
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)
    assert time.monotonic() - begin < 20
    assert not [file.name for file in empty_cache.iterdir() if file.is_dir() or file.suffix == ".c"]


def test_errors_carry_the_words_of_the_compiler(empty_cache: Path, tmp_path: Path) -> None:
    """A source that does not compile is named with the first error, and leaves nothing behind."""
    source = tmp_path / "wrong.c"
    source.write_text("int f( {\n")
    with pytest.raises(CompilationError, match=r"could not compile wrong: .*error"):
        shared_library("wrong", [source], [])
    assert list(empty_cache.iterdir()) == []


def test_a_compiled_problem_takes_the_same_way() -> None:
    """IPOPT's iterates do not depend on whether the functions are compiled."""
    plain, compiled = (solve(_problem(), Run(HomotopyOptions(compile=how))) for how in ("never", "always"))  # type: ignore[arg-type]
    assert compiled.solved and compiled.w.tolist() == plain.w.tolist()
    assert [r.iterations for r in compiled.reports] == [r.iterations for r in plain.reports]


def test_without_a_compiler(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    """``always`` is an error that says why; ``auto`` does not compile a small problem and logs nothing."""
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(CompilationError, match="no C compiler found"):
        assemble(_problem(), scholtes, "always")
    with caplog.at_level(logging.WARNING):
        assert solve(_problem(), Run(HomotopyOptions(compile="auto"))).solved
    assert not caplog.records


def test_a_large_problem_says_that_it_is_not_compiled(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """With ``auto`` a problem that is worth compiling is solved all the same, and one line of the log says why not."""
    monkeypatch.setenv("CC", "no-such-compiler")
    monkeypatch.setattr("fesd_robot.mpcc.assembly.COMPILE_THRESHOLD", 1)
    with caplog.at_level(logging.WARNING):
        assert solve(_problem(), Run(HomotopyOptions(compile="auto"))).solved
    assert [r.message for r in caplog.records] == [
        "the functions of the NLP are not compiled: no C compiler found (set CC, or install one)"
    ]
