"""A first task as text: YAML with comments for its reader."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping

from fesd_robot.first_task.proposal import Contact, Proposal, State

_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_./-]*")
_RESERVED = ("true", "false", "null")
_COLUMNS = 110


def task_text(proposal: Proposal, schema: str | None, apex: Mapping[str, float] | None = None) -> str:
    """Return the task file.

    Args:
        proposal: what it says.
        schema: address of the JSON schema for editors; none leaves their line out.
        apex: of the jump, coordinate -> m; default: no reference for the jump.
    """
    lines = [f"# yaml-language-server: $schema={schema}"] if schema else []
    lines += [
        f"# {proposal.words}",
        "#",
        "# A first task, to be changed. Names are those of the model file; units are m, rad, s, N, N m. When contact",
        "# happens is nowhere in this file: the planner finds it out.",
        f"name: {proposal.name}",
        "",
        *_robot(proposal),
        "",
        "ground: {type: plane, friction: 0.7} # flat, at height 0 m",
        "",
        *_contacts(proposal),
        "",
        f"horizon: {{duration: {proposal.duration:g}, intervals: {proposal.intervals}}} # s; the controls "
        "may change at every interval",
        "",
        f"# Where it starts, at rest; the posture is {proposal.found}.",
        *_state("initial", proposal.initial),
        "",
        "# Where it ends, within 0.01 m and 0.01 rad, and at rest.",
        *_state("goal", proposal.goal),
    ]
    if apex:
        name = next(iter(apex))
        lines += [
            "",
            f"# A first idea of the motion: a jump, with {name} at its top. Without it feet may stay on the ground.",
            f"reference: {{type: jumps, count: 1, apex: {_map(apex)}}}",
        ]
    if proposal.slides:
        lines += ["", "# To slide is what it is for: the work of friction costs nothing.", "costs: {slipping: {}}"]
    return "\n".join([*lines, *_limits(proposal), *_reserve()]) + "\n"


def _robot(proposal: Proposal) -> list[str]:
    section = proposal.robot
    lines = ["robot:", f"  model: {_text(section.model)}"]
    if section.root != "fixed":
        lines.append(f"  root: {section.root} # it moves in the x-z plane and pitches: root_x, root_z, root_pitch")
    if section.locked:
        lines += ["  # These joints would leave the plane.", *_wrapped("  locked: ", section.locked)]
    if section.coupled:
        lines += ["  # These joints do what the joint beside them does.", *_wrapped("  coupled: ", section.coupled)]
    if section.armature:
        lines += [
            "  # These move no mass in the model; a guess.",
            *_wrapped("  armature: ", section.armature),
        ]
    return lines


def _contacts(proposal: Proposal) -> list[str]:
    lines = ["# What may touch the ground: the lowest ends of the limbs. Others: fesd-robot robots MODEL --shapes"]
    if any(contact.beside for contact in proposal.contacts):
        lines.append("# One contact stands for all feet at its place.")
    return [*lines, "contacts:", *map(_contact, proposal.contacts)]


def _contact(contact: Contact) -> str:
    if contact.shapes:
        return f"  {_text(contact.name)}: {{body: {_text(contact.frame)}}} # its collision shapes"
    offset = f", offset: [{', '.join(f'{value:g}' for value in contact.offset)}]" if any(contact.offset) else ""
    if contact.radius:
        frame, radius = _text(contact.frame), f"{contact.radius:g}"
        return f"  {_text(contact.name)}: {{type: circle, frame: {frame}{offset}, radius: {radius}}} # m; it rolls"
    beside = f" # and {', '.join(contact.beside)}" if contact.beside else ""
    return f"  {_text(contact.name)}: {{frame: {_text(contact.frame)}{offset}}}{beside}"


def _state(key: str, state: State) -> list[str]:
    lines = [f"{key}:"]
    if state.posture:
        lines.append(f"  posture: {_text(state.posture)}")
    if state.configuration:
        lines += _wrapped("  configuration: ", state.configuration)
    if state.stand_on and state.adjust:
        lines.append(f"  stand_on: {{contacts: {_list(state.stand_on)}, adjust: {_list(state.adjust)}}}")
    elif state.stand_on:
        lines.append(f"  stand_on: {_list(state.stand_on)} # the height follows from this")
    return lines


def _reserve() -> list[str]:
    return [
        "",
        "# Friction and effort that the plan leaves unused, for what the model does not know: a tenth of each.",
        "reserve: {friction: 0.1, effort: 0.1}",
    ]


def _limits(proposal: Proposal) -> list[str]:
    if proposal.effort:
        return [
            "",
            "# The model has no motors: these forces and torques are guessed.",
            "limits:",
            *_wrapped("  effort: ", proposal.effort),
        ]
    return [
        "",
        "# Limits are those of the model file; these would replace them (N m, N; m, rad):",
        "# limits: {effort: {JOINT: 10}, position: {JOINT: [-1, 1]}}",
    ]


def _wrapped(head: str, values: Mapping[str, object]) -> list[str]:
    """Return a map in braces, over several lines if it is long."""
    items = [f"{_text(name)}: {_value(value)}" for name, value in values.items()]
    line = f"{head}{{{', '.join(items)}}}"
    if len(line) <= _COLUMNS:
        return [line]
    indent = " " * (len(head) - len(head.lstrip()) + 2)
    return [head.rstrip(), *(f"{indent}{item}" for item in items)]


def _map(values: Mapping[str, object]) -> str:
    return f"{{{', '.join(f'{_text(name)}: {_value(value)}' for name, value in values.items())}}}"


def _list(names: Iterable[str]) -> str:
    return f"[{', '.join(map(_text, names))}]"


def _value(value: object) -> str:
    return f"{value:g}" if isinstance(value, float | int) else _text(str(value))


def _text(text: str) -> str:
    """Return a string as YAML: in quotes where it would mean something else."""
    plain = _PLAIN.fullmatch(text) and text.lower() not in _RESERVED
    address = re.fullmatch(r"[A-Za-z-]+:[A-Za-z0-9_./-]+|\.{1,2}/[A-Za-z0-9_./-]+", text)
    return text if plain or address else json.dumps(text)
