"""Which of several attempts is kept."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from fesd_robot.planning.attempts import AttemptedPlan, best_attempt


def attempt(name: str, *, solved: bool = False, near: bool = False, violations: tuple[str, ...] = ()) -> AttemptedPlan:
    """An attempt whose plan has only what is asked of it."""
    status = SimpleNamespace(solved=solved, near_miss=near, nlp="converged")
    parts: dict[str, Any] = {"status": status, "audit": SimpleNamespace(violations=list(violations))}
    plan = SimpleNamespace(statistics=SimpleNamespace(objective=1.0), name=name, **parts)
    return AttemptedPlan(overrides={}, plan=plan, seconds=1.0)  # type: ignore[arg-type]


def test_a_near_miss_comes_before_garbage_and_after_what_is_solved() -> None:
    """Without a solved attempt the near miss is kept, before one that only misses the goal and the first of all."""
    garbage = attempt("garbage", violations=("min_gap",))
    short = attempt("short", violations=("max_goal_violation",))
    near = attempt("near", near=True, violations=("max_energy_error",))
    done = attempt("done", solved=True)
    assert best_attempt([garbage, short, near, done]) is done
    assert best_attempt([garbage, short, near]) is near
    assert best_attempt([garbage, short]) is short
    assert best_attempt([garbage, attempt("more", violations=("min_gap",))]) is garbage
