"""The sections `method`, `solver` and `output` of a task: discretisation, solver, optional files."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema, model_validator

from fesd_robot.ranges import MAX_STAGES
from fesd_robot.task.fields import Count, NonNegative, Positive, Section, conflict, expected, is_number

IMPULSES_RATIO = 5.0
"""Default of `Solver.velocity_level_ratio` with impulses, with which motions are found more often."""


def _read_auxiliary_force(value: Any) -> Any:
    if value == "auto" or (is_number(value) and 0 < value < math.inf):
        return value
    raise expected("'auto' or a number greater than 0 (N)")


def _read_accuracy(value: Any) -> Any:
    if value == "none" or (is_number(value) and 0 < value < math.inf):
        return value
    raise expected("'none' or a number greater than 0")


class Formulation(Section):
    """How contact becomes complementarity (time-freezing)."""

    type: Literal["multipliers", "steps"] = Field(
        default="multipliers",
        description="Which variables carry the contact logic: the Filippov multipliers of the fields themselves "
        "(multipliers), or set-valued step functions of gap and velocities as published (steps).",
    )
    baumgarte_gain: NonNegative = Field(
        default=30.0,
        description="Baumgarte stabilisation: rate kappa at which the integrated and the true gap approach each other, "
        "1/s.",
    )


class StepEquilibration(Section):
    """Penalty that keeps the finite elements between two switches equally long."""

    type: Literal["mean", "difference", "none"] = Field(
        default="mean",
        description="Penalty: squared distances of the element lengths from their mean, squared differences "
        "of neighbours, or nothing.",
    )
    weight: NonNegative = Field(default=1.0, description="Weight of the penalty, per s2.")

    @model_validator(mode="after")
    def _used(self) -> StepEquilibration:
        if self.type == "none" and self.weight != 1.0:
            raise conflict(
                ("weight",),
                f"found {self.weight:g}, which has no effect with type: none, expected no such key or another type",
            )
        return self


class Method(Section):
    """The discretisation: finite elements with switch detection."""

    grid: Literal["uniform", "phases"] = Field(
        default="phases",
        description="Where controls may change: at the ends of control intervals of one length (uniform), or where "
        "contacts change, too (phases): between two such changes the intervals are equally long, and when contacts "
        "change is free.",
    )
    scheme: Literal["radau_iia", "gauss_legendre"] = Field(default="radau_iia", description="Runge-Kutta scheme.")
    stages: Annotated[int, Field(strict=True, ge=1, le=MAX_STAGES)] = Field(
        default=2,
        description="Number of stages of the scheme, 1 to 9, in the search for a motion; refinement may add some.",
    )
    elements: Annotated[int, Field(strict=True, ge=1, le=100)] = Field(
        default=3, description="Number of finite elements per control interval; an impact needs 3."
    )
    contact: Literal["freezing", "impulses"] = Field(
        default="freezing",
        description="How impacts are transcribed: in elements in which physical time stands still (freezing), or as "
        "impulses between two elements (impulses; in the plane, without dry friction of joints and without a number "
        "for slipping).",
    )
    formulation: Formulation = Field(
        default_factory=Formulation, description="How contact becomes switching functions."
    )
    step_equilibration: StepEquilibration = Field(
        default_factory=StepEquilibration, description="Penalty that keeps elements between two switches equally long."
    )
    step_freedom: Positive = Field(
        default=1.0,
        description="How much longer than an equal part of its interval an element may become, as a fraction gamma_h "
        "of that part. With 1, three elements hold an impact only in the middle third of their interval; with 2, "
        "anywhere.",
    )
    auxiliary_force: Annotated[
        float | Literal["auto"],
        BeforeValidator(_read_auxiliary_force),
        WithJsonSchema({"anyOf": [{"type": "number", "exclusiveMinimum": 0}, {"const": "auto"}]}),
    ] = Field(
        default="auto",
        description="Auxiliary force a_n of the fields that resolve impacts while physical time stands still, N; auto: "
        "ten times the robot's weight.",
    )

    accuracy: Annotated[
        float | Literal["none"],
        BeforeValidator(_read_accuracy),
        WithJsonSchema({"anyOf": [{"type": "number", "exclusiveMinimum": 0}, {"const": "none"}]}),
    ] = Field(
        default=1e-7,
        description="Largest error that an element of an exact motion may make, relative to one plus the largest value "
        "of each state; where it is larger, the motion is refined: more stages, elements in parts, and bounds that "
        "hold between the stages too. With none, a motion stays as it was found.",
    )
    compile: Literal["auto", "never", "always"] = Field(
        default="auto",
        description="Whether the functions of the problem become machine code, which takes seconds once and is kept; "
        "auto: where the problem is large and there is a C compiler.",
    )

    @model_validator(mode="after")
    def _used(self) -> Method:
        if self.contact == "impulses":
            found = self.auxiliary_force
            if self.formulation.type != "multipliers":
                raise conflict(
                    ("formulation", "type"),
                    "found steps, which has no effect with contact: impulses, expected no such key or contact: "
                    "freezing",
                )
            if found != "auto":
                raise conflict(
                    ("auxiliary_force",),
                    f"found {found:g}, which has no effect with contact: impulses, expected no such key or contact: "
                    "freezing",
                )
        return self


class Solver(Section):
    """The homotopy: a sequence of smooth problems whose relaxation sigma shrinks."""

    tolerance: Positive = Field(
        default=1e-8, description="Largest complementarity, product G H, of a solved task, in the units of the pairs."
    )
    sigma_start: Positive = Field(default=0.1, description="Relaxation of the first problem, greater than tolerance.")
    sigma_factor: Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0, lt=1)] = Field(
        default=0.35, description="Factor from one relaxation to the next, between 0 and 1."
    )
    velocity_level_ratio: Annotated[float, Field(strict=True, allow_inf_nan=False, ge=1)] = Field(
        default=30.0,
        description="How much larger the relaxation of complementarities on the velocity level is than that of those "
        "on the position level, until the latter has reached the tolerance; at least 1: contacts are decided before "
        "stick, slip or impact. With method.contact impulses the default is 5.",
    )
    max_iterations: Count = Field(default=1000, description="Largest number of iterations of each smooth problem.")
    polish: bool = Field(
        default=True,
        description="Whether relaxed problems are only solved loosely, until they show which contacts touch when, and "
        "the smooth problem on that sequence of contacts (the branch NLP) is then solved exactly. Where that fails, "
        "and without it, relaxed problems are solved down to the tolerance.",
    )
    loose_iterations: Count = Field(
        default=200,
        description="Largest number of iterations of each relaxed problem of the loose homotopy; fewer are faster, "
        "more find cheaper motions more often.",
    )
    effort: Literal["quick", "balanced", "best"] = Field(
        default="balanced",
        description="How long cheaper sequences of phases are looked for, with method.grid phases: not at all (quick), "
        "as long as that pays (balanced), or until no neighbour of the motion is cheaper (best). With quick a "
        "direction of descent that the certificate finds is not followed either.",
    )
    time_limit: Positive | None = Field(default=None, description="Longest solution time in total, s; default: none.")
    relaxation: Literal["scholtes", "fischer_burmeister"] = Field(
        default="scholtes", description="Function that smooths a complementarity pair by sigma."
    )
    processes: Annotated[int, Field(strict=True, ge=1, le=1000)] | None = Field(
        default=None,
        description="How many processes try sequences of phases at once; default: as many as "
        "cores are free. The plan does not depend on it.",
    )
    seed: Annotated[int, Field(strict=True, ge=0)] = Field(
        default=0,
        description="Seed of the random perturbation of the initial guess, 0 for none; feet that step in turn do so in "
        "another order for another seed.",
    )
    warm_start: Annotated[str, Field(min_length=1)] | None = Field(
        default=None,
        description="An earlier plan (its folder or plan.json), whose contact sequence is kept, whatever its "
        "grid, or a CSV file with 'time' and names of configuration coordinates, which is the initial guess; relative "
        "to the task file; default: the reference is the initial guess.",
    )
    retries: Annotated[int, Field(strict=True, ge=0, le=8)] = Field(
        default=4,
        description="How many fallback settings are tried when a task is not solved, 0 to 8: one more of "
        "method.stages, a third or three times loose_iterations, gentler sigma_factor, smaller "
        "velocity_level_ratio, larger method.step_freedom, relaxation fischer_burmeister, larger sigma_start, one more "
        "of method.elements. If all fail, one more attempt with a soft goal shows how near the motion gets; with 0 "
        "there is none.",
    )
    linear_solver: Literal["auto", "fesd", "mumps"] = Field(
        default="auto",
        description="Linear solver inside IPOPT: fesd, compiled on first use and several times faster than mumps, or "
        "mumps; auto: fesd where there is a C++ compiler, else mumps.",
    )

    @model_validator(mode="after")
    def _shrinks(self) -> Solver:
        if not self.sigma_start > self.tolerance:
            raise conflict(
                ("sigma_start",),
                f"found sigma_start {self.sigma_start:g} and tolerance {self.tolerance:g}, expected sigma_start > "
                "tolerance",
            )
        return self


FigureFormat = Literal["png", "svg", "pdf"]

FigureWidth = Literal["one_column", "two_columns"]


class Output(Section):
    """Which optional files a plan leaves."""

    page: bool = Field(default=True, description="Whether to write the web page plan.html.")
    figures: bool = Field(default=True, description="Whether to draw figures.")
    figure_formats: list[FigureFormat] = Field(
        default=["png"], min_length=1, description="Formats in which every figure is written."
    )
    figure_width: FigureWidth = Field(
        default="two_columns",
        description="Width of figures, that of a journal's column, 3.5 inch, or of two, 7.16 inch; type of 8 points.",
    )
    animation: bool = Field(default=False, description="Whether to write the motion as figures/motion.gif.")
    gains: bool = Field(
        default=False,
        description="Whether plan.json has feedback gains along the plan, K(t) of a time-varying LQR; fesd-robot "
        "export --format gains writes them for any plan.",
    )
