"""Where the configuration of a start, goal or waypoint comes from: own values, a posture, contacts that touch."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, TypeVar

from pydantic import Discriminator, Field, Tag

from fesd_robot.task.fields import Name, NameKind, Names, Section, Values


class StandOn(Section):
    """Contacts that touch, and the coordinates that are adjusted so that they do."""

    contacts: Names = Field(description="Names of the contacts that touch.")
    adjust: Names | None = Field(
        default=None,
        description="Names of the configuration coordinates that are found so that the contacts touch; default: "
        "root_z, and root_pitch too for more than one contact, of the robot or of the body to which they belong.",
    )
    prefer: Values = Field(
        default_factory=dict,
        description="Name of a configuration coordinate -> value that it should have, m or rad. These are adjusted, "
        "too: of all configurations in which the contacts touch, the one with the least sum of squared distances from "
        "these values is taken. Default: none, the one that the search leads to.",
    )


def _form(value: Any) -> str:
    return "mapping" if isinstance(value, dict | StandOn) else "list"


AnyConfigured = TypeVar("AnyConfigured", bound="Configured")


class Configured(Section):
    """A section with a configuration; a posture and contacts that touch may give a part of it."""

    posture: Name | None = Field(
        default=None,
        description="Name of one of the postures, of a keyframe of a MuJoCo file (qpos0: the pose that it is "
        "written in), or of a state of the URDF file's SRDF; values in 'configuration' come before the posture's. "
        "Default: none.",
    )
    configuration: Values = Field(default_factory=dict, description="Name of a configuration coordinate -> its value.")
    stand_on: (
        Annotated[Annotated[Names, Tag("list")] | Annotated[StandOn, Tag("mapping")], Discriminator(_form)] | None
    ) = Field(
        default=None,
        description="Contacts that touch: their names, or 'contacts' with the coordinates to 'adjust', which are found "
        "and become part of the configuration; values given for these are where the search starts, and 'prefer' says "
        "which are wanted. At a goal at rest they touch all through the last control interval. Default: none.",
    )

    @property
    def complete(self) -> bool:
        """Whether `configuration` alone says everything."""
        return self.posture is None and self.stand_on is None

    @property
    def standing(self) -> StandOn | None:
        """The contacts that touch, whichever way they are written."""
        return StandOn(contacts=self.stand_on) if isinstance(self.stand_on, list) else self.stand_on

    def standing_names(self) -> Iterator[tuple[tuple[str, ...], NameKind, str]]:
        """Yield (key path below this section, kind, name) of every name in `stand_on`."""
        if (standing := self.standing) is None:
            return
        at: tuple[str, ...] = ("stand_on",) if isinstance(self.stand_on, list) else ("stand_on", "contacts")
        for i, name in enumerate(standing.contacts):
            yield (*at, str(i)), "contact", name
        for i, name in enumerate(standing.adjust or ()):
            yield ("stand_on", "adjust", str(i)), "configuration coordinate", name
        for name in standing.prefer:
            yield ("stand_on", "prefer", name), "configuration coordinate", name

    def completed(self: AnyConfigured, configuration: Mapping[str, float]) -> AnyConfigured:
        """Return this section with its whole configuration, name -> m or rad.

        Raises:
            ValidationError: the configuration contradicts another key of the section.
        """
        alone = self.model_copy(update={"posture": None, "stand_on": None, "configuration": dict(configuration)})
        type(self).model_validate(alone.model_dump())
        return self.model_copy(update={"configuration": dict(configuration)})
