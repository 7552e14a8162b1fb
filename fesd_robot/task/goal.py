"""Where the motion should lead, and through which points on its way."""

from __future__ import annotations

from pydantic import Field, model_validator

from fesd_robot.orientations import lists
from fesd_robot.task.fields import Name, NonNegative, Point, Section, Values, conflict
from fesd_robot.task.standing import Configured

DEFAULT_TOLERANCE = 0.01
"""Of every value of a hard goal; m, rad, m/s or rad/s."""


class Tolerance(Section):
    """How closely coordinates must be met."""

    configuration: dict[Name, NonNegative] = Field(
        default_factory=dict,
        description="Name of a configuration coordinate -> largest distance from its goal, m or rad, a hard "
        "constraint; roll, pitch and yaw: of the turn from the goal, about the x, y and z axis of the body.",
    )
    velocity: dict[Name, NonNegative] = Field(
        default_factory=dict,
        description="Name of a velocity coordinate -> largest distance from its goal, m/s or rad/s, a hard constraint.",
    )


class PointTarget(Section):
    """Where a point of the robot should be, and how fast it should move there, in world axes."""

    position: Point | None = Field(
        default=None, description="Wanted position [x, y, z], m; null for an axis that does not matter."
    )
    velocity: Point | None = Field(
        default=None, description="Wanted velocity [x, y, z], m/s; null for an axis that does not matter."
    )
    tolerance: NonNegative | None = Field(
        default=None,
        description="Largest distance from the position along every given axis, m, a hard constraint; default: 0.01 "
        "in a goal that is neither soft nor periodic, else none, only the weight.",
    )
    velocity_tolerance: NonNegative | None = Field(
        default=None,
        description="Largest difference from the velocity along every given axis, m/s, a hard constraint; default: "
        "0.01 in a goal that is neither soft nor periodic, else none, only the weight.",
    )
    weight: NonNegative = Field(default=100.0, description="Weight of the squared distance from the position, per m2.")
    velocity_weight: NonNegative = Field(
        default=10.0, description="Weight of the squared difference from the velocity, per (m/s)2."
    )

    @model_validator(mode="after")
    def _complete(self) -> PointTarget:
        if self.position is None and self.velocity is None:
            raise conflict((), "found neither a position nor a velocity, expected at least one of them")
        if self.position is None and self.tolerance is not None:
            raise conflict(("tolerance",), "found a tolerance without a position, expected both or neither")
        if self.velocity is None and self.velocity_tolerance is not None:
            raise conflict(("velocity_tolerance",), "found a tolerance without a velocity, expected both or neither")
        return self


_MINUS = "-"


class Periodic(Section):
    """A motion that repeats: it ends in the state it began in, perhaps mirrored, shifted by one stride.

    With a mirror it is half of a cycle: a coordinate l that is paired with r has

        q_l(T) = sign q_r(0),   v_l(T) = sign v_r(0)   and   q_r(T) = sign q_l(0),   v_r(T) = sign v_l(0)

    so that the motion followed by its mirror image repeats. The initial state is free within the limits, except for
    the coordinates of the stride, which begin where `initial` says; all other values of `initial` are the solver's
    start.
    """

    stride: Values = Field(
        default_factory=dict,
        description="Name of a configuration coordinate -> its change over the whole motion, m or rad; coordinates "
        "not listed, and all velocities, end as they began, or as those that they are mirrored with.",
    )
    mirror: dict[Name, Name] = Field(
        default_factory=dict,
        description="Name of a configuration coordinate -> the one that it changes places with: each ends as the other "
        "began, in position and velocity. With '-' before the name it ends as the negative, which a coordinate may "
        "also do of itself. Every coordinate at most once; default: none, a whole cycle.",
    )

    @model_validator(mode="after")
    def _pairs(self) -> Periodic:
        seen: set[str] = set()
        for name, partner in self.mirror.items():
            other, at = partner.removeprefix(_MINUS), ("mirror", name)
            if not other:
                raise conflict(at, f"found '{partner}', expected the name of a coordinate behind the '-'")
            if partner == name:
                raise conflict(
                    at, f"found '{name}' mirrored with itself, expected another coordinate, or '-{name}' for the one "
                    "that changes its sign"
                )  # fmt: skip
            for one in dict.fromkeys((name, other)):
                if one in seen:
                    raise conflict(at, f"found '{one}' twice, expected every coordinate once: pairs change places")
                if one in self.stride:
                    raise conflict(
                        at, f"found '{one}', which has a stride, expected a stride of coordinates that are not mirrored"
                    )
            seen |= {name, other}
        return self

    def source(self, name: str) -> tuple[str, float]:
        """Return the coordinate whose beginning the end of a coordinate is, and the sign: q(T) = sign q_source(0).

        Args:
            name: of a configuration or velocity coordinate.
        """
        for first, partner in self.mirror.items():
            second = partner.removeprefix(_MINUS)
            if name in (first, second):
                return second if name == first else first, -1.0 if partner.startswith(_MINUS) else 1.0
        return name, 1.0

    @property
    def mirrored(self) -> list[str]:
        """Names of all coordinates that are mirrored, the two of a pair beside each other."""
        pairs = [(name, partner.removeprefix(_MINUS)) for name, partner in self.mirror.items()]
        return list(dict.fromkeys(name for pair in pairs for name in pair))


