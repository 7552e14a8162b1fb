"""CasADi functions compiled to machine code."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

import casadi as ca

from fesd_robot.native.compiler import shared_library

FLAGS = ("-std=c99", "-O1", "-ffp-contract=off", "-fno-math-errno")
"""-O2 doubles the time to compile for nothing; without contraction the results are those of CasADi to the last bit."""


def compile_functions(name: str, functions: Sequence[ca.Function]) -> list[ca.Function]:
    """Return the functions compiled, with the same names and inputs, from the cache if they were compiled before.

    Args:
        name: begins the library's name.
        functions: without free symbols, names all different.

    Raises:
        CompilationError: no C compiler, or it failed.
    """
    with tempfile.TemporaryDirectory() as folder:
        generator = ca.CodeGenerator(f"{name}.c")
        for function in functions:
            generator.add(function)
        generator.generate(f"{folder}/")
        library = shared_library(name, [Path(folder) / f"{name}.c"], [*FLAGS, "-lm"])
    return [ca.external(function.name(), str(library)) for function in functions]
