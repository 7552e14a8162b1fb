"""Whether the parts of a plan fit each other: lengths, names, finite numbers, times."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence, Sized

import numpy as np

from fesd_robot.errors import PlanFileError, nearest
from fesd_robot.instants import SAME_EVENT
from fesd_robot.plans.audit_record import ENTRIES, Audit
from fesd_robot.plans.finite_elements import BranchNlpRecord, FiniteElements
from fesd_robot.plans.gains import TrackingGains
from fesd_robot.plans.plan import Plan
from fesd_robot.robot import Robot
from fesd_robot.task import Task

_OF_SEGMENTS = ("time", "configuration", "velocity", "control", "gain")

Series = tuple[str, Sized]
"""Key of an entry, and its values."""


def inconsistencies(plan: Plan) -> Iterator[str]:
    """Yield what does not fit in a plan, key by key, a sentence each: the entry, what was found, and what is expected.

    Every series along the samples is as long as the time, every one along the control intervals as their starts; names
    are those of the task and of the plan's other parts. Numbers of a solved plan are finite, and its clock never steps
    back; a solve that failed may leave anything.
    """
    if "time" not in plan.controls:
        yield "controls: found no 'time', expected the start of every control interval"
        return
    if not len(plan.trajectory.time):
        yield "trajectory.time: found no number, expected one for every sample"
        return
    yield from _names(plan)
    yield from _audit(plan.audit)
    yield from _lengths(along_samples(plan), plan.trajectory.time, "trajectory.time")
    yield from _lengths(_controls(plan), plan.controls["time"], "controls.time")
    if plan.finite_elements is not None:
        yield from _finite_elements(plan.finite_elements, len(plan.controls["time"]))
    if plan.gains is not None:
        yield from _gains(plan.gains, plan)
    if plan.status.solved:
        yield from _numbers(plan)
        yield from _times(plan)


def check_task_and_robot(plan: Plan, task: Task, robot: Robot) -> None:
    """Raise unless a plan has the coordinates and contacts of a robot and its task.

    Args:
        plan: consistent in itself.
        task, robot: with the contacts in their places.

    Raises:
        PlanFileError: a coordinate or a contact that the plan does not have.
    """
    trajectory = plan.trajectory
    for key, names, own in (
        ("trajectory.configuration", robot.configuration_names, trajectory.configuration),
        ("trajectory.velocity", robot.velocity_names, trajectory.velocity),
        ("contacts", task.contacts, plan.contacts),
    ):
        for name in names:
            if name not in own:
                raise PlanFileError(f"{plan.name}: {key}: found no '{name}', which the task has{nearest(name, own)}")


def along_samples(plan: Plan) -> Iterator[Series]:
    """Yield every series along `Trajectory.time`."""
    trajectory, model = plan.trajectory, plan.full_model
    for kind in ("configuration", "velocity", "acceleration"):
        for name, values in getattr(trajectory, kind).items():
            yield f"trajectory.{kind}.{name}", values
    for name, contact in plan.contacts.items():
        yield from _fields(f"contacts.{name}", contact, ("gap", "normal_force", "tangential_force", "mode"))
        if contact.lateral_force is not None:
            yield f"contacts.{name}.lateral_force", contact.lateral_force
    for name, joint in plan.joint_friction.items():
        yield from _fields(f"joint_friction.{name}", joint, ("force", "mode"))
    if model is not None:
        for name, one in model.joints.items():
            yield from _fields(f"full_model.joints.{name}", one, ("position", "velocity", "effort"))
        for name, values in (model.base or {}).items():
            yield f"full_model.base.{name}", values
        for name, foot in model.feet.items():
            yield from _fields(f"full_model.feet.{name}", foot, ("normal_force", "tangential_force"))


def _controls(plan: Plan) -> Iterator[Series]:
    for name, values in plan.controls.items():
        yield f"controls.{name}", values


def _fields(key: str, part: object, names: Iterable[str]) -> Iterator[Series]:
    for name in names:
        yield f"{key}.{name}", getattr(part, name)


def _lengths(series: Iterable[Series], time: np.ndarray, of: str) -> Iterator[str]:
    for key, values in series:
        if len(values) != len(time):
            yield f"{key}: found {len(values)} entries, expected {len(time)}, as many as {of} has"


def _names(plan: Plan) -> Iterator[str]:
    trajectory, units, model = plan.trajectory, plan.units, plan.full_model
    velocity, contacts = [*trajectory.velocity], [*plan.contacts]
    controls = [name for name in plan.controls if name != "time"]
    places = [*plan.task["contacts"]]
    known = [name for name in contacts if name in places or name.rpartition("_")[0] in places]
    feet = {} if model is None else model.feet
    yield from _equal("units.configuration", units.configuration, [*trajectory.configuration], "trajectory")
    yield from _equal("units.velocity", units.velocity, velocity, "trajectory")
    yield from _equal("units.controls", units.controls, controls, "controls")
    if trajectory.acceleration:
        yield from _equal("trajectory.acceleration", trajectory.acceleration, velocity, "trajectory.velocity")
    if plan.control_limits is not None:
        yield from _equal("control_limits", plan.control_limits, controls, "controls")
    if plan.replay is not None:
        yield from _equal("replay.velocity", plan.replay.velocity, velocity, "trajectory.velocity")
    for key, names, own, of in (
        ("contacts", contacts, known, "task.contacts"),
        ("outcome.contacts", plan.outcome.contacts if plan.outcome else (), contacts, "contacts"),
        ("switches", (one.contact for one in plan.switches), contacts, "contacts"),
        ("impulses", (one.contact for one in plan.impulses), contacts, "contacts"),
        ("full_model.feet", (foot.contact for foot in feet.values()), contacts, "contacts"),
        ("joint_friction", plan.joint_friction, velocity, "trajectory.velocity"),
        ("joint_switches", (one.joint for one in plan.joint_switches), [*plan.joint_friction], "joint_friction"),
    ):
        for name in names:
            if name not in own:
                yield f"{key}: found '{name}', expected a name of {of}{nearest(name, places if own is known else own)}"


def _audit(audit: Audit) -> Iterator[str]:
    """Yield entries of an audit that were checked without a limit, and violations of what was not checked."""
    checked = [name for name in ENTRIES if getattr(audit, name) is not None]
    for name in checked:
        if not audit.tolerances.get(name, 0.0) > 0:
            yield f"audit.tolerances: found no limit above zero of '{name}', which was checked"
    for name in audit.violations:
        if name not in checked:
            yield f"audit.violations: found '{name}', expected an entry that was checked{nearest(name, checked)}"


def _equal(key: str, names: Iterable[str], own: Sequence[str], of: str) -> Iterator[str]:
    found = [*names]
    for name in (*own, *found):
        if name not in found:
            yield f"{key}: found no '{name}', which {of} has"
        if name not in own:
            yield f"{key}: found '{name}', expected a name of {of}{nearest(name, own)}"


def _numbers(plan: Plan) -> Iterator[str]:
    """Yield where a solved plan has a number that is none; accelerations beside impacts are not defined."""
    samples = ((key, values) for key, values in along_samples(plan) if ".acceleration." not in key)
    series = [("trajectory.time", plan.trajectory.time), *_controls(plan), *samples]
    impulses = [[one.normal, one.tangential, one.lateral or 0.0] for one in plan.impulses]
    series += [(f"impulses.{number}", np.array(values)) for number, values in enumerate(impulses)]
    if (elements := plan.finite_elements) is not None:
        names = ("interval", "step", "left", "states_at", "algebraic_at", "slopes", "controls")
        series += _fields("finite_elements", elements, names)
    for key, values in series:
        if isinstance(values, np.ndarray) and not np.isfinite(values).all():
            entry = int(np.flatnonzero(~np.isfinite(values))[0])
            yield f"{key}: found {values[entry]} at entry {entry}, expected finite numbers in a solved plan"


def _times(plan: Plan) -> Iterator[str]:
    time, starts = plan.trajectory.time, plan.controls["time"]
    for key, values, least, what in (
        ("trajectory.time", time, -SAME_EVENT, "times that never decrease"),
        ("controls.time", starts, 0.0, "starts of intervals in the order of time"),
    ):
        for entry in np.flatnonzero(np.diff(values) < least)[:1]:
            found = f"found {values[entry + 1]:g} s behind {values[entry]:g} s"
            yield f"{key}: {found} at entry {entry + 1}, expected {what}"
    for key, moments in (
        ("switches", [one.time for one in plan.switches]),
        ("impulses", [one.time for one in plan.impulses]),
        ("joint_switches", [one.time for one in plan.joint_switches]),
    ):
        for number, moment in enumerate(moments):
            if not time[0] - SAME_EVENT <= moment <= time[-1] + SAME_EVENT:
                yield f"{key}.{number}.time: found {moment:g} s, expected one from {time[0]:g} to {time[-1]:g} s"


def _finite_elements(elements: FiniteElements, intervals: int) -> Iterator[str]:
    """Yield what does not fit in the finite elements: E of them, with n_p points, n_x states and n_z others."""
    count, n_x, stages = len(elements.step), len(elements.states), elements.stages
    n_z = len(elements.left) - n_x
    if not count or not n_x or stages < 1 or n_z < 0:
        found = f"{count} elements, {n_x} states, {stages} stages and {len(elements.left)} entries of 'left'"
        yield f"finite_elements: found {found}, expected at least one of each, and in 'left' every state"
        return
    if "clock" not in elements.states:
        yield "finite_elements.states: found no 'clock', expected the physical time among them"
    for key, values, each, own_end in (
        ("interval", elements.interval, 1, False),
        ("active", elements.active, 1, False),
        ("slopes", elements.slopes, stages * n_x, False),
        ("states_at", elements.states_at, stages * n_x, True),
        ("algebraic_at", elements.algebraic_at, stages * n_z, True),
        ("lefts", elements.lefts, n_x, False),
    ):
        expected = {count * each, count * (each + each // stages) if own_end else count * each}
        if values is not None and len(values) not in expected:
            found = f"found {len(values)} entries, expected {min(expected)}"
            yield f"finite_elements.{key}: {found} for {count} elements, {stages} stages and {n_x} states"
    if len(elements.controls) % count:
        found = f"found {len(elements.controls)} entries, expected equally many"
        yield f"finite_elements.controls: {found} for each of {count} elements"
    for number, interval in enumerate(elements.interval):
        if not 0 <= interval < intervals:
            found = f"found {interval:g} at entry {number}"
            yield f"finite_elements.interval: {found}, expected one of {intervals} intervals"
    for number, letters in enumerate(elements.active):
        if len(letters) != len(elements.conditions) or set(letters.upper()) - set("GHC"):
            found = f"found '{letters[:40]}' at entry {number}, expected a letter G, H or C"
            yield f"finite_elements.active: {found} for each of {len(elements.conditions)} conditions"
    if elements.nlp is not None:
        yield from _branch_nlp(elements.nlp, count)


def _branch_nlp(nlp: BranchNlpRecord, elements: int) -> Iterator[str]:
    intervals = len(nlp.lengths)
    if len(nlp.elements) != intervals or sum(nlp.elements) != elements:
        found = f"found {len(nlp.elements)} intervals with {sum(nlp.elements)} elements"
        yield f"finite_elements.nlp.elements: {found}, expected {intervals} with {elements}"
    if sum(nlp.phases) != intervals:
        yield f"finite_elements.nlp.phases: found {sum(nlp.phases)} intervals in all, expected {intervals}"
    for key, one in (("of_bounds", nlp.of_bounds), ("of_rows", nlp.of_rows)):
        if len(one.indices) != len(one.values) or not all(0 <= index < one.size for index in one.indices):
            found = f"found {len(one.indices)} indices of {one.size} multipliers and {len(one.values)} values"
            yield f"finite_elements.nlp.{key}: {found}, expected a value for every index below the size"


def _gains(gains: TrackingGains, plan: Plan) -> Iterator[str]:
    """Yield what does not fit in the gains along a plan: names, and the shapes of every segment."""
    controls = [name for name in plan.controls if name != "time"]
    for key, names, own, of in (
        ("configuration_names", gains.configuration_names, plan.trajectory.configuration, "trajectory.configuration"),
        ("velocity_names", gains.velocity_names, plan.trajectory.velocity, "trajectory.velocity"),
        ("control_names", gains.control_names, controls, "controls"),
    ):
        yield from _equal(f"gains.{key}", names, [*own], of)
    n_q, n_v, n_u = len(gains.configuration_names), len(gains.velocity_names), len(gains.control_names)
    for key, values, count in (
        ("velocity_units", gains.velocity_units, n_v),
        ("control_units", gains.control_units, n_u),
        ("lower", gains.lower, n_u),
        ("upper", gains.upper, n_u),
    ):
        if len(values) != count:
            yield f"gains.{key}: found {len(values)} entries, expected {count}, one for each of its names"
    if not gains.segments:
        yield "gains.segments: found none, expected at least one"
    for number, one in enumerate(gains.segments):
        n, key = len(one.time), f"gains.segments.{number}"
        if not n:
            yield f"{key}.time: found no number, expected one for every instant"
        for name, shape in (
            ("configuration", (n, n_q)),
            ("velocity", (n, n_v)),
            ("control", (n, n_u)),
            ("gain", (n, n_u, 2 * n_v)),
        ):
            if (found := getattr(one, name)).shape != shape:
                yield f"{key}.{name}: found numbers of shape {found.shape}, expected {shape}"
        if not all(np.isfinite(getattr(one, name)).all() for name in _OF_SEGMENTS):
            yield f"{key}: found a number that is not finite, expected finite ones"
