"""Sequences from words, as the report writes them, and what solves them."""

from __future__ import annotations

from pathlib import Path

from fesd_robot.contact import ContactMode
from fesd_robot.mpcc import Run
from fesd_robot.ocp import formulate
from fesd_robot.ocp.solver_options import homotopy_options
from fesd_robot.phases import Phase, PhaseSolver, Sequence
from fesd_robot.task import load_task

TASKS = Path(__file__).parents[2] / "tasks"

MODES = {
    "F": ContactMode.FLIGHT,
    "S": ContactMode.STICK,
    "L": ContactMode.SLIP,
    "+": ContactMode.SLIP_FORWARDS,
    "-": ContactMode.SLIP_BACKWARDS,
}


def sequence(words: str, *durations: float) -> Sequence:
    """A letter a contact, a word a phase; with ! all contacts that come down hit there, and do what follows."""
    names = tuple(f"contact {i}" for i in range(len(words.split()[0].strip("!"))))
    phases: list[Phase] = []
    for word, duration in zip(words.split(), durations, strict=True):
        modes = tuple(MODES[letter] for letter in word.strip("!"))
        hit = [
            mode.hitting if phases and before is ContactMode.FLIGHT and mode.closed else mode
            for before, mode in zip(phases[-1].modes if phases else modes, modes, strict=True)
        ]
        phases.append(Phase(modes, duration, (tuple(hit),) if word.startswith("!") else ()))
    return Sequence(names, tuple(phases))


def solver_of(task: str, *overrides: str) -> PhaseSolver:
    """What finds the motions of sequences of a shipped task."""
    loaded = load_task(TASKS / f"{task}.yaml", list(overrides))
    return PhaseSolver(formulate(loaded), Run(homotopy_options(loaded)))
