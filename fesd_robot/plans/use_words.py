"""How much a plan uses of friction and effort, as a section of its report and as warnings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from fesd_robot.plans.outcome import ContactOutcome, FrictionUse
from fesd_robot.plans.plan import Plan
from fesd_robot.plans.sentences import control_peaks
from fesd_robot.plans.tables import markdown_table

ALL_OF_IT = 0.999
"""Share of its friction above which a contact uses all of it."""


def use_section(plan: Plan) -> str:
    """Return the largest share of every cone of friction and of every effort limit that a plan uses; empty if none."""
    rows = [
        *(row for name, one in (plan.outcome.contacts if plan.outcome else {}).items() for row in _contact(name, one)),
        *(
            [each.name, "effort", _percent(each.share), f"{each.start:.6g}"]
            for each in control_peaks(plan)
            if each.limit
        ),
    ]
    if not rows:
        return ""
    table = markdown_table(["contact or control", "of what", "largest share", "at [s]"], rows)
    return f"## Use of friction and effort\n\n{_reserve(plan)}\n\n{table}"


def _reserve(plan: Plan) -> str:
    reserve = plan.task.get("reserve", {})
    parts = [f"{100 * reserve[key]:g} % of {key}" for key in ("friction", "effort") if reserve.get(key)]
    kept = f"The task keeps {' and '.join(parts)} in reserve" if parts else "The task keeps no reserve"
    return f"{kept} (`reserve`). A contact that slides uses all of its friction and is left out."


def _contact(name: str, outcome: ContactOutcome) -> Iterator[list[str]]:
    for what, use in (("friction where it sticks", outcome.sticking), ("friction where it lands", outcome.landing)):
        if use is not None:
            yield [name, what, _percent(use.share), f"{use.time:.6g}"]


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"


def use_warnings(contacts: Mapping[str, ContactOutcome]) -> list[str]:
    """Return a sentence for contacts that use all of their friction where they stick, and one for those that land so.

    Args:
        contacts: name -> outcome.
    """
    sticking = {name: one.sticking for name, one in contacts.items()}
    landing = {name: one.landing for name, one in contacts.items()}
    return [
        *_all_of_it(sticking, "where it sticks", "with any less friction it slips"),
        *_all_of_it(landing, "where it lands", "with any less friction it slides on"),
    ]


def _all_of_it(uses: Mapping[str, FrictionUse | None], where: str, what: str) -> Iterator[str]:
    found = [f"'{name}' (at {use.time:.4g} s)" for name, use in uses.items() if use and use.share > ALL_OF_IT]
    if found:
        subject = f"Contact {found[0]} uses" if len(found) == 1 else f"Each of the contacts {', '.join(found)} uses"
        yield f"{subject} all of its friction {where}: {what}; reserve.friction keeps some unused."
