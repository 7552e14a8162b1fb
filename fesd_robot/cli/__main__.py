"""`python -m fesd_robot.cli` is `fesd-robot`."""

import runpy

runpy.run_module("fesd_robot", run_name="__main__")
