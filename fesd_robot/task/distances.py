"""Constraints on the distance between bodies of the robot, and from a body to an obstacle."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, WithJsonSchema, model_validator

from fesd_robot.task.fields import Name, NonNegative, Number, Offset, Positive, Section, conflict, expected
from fesd_robot.task.words import along_axes

_PAIR = "two names of bodies"


def _read_pair(value: Any) -> tuple[str, str]:
    if not isinstance(value, list | tuple) or len(value) != 2 or not all(isinstance(one, str) and one for one in value):
        raise expected(_PAIR)
    if value[0] == value[1]:
        raise expected(f"{_PAIR} that differ")
    return value[0], value[1]


Pair = Annotated[
    tuple[str, str],
    BeforeValidator(_read_pair),
    WithJsonSchema({"type": "array", "items": {"type": "string", "minLength": 1}, "minItems": 2, "maxItems": 2}),
]
"""Names of two bodies."""


def _check_edges(value: tuple[float, float, float]) -> tuple[float, float, float]:
    if not all(edge > 0 for edge in value):
        raise expected("three numbers [x, y, z] greater than 0")
    return value


Edges = Annotated[Offset, AfterValidator(_check_edges)]
"""Lengths of the edges of a box, m."""


class SphereObstacle(Section):
    """A sphere that stays where it is."""

    type: Literal["sphere"] = Field(description="Shape of the obstacle.")
    center: Offset = Field(description="Centre, m.")
    radius: Positive = Field(description="Radius, m.")

    def in_words(self) -> str:
        """Describe the kind and place of the obstacle."""
        return f"the sphere of radius {self.radius:g} m around {along_axes(self.center)} m"


class CapsuleObstacle(Section):
    """A cylinder with half a sphere at each end, that stays where it is."""

    type: Literal["capsule"] = Field(description="Shape of the obstacle.")
    ends: Annotated[list[Offset], Field(min_length=2, max_length=2)] = Field(
        description="Centres of the half spheres at both ends, m."
    )
    radius: Positive = Field(description="Radius, m.")

    @model_validator(mode="after")
    def _has_length(self) -> CapsuleObstacle:
        if self.ends[0] == self.ends[1]:
            raise conflict(("ends",), "found the same place twice, expected two ends, or type: sphere")
        return self

    def in_words(self) -> str:
        """Describe the kind and place of the obstacle."""
        first, second = map(along_axes, self.ends)
        return f"the capsule of radius {self.radius:g} m from {first} to {second} m"


class BoxObstacle(Section):
    """A box that stays where it is."""

    type: Literal["box"] = Field(description="Shape of the obstacle.")
    center: Offset = Field(description="Centre, m.")
    size: Edges = Field(description="Lengths of the edges along its x, y and z, m.")
    pitch: Number = Field(default=0.0, description="Angle by which the box is turned about the world's +y, rad.")

    def in_words(self) -> str:
        """Describe the kind and place of the obstacle."""
        turned = f", turned by {self.pitch:g} rad about y" if self.pitch else ""
        return f"the box around {along_axes(self.center)} m, size {along_axes(self.size)} m{turned}"


Obstacle = Annotated[SphereObstacle | CapsuleObstacle | BoxObstacle, Field(discriminator="type")]


class DistanceConstraint(Section, ABC):
    """A constraint on the distance between the collision shapes of a body and something else."""

    minimum: NonNegative = Field(default=0.0, description="Smallest distance between the surfaces, m.")
    shapes: Literal["exact", "enclosing"] = Field(
        default="exact",
        description="exact: the collision shapes of the model file, spheres and capsules, and boxes against spheres; "
        "enclosing: in place of any other shape the smallest capsule found around it, and in place of a capsule beside "
        "a box a row of spheres around it that are up to 5 % thicker.",
    )

    @property
    @abstractmethod
    def body_names(self) -> dict[tuple[str, ...], str]:
        """Key below the constraint -> name of the body it gives."""

    def in_words(self) -> str:
        """Return the constraint as a part of a sentence."""
        around = ", taken with what encloses their shapes" if self.shapes == "enclosing" else ""
        return f"{self.between_in_words()} stay {self.minimum:g} m apart{around}, at every stage"

    @abstractmethod
    def between_in_words(self) -> str:
        """Name the bodies that keep the distance."""


class BodyDistance(DistanceConstraint):
    """Two bodies of the robot that stay apart."""

    type: Literal["distance"] = Field(description="Two bodies of the robot stay apart.")
    bodies: Pair = Field(description="Names of the frames of two bodies, or links, with collision shapes.")

    @property
    def body_names(self) -> dict[tuple[str, ...], str]:
        """Key below the constraint -> name of the body it gives."""
        return {("bodies", str(number)): name for number, name in enumerate(self.bodies)}

    def between_in_words(self) -> str:
        """Name the bodies that keep the distance."""
        return f"bodies '{self.bodies[0]}' and '{self.bodies[1]}'"


class ObstacleDistance(DistanceConstraint):
    """A body of the robot that stays away from an obstacle."""

    type: Literal["obstacle"] = Field(description="A body of the robot stays away from an obstacle.")
    body: Name = Field(description="Name of the frame of a body, or link, with collision shapes.")
    obstacle: Obstacle = Field(description="Obstacle that it stays away from: a sphere, a capsule or a box.")

    @property
    def body_names(self) -> dict[tuple[str, ...], str]:
        """Key below the constraint -> name of the body it gives."""
        return {("body",): self.body}

    def between_in_words(self) -> str:
        """Name the bodies that keep the distance."""
        return f"body '{self.body}' and {self.obstacle.in_words()}"
