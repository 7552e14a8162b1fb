"""Import Matplotlib without settings from the current folder, where a stranger's task may lie.

It reads a `matplotlibrc` there, and versions before 3.11 evaluate expressions in it.
"""

import os
import sys
from pathlib import Path

if "matplotlib" not in sys.modules and Path("matplotlibrc").exists():
    _here = os.getcwd()
    os.chdir(Path(__file__).parent)
    try:
        import matplotlib  # noqa: F401
    finally:
        os.chdir(_here)
