"""The section `costs` of a task: weights by name, and the words for each of its keys."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import Field

from fesd_robot.task.fields import AxisWeights, Name, NameKind, NonNegative, Section, Weights


@dataclass(frozen=True)
class CostTerm:
    """Words and units of one key of `costs` outside its expression, which is in `fesd_robot.ocp.costs`.

    Attributes:
        words: what has the weight, with ``{name}`` where every name has a term of its own.
        names: what the names of the weights are; None for one weight without a name.
        unit: of a weight, made of ``{square}``, the square of the named quantity's unit, ``{rate}``, the square of that
            unit per s, and ``{integral}``, that unit times s.
        default: whether the robot's size, mass and time give every name a weight where the task gives no map.
        prefix: of the terms of single names, whose weights are by axis; None where all names are in one term.
        quantity: unit of what is weighted, where the named thing, as a contact, has none of its own.
        goal: the part of the goal from which a distance is measured; a motion that repeats has no such term.
        duration: what `horizon.duration` has to be for the term to have a meaning.
    """

    words: str
    names: NameKind | None
    unit: str
    default: bool = False
    prefix: str | None = None
    quantity: str | None = None
    goal: Literal["configuration", "velocity"] | None = None
    duration: Literal["fixed", "free"] | None = None

    def parts(self, key: str, value: Any) -> Iterator[tuple[str, str, Mapping[str, float] | None]]:
        """Yield (name of the term in a plan, words, weights) of all terms that a value of `costs` stands for.

        Args:
            key: the key of `costs`.
            value: its value, also as plain data; None for the default.
        """
        if self.prefix is not None:
            for name, weights in value.items():
                yield f"{self.prefix} {name}", self.words.format(name=name), weights
        else:
            weights = value if value is None or isinstance(value, Mapping) else {"": value}
            yield key.replace("_", " "), self.words, weights


class Costs(Section):
    """Weights of squared deviations; in a map that is given, names not listed have the weight 0."""

    configuration: Annotated[
        Weights | None,
        CostTerm("deviation from the reference", "configuration coordinate", "/{square}/s", default=True),
    ] = Field(
        default=None,
        description="Name of a configuration coordinate -> weight of its squared deviation from the reference, per s "
        "and m2 or rad2; default: as much for every coordinate that a deviation of the robot's length or 1 rad "
        "for a second costs 10. Roll, pitch and yaw of an orientation: the turn from the reference about the body's "
        "x, y and z axis.",
    )
    velocity: Annotated[
        Weights | None,
        CostTerm("velocity", "velocity coordinate", "/{square}/s", default=True),
    ] = Field(
        default=None,
        description="Name of a velocity coordinate -> weight of its square, per s and (m/s)2 or (rad/s)2; default: as "
        "much for every coordinate that a speed of the robot's length per its own time, sqrt(length / gravity), "
        "costs 0.1 a second.",
    )
    control: Annotated[
        Weights | None,
        CostTerm("control", "control", "/{square}/s", default=True),
    ] = Field(
        default=None,
        description="Name of a control -> weight of its square, per s and N2 or (N m)2; default: as much for every "
        "control that a force of the robot's weight, or this times its length as a torque, costs 1 a second.",
    )
    control_sum: Annotated[
        Weights,
        CostTerm("sum of the controls of a set", "group of controls", "/{square}/s"),
    ] = Field(
        default_factory=dict,
        description="Name of a group of robot.one_at_a_time -> weight of the squared sum of the controls of each of "
        "its sets, per s and N2 or (N m)2; default: none.",
    )
    terminal_configuration: Annotated[
        Weights | None,
        CostTerm(
            "distance from the goal at the end",
            "configuration coordinate",
            "/{square}",
            default=True,
            goal="configuration",
        ),
    ] = Field(
        default=None,
        description="Name of a configuration coordinate -> weight of its squared distance from the goal at the end, "
        "per m2 or rad2; default: as much for every coordinate that the robot's length or 1 rad costs 100; where the "
        "goal has frames or a centre of mass, for those that it lists.",
    )
    terminal_velocity: Annotated[
        Weights | None,
        CostTerm(
            "distance from the goal velocity at the end",
            "velocity coordinate",
            "/{square}",
            default=True,
            goal="velocity",
        ),
    ] = Field(
        default=None,
        description="Name of a velocity coordinate -> weight of its squared distance from the goal at the end, per "
        "(m/s)2 or (rad/s)2; default: as much for every coordinate that the robot's length per its own time costs 1.",
    )
    control_change: Annotated[
        Weights,
        CostTerm("change of control between intervals", "control", "/{square}"),
    ] = Field(
        default_factory=dict,
        description="Name of a control -> weight of the squared change from each control interval to the next, per N2 "
        "or (N m)2; default: none.",
    )
    acceleration: Annotated[
        Weights,
        CostTerm("mean acceleration over intervals", "velocity coordinate", "/{rate}/s", duration="fixed"),
    ] = Field(
        default_factory=dict,
        description="Name of a velocity coordinate -> weight of its squared mean acceleration over each control "
        "interval, impacts included, per s and (m/s2)2 or (rad/s2)2; default: none.",
    )
    force: Annotated[
        Weights,
        CostTerm("integral of the normal force (not squared)", "contact", "/{integral}", quantity="N"),
    ] = Field(
        default_factory=dict,
        description="Name of a contact -> weight of the time integral of its normal force, the impulses of impacts "
        "included, per N s; default: none.",
    )
    slipping: Annotated[
        Weights | None,
        CostTerm("work of friction (not squared)", "contact", "/{linear}", quantity="J", default=True),
    ] = Field(
        default=None,
        description="Name of a contact -> weight of the work that its friction takes while it slips, impacts included, "
        "per J; default: as much for every contact that lifting the robot by its length would cost 10.",
    )
    center_of_mass: Annotated[
        AxisWeights,
        CostTerm("distance of the centre of mass from the reference's", "axis", "/{square}/s"),
    ] = Field(
        default_factory=dict,
        description="Weight of the squared distance of the centre of mass from its place in the reference, per s and "
        "m2; one number, or by axis x, y, z; default: none.",
    )
    frames: Annotated[
        dict[Name, AxisWeights],
        CostTerm("distance of frame {name} from the reference's", "frame", "/{square}/s", prefix="frame"),
    ] = Field(
        default_factory=dict,
        description="Name of a frame -> weight of the squared distance of its origin from its place in the reference, "
        "per s and m2; one number, or by axis x, y, z; default: none.",
    )
    time: Annotated[
        NonNegative,
        CostTerm("duration (not squared)", None, "/s", duration="free"),
    ] = Field(default=0.0, description="Weight of the duration, per s; needs a horizon.duration with lower and upper.")

    def used(self, key: str) -> bool:
        """Return whether the task gives any weight to the terms of a key."""
        return any(
            weights and any(weights.values()) for _, _, weights in COST_TERMS[key].parts(key, getattr(self, key))
        )


COST_TERMS: Mapping[str, CostTerm] = {
    key: next(mark for mark in field.metadata if isinstance(mark, CostTerm))
    for key, field in Costs.model_fields.items()
}
"""Key of `costs` -> its words."""