class Goal(Configured):
    """The state wanted at the end."""

    configuration: Values = Field(
        default_factory=dict,
        description="Name of a configuration coordinate -> wanted final value, m or rad; names not listed: their "
        "initial value, soft, or none if there is a goal for a frame or the centre of mass. An "
        "orientation by some of roll, pitch and yaw, rad, or by its whole quaternion: it is one goal.",
    )
    velocity: Values = Field(
        default_factory=dict,
        description="Name of a velocity coordinate -> wanted final value, m/s or rad/s; names not listed: 0, "
        "soft where another velocity is listed. Without any, a goal with positions is at rest.",
    )
    soft: bool = Field(
        default=False,
        description="Whether the goal is soft: weights in the cost, and no tolerances but those given. Default: it is "
        "hard, and a motion that misses it is not solved.",
    )
    tolerance: Tolerance = Field(
        default_factory=Tolerance,
        description="How closely the goal must be met, a hard constraint; default: 0.01 m, rad, m/s or rad/s for every "
        "coordinate that the goal lists, and for all velocities where it is at rest; in a soft goal none.",
    )
    frames: dict[Name, PointTarget] = Field(
        default_factory=dict, description="Name of a frame -> where its origin should be at the end."
    )
    center_of_mass: PointTarget | None = Field(
        default=None, description="Where the centre of mass should be at the end; default: anywhere."
    )
    periodic: Periodic | None = Field(
        default=None, description="Repeat: the end is the beginning shifted by one stride; default: it is not."
    )

    @model_validator(mode="after")
    def _either(self) -> Goal:
        if self.periodic is not None:
            for key in ("posture", "configuration", "stand_on", "velocity"):
                if getattr(self, key):
                    raise conflict((key,), f"found a goal {key} beside 'periodic', expected one of the two")
            if self.tolerance.configuration or self.tolerance.velocity:
                raise conflict(("tolerance",), "found tolerances beside 'periodic', which always holds exactly")
            if self.soft:
                raise conflict(
                    ("soft",), "found true beside 'periodic', which always holds exactly, expected one of them"
                )
        for name in self.tolerance.configuration if self.has_points and self.periodic is None else ():
            if not lists(self.configuration, name) and self.complete:
                raise conflict(
                    ("tolerance", "configuration", name),
                    f"found a tolerance of '{name}', which this goal gives no configuration beside its frames or "
                    "centre of mass; expected both or neither",
                )
        return self

    @property
    def has_points(self) -> bool:
        """Whether a frame or the centre of mass has a goal."""
        return bool(self.points)

    @property
    def targets(self) -> dict[str | None, PointTarget]:
        """Name of a frame -> its target, and None -> that of the centre of mass."""
        targets: dict[str | None, PointTarget] = dict(self.frames.items())
        if self.center_of_mass is not None:
            targets[None] = self.center_of_mass
        return targets

    @property
    def points(self) -> list[PointTarget]:
        """The targets of frames and of the centre of mass."""
        return list(self.targets.values())

    @property
    def rests(self) -> bool:
        """Whether the motion should end at rest: the goal lists positions and no velocity."""
        listed = self.configuration or any(point.position is not None for point in self.points)
        return bool(listed) and not self.velocity and all(point.velocity is None for point in self.points)

    @property
    def rests_on(self) -> list[str]:
        """Contacts on which the robot stands when it is at rest, in a hard goal with both."""
        return list(self.standing.contacts) if self.standing and self.rests and not self.soft else []


class Waypoint(Configured):
    """A state that the motion should pass at one time."""

    time: NonNegative | None = Field(
        default=None,
        description="When, s, the end of a control interval; default for all: evenly spread over the motion.",
    )
    configuration: Values = Field(
        default_factory=dict,
        description="Name of a configuration coordinate -> wanted value, m or rad; names not listed are free.",
    )
    velocity: Values = Field(
        default_factory=dict,
        description="Name of a velocity coordinate -> wanted value, m/s or rad/s; names not listed are free.",
    )
    frames: dict[Name, PointTarget] = Field(
        default_factory=dict, description="Name of a frame -> where its origin should be."
    )
    center_of_mass: PointTarget | None = Field(
        default=None, description="Where the centre of mass should be; default: anywhere."
    )
    tolerance: Tolerance = Field(
        default_factory=Tolerance,
        description="Which of the listed coordinates are hard constraints, and how closely; default: none is.",
    )
    weight: NonNegative = Field(
        default=100.0, description="Weight of the squared distance of every listed coordinate, per m2 or rad2."
    )
    velocity_weight: NonNegative = Field(
        default=10.0, description="Weight of the squared difference of every listed velocity, per (m/s)2 or (rad/s)2."
    )

    @model_validator(mode="after")
    def _complete(self) -> Waypoint:
        if self.complete and not (self.configuration or self.velocity or self.frames or self.center_of_mass):
            raise conflict(
                (),
                "found a waypoint without a target, expected posture, configuration, stand_on, velocity, frames or "
                "center_of_mass",
            )
        for key in ("configuration", "velocity"):
            for name in getattr(self.tolerance, key):
                if not lists(getattr(self, key), name) and (self.complete or key == "velocity"):
                    raise conflict(
                        ("tolerance", key, name), f"found a tolerance of '{name}', which this waypoint gives no {key}"
                    )
        return self
