"""placeholder"""

from fesd_robot.sweeps.folder import SweepFolder


def write_sweep_page(folder: SweepFolder) -> None:
    """Placeholder."""
