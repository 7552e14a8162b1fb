"""Solo12 with all of its joints on its four feet: how the tasks of tests in space begin."""

from __future__ import annotations

LEGS = ("FL", "FR", "HL", "HR")


def standing(name: str, horizon: str) -> str:
    """Return a task without a goal: the robot stands with bent knees, and no foot may slip.

    Args:
        name: of the task.
        horizon: its section, as `{duration: 0.5, intervals: 6}`.
    """
    feet = "".join(f"  {leg}: {{frame: {leg}_FOOT, slipping: forbidden}}\n" for leg in LEGS)
    knees = ", ".join(f"{leg}_HFE: 0.7, {leg}_KFE: -1.4" for leg in LEGS)
    return (
        f"name: {name}\n"
        "robot: {model: example-robot-data:solo12, root: free_flyer}\n"
        "ground: {type: plane, friction: 0.7}\n"
        f"contacts:\n{feet}"
        f"horizon: {horizon}\n"
        f"initial:\n  configuration: {{{knees}}}\n  stand_on: [FL, FR, HL, HR]\n"
    )
