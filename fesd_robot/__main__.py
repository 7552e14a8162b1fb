"""`python -m fesd_robot` is `fesd-robot`."""

import os
import sys

if __name__ == "__main__":
    # Python looks for modules in the current folder first, where a stranger's task may lie.
    if sys.path and sys.path[0] in ("", os.getcwd()):
        del sys.path[0]

    from fesd_robot.cli.main import main

    main()
