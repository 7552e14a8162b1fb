"""C and C++ that is compiled on first use: a linear solver for IPOPT and the functions of an NLP."""

from fesd_robot.native.cache import cache_folder, is_whole, put
from fesd_robot.native.compiler import CompilationError, NotCompiledYet, shared_library
from fesd_robot.native.libraries import begin_building
from fesd_robot.native.linear_solver import kkt_library
from fesd_robot.native.nlp_compiler import Formula, NlpBlock, Output, compile_nlp

__all__ = [
    "CompilationError",
    "Formula",
    "NlpBlock",
    "NotCompiledYet",
    "Output",
    "begin_building",
    "cache_folder",
    "compile_nlp",
    "is_whole",
    "kkt_library",
    "put",
    "shared_library",
]
