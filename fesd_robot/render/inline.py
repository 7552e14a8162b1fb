"""A plan inside a notebook: the verdict, five sentences, and the page in a frame of its own."""

from __future__ import annotations

from html import escape

from fesd_robot.plans import Plan
from fesd_robot.plans.sentences import sentences
from fesd_robot.render.verdict import verdict_of

HEIGHT = 560
"""Of the frame, pixels."""

GREEN, RED = "#1a7f37", "#b42318"
"""Of the badge."""


def inline_html(plan: Plan, page: str | None, missing: str = "") -> str:
    """Return the plan as HTML that a notebook shows below a cell.

    Args:
        plan: the plan.
        page: its web page, which needs no network; None if it cannot be drawn.
        missing: why, in a sentence.
    """
    verdict = verdict_of(plan)
    badge = (
        f'<span style="background:{GREEN if verdict.solved else RED};color:#fff;border-radius:4px;padding:2px 8px">'
        f"{escape(verdict.badge)}</span>"
    )
    lines = "".join(f"<li>{escape(sentence)}</li>" for sentence in sentences(plan))
    frame = (
        f"<p>The motion is not drawn: {escape(missing)}</p>"
        if page is None
        else f'<iframe sandbox="allow-scripts" style="width:100%;height:{HEIGHT}px;border:1px solid #ccc" '
        f'title="{escape(plan.name, quote=True)}" srcdoc="{escape(page, quote=True)}"></iframe>'
    )
    return f"<p><b>{escape(plan.name)}</b> {badge} {escape(verdict.sentence)}</p><ul>{lines}</ul>{frame}"
