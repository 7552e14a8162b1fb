"""What the motion costs: weights by name."""

from __future__ import annotations

from pydantic import Field

from fesd_robot.task.fields import AxisWeights, Name, NonNegative, Section, Weights


class Costs(Section):
    """Weights of squared deviations; in a map that is given, names not listed weigh 0."""

    configuration: Weights | None = Field(
        default=None,
        description="Name of a configuration coordinate -> weight of its squared deviation from the reference, per s "
        "and m2 or rad2; default: 1 for every coordinate.",
    )
    velocity: Weights | None = Field(
        default=None,
        description="Name of a velocity coordinate -> weight of its square, per s and (m/s)2 or (rad/s)2; default: "
        "0.1 for every coordinate.",
    )
    control: Weights | None = Field(
        default=None,
        description="Name of a control -> weight of its square, per s and N2 or (N m)2; default: 1e-3 for every "
        "control.",
    )
    terminal_configuration: Weights | None = Field(
        default=None,
        description="Name of a configuration coordinate -> weight of its squared distance from the goal at the end, "
        "per m2 or rad2; default: 100 for every coordinate, or for every one listed in the goal if it has frames or a "
        "centre of mass.",
    )
    terminal_velocity: Weights | None = Field(
        default=None,
        description="Name of a velocity coordinate -> weight of its squared distance from the goal at the end, per "
        "(m/s)2 or (rad/s)2; default: 10 for every coordinate.",
    )
    control_change: Weights = Field(
        default_factory=dict,
        description="Name of a control -> weight of the squared change from each control interval to the next, per N2 "
        "or (N m)2; default: none.",
    )
    acceleration: Weights = Field(
        default_factory=dict,
        description="Name of a velocity coordinate -> weight of its squared mean acceleration over each control "
        "interval, impacts included, per s and (m/s2)2 or (rad/s2)2; default: none.",
    )
    force: Weights = Field(
        default_factory=dict,
        description="Name of a contact -> weight of the time integral of its normal force, the impulses of impacts "
        "included, per N s; default: none.",
    )
    center_of_mass: AxisWeights = Field(
        default_factory=dict,
        description="Weight of the squared distance of the centre of mass from its place in the reference, per s and "
        "m2; one number, or by axis x, y, z; default: none.",
    )
    frames: dict[Name, AxisWeights] = Field(
        default_factory=dict,
        description="Name of a frame -> weight of the squared distance of its origin from its place in the reference, "
        "per s and m2; one number, or by axis x, y, z; default: none.",
    )
    time: NonNegative = Field(
        default=0.0, description="Weight of the duration, per s; needs a horizon.duration with lower and upper."
    )
