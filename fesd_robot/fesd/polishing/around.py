"""The problem with pairs around a point of a branch, with what its branch NLP determines and pairs do not."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import casadi as ca
import numpy as np

from fesd_robot.complementarity import Branch, Label
from fesd_robot.fesd.polishing.branch_motion import BranchMotion
from fesd_robot.fesd.polishing.transcription import BranchTranscription
from fesd_robot.mpcc import Block, BlockEquations, Mpcc


def problem_around(motion: BranchMotion, held: Collection[int] = ()) -> Mpcc:
    """Return the problem with pairs to which it is a question whether a point of a branch is stationary.

    Neighbouring elements of one mode are equally long: without step equilibration only the switches determine the
    lengths; the others would follow the errors of the discretisation. Friction where a slide in space ends is against
    the velocity just before it: that at the end is zero and leaves every direction.

    Args:
        motion: the point, and the branch whose modes count.
        held: elements without length that keep none.
    """
    problem, polisher, branch = motion.transcription.problem, motion.polisher, motion.branch
    blocks = [_equal_steps(polisher, branch), _zero_steps(polisher, held), *_resting(polisher, branch)]
    return replace(problem, blocks=[*problem.blocks, *(block for block in blocks if block.copies)])


def _equal_steps(branch_transcription: BranchTranscription, branch: Branch) -> Block:
    indices = branch_transcription.transcription.indices
    pairs = branch_transcription.equally_long(branch)
    steps = ca.SX.sym("h", 2)
    where = [np.array([indices.step(e), indices.step(e + 1)]) for e in pairs]
    return _zero_block(branch_transcription, "equal steps", pairs, steps, steps[1] - steps[0], where)


def _zero_steps(branch_transcription: BranchTranscription, held: Collection[int]) -> Block:
    step, elements = ca.SX.sym("h"), sorted(held)
    where = [np.array([branch_transcription.transcription.indices.step(e)]) for e in elements]
    return _zero_block(branch_transcription, "no length", elements, step, step, where)


def _resting(branch_transcription: BranchTranscription, branch: Branch) -> list[Block]:
    """Return rows for the slopes at ends where a contact comes to rest, of quantities that it holds from both sides."""
    indices, rows = branch_transcription.transcription.indices, branch_transcription.element_rows
    ends, stages = branch_transcription.resting_ends(branch), range(rows.tableau.stages)
    n_x, blocks = branch_transcription.transcription.ocp.system.state.numel(), []
    name = "friction where a slide ends"
    for row in (row for row in rows.ending if row not in rows.conditions.between_all_points):
        elements = sorted({e for e, i in ends if rows.conditions.quantities[rows.conditions.members[i].G].row == row})
        where = [np.concatenate([indices.left_state(e), *(indices.stage(e, j) for j in stages)]) for e in elements]
        if elements:
            variables = ca.SX.sym("w", len(where[0]))
            parts = np.cumsum([0, n_x, *(len(indices.stage(elements[0], j)) for j in stages)]).tolist()
            points = [(part[:n_x], part[n_x:]) for part in ca.vertsplit(variables, parts)]
            slope = rows.slopes(points)[rows.ending.index(row)]
            blocks.append(_zero_block(branch_transcription, name, elements, variables, slope, where))
    return blocks


def _zero_block(
    branch_transcription: BranchTranscription,
    name: str,
    elements: Sequence[int],
    variables: ca.SX,
    row: ca.SX,
    where: Sequence[np.ndarray],
) -> Block:
    """Return a row that is zero, in elements whose variables are at the indices `where`."""
    equations = BlockEquations(
        name=name.replace(" ", "_"),
        variables=variables,
        parameters=ca.SX(0, 1),
        cost=ca.SX(0),
        rows=row,
        lower=np.zeros(1),
        upper=np.zeros(1),
        constraints=[Label(name)],
    )
    return Block(
        equations=equations,
        places=[branch_transcription.transcription.indices.place(e) for e in elements],
        index=np.array(where, dtype=int).reshape(len(elements), variables.numel()).T,
        values=np.zeros((0, len(elements))),
    )
