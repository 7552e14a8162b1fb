"""`python -m fesd_robot` is `fesd-robot`."""

from fesd_robot.cli.main import main

if __name__ == "__main__":
    main()
