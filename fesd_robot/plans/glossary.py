"""The words of a report's numbers, for readers who do not know the method."""

from __future__ import annotations

from fesd_robot.plans.tables import markdown_table

GLOSSARY = {
    "attempt": "one solve of the task, with its settings or changed ones",
    "audit": "the check of the finished motion against mechanics, by programs that know nothing of the planner",
    "B-stationary": "to first order no small change lowers the cost, also of when contacts open, close, stick and slip",
    "biactive pair": "a pair of which both sides are zero, so that either may grow",
    "branch": "one choice of which side of every pair is zero: one sequence of contacts",
    "complementarity": "the largest product of the two numbers of a pair; zero for an exact motion",
    "complementarity pair": "two numbers of which one has to be zero, such as gap and force of a contact",
    "constraint violation": "by how much the equations and limits of the numerical problem are missed",
    "control interval": "a stretch of time in which all controls are constant; numbered from 0",
    "exact": "nothing is relaxed: the motion was solved on its own sequence of contacts",
    "finite element": "a stretch of an interval without a switch; where it ends is part of the solution",
    "gap": "the distance between a contact and what it touches",
    "homotopy": "the row of ever less relaxed problems (sigma) that leads to the sequence of contacts",
    "impulse": "a force integrated over an impact, which takes no time",
    "interval": "see control interval",
    "linearised cost, slope": "how fast the cost falls, per unit of a small change",
    "natural residual": "the largest of the smaller sides of all pairs",
    "NLP": "nonlinear program: one smooth problem, as the solver gets it",
    "polishing": "the solve on the branch with nothing relaxed; 'exact' in the table of effort",
    "refinement": "adds finite elements until none makes an error above `method.accuracy`",
    "regularisation": "small terms of the cost that make the numbers of the method unique",
    "replay": "the motion driven again from its own states by an integrator of rigid bodies",
    "S-, M-, C-, W-stationary": "kinds of solutions by the signs of multipliers, strongest first",
    "sigma": "how far the products of pairs are relaxed; velocity level: the same for pairs of velocities",
    "stage": "a point of an element at which the equations of motion hold",
    "step equilibration": "keeps elements of one interval equally long where no switch is",
    "switch": "a contact that begins or ends to touch, to stick or to slip",
    "undetermined pair": "a pair of which neither side is small enough to count as zero",
    "weights": "the factors of the terms of the cost",
}
"""Word -> its meaning, in the order of the alphabet."""


def glossary() -> str:
    """Return the words as a table."""
    return markdown_table(["word", "meaning"], [[word, meaning] for word, meaning in GLOSSARY.items()])
