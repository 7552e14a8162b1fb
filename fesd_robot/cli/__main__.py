"""`python -m fesd_robot.cli` is `fesd-robot`."""

from __future__ import annotations

from fesd_robot.cli.main import main

main()
