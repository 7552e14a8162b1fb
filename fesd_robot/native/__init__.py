"""C and C++ that is compiled on first use: a linear solver for IPOPT and the functions of an NLP."""

from fesd_robot.native.compiler import CompilationError, shared_library
from fesd_robot.native.functions import compile_functions
from fesd_robot.native.linear_solver import kkt_library

__all__ = ["CompilationError", "compile_functions", "kkt_library", "shared_library"]
