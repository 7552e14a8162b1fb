"""The smooth problem on a structure: every alternative's chosen factor is held at zero, nothing is relaxed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from fesd_robot.fesd.element import read_elements
from fesd_robot.fesd.interval import IntervalFunctions
from fesd_robot.fesd.polishing.bounds import Holding
from fesd_robot.fesd.polishing.conditions import Alternatives, alternatives_of
from fesd_robot.fesd.polishing.reading import GRAZING_FLIGHT, Structure, collapse, out_of_elements, read_structure
from fesd_robot.fesd.transcription import Transcription
from fesd_robot.mpcc import Block, Held, Mpcc


@dataclass(frozen=True)
class BranchTranscription:
    """A transcription whose alternatives are choices instead of pairs, to finish a homotopy with.

    One problem serves all structures: a structure sets bounds on variables and on rows, so functions and derivatives
    are made once. What a structure repeats is left out, or an interior-point method finds no interior: a level at a
    boundary belongs to the element before it; a gap is held where contact begins and then kept by the velocities; an
    element without length has no bounds on its states, for they are those of its left boundary.
    """

    transcription: Transcription

    @cached_property
    def alternatives(self) -> Alternatives:
        """What can vanish."""
        return alternatives_of(self.transcription.ocp.system)

    @cached_property
    def problem(self) -> Mpcc:
        """The problem without pairs, and with a row for every quantity that needs one at every point."""
        full = self.transcription.problem
        kinds = list(self.transcription.intervals.values())
        first, intervals, rest = full.blocks[0], full.blocks[1 : 1 + len(kinds)], full.blocks[1 + len(kinds) :]
        pieces = zip(intervals, kinds, strict=True)
        blocks = [self._initial_rows(first), *(self._interval_rows(block, own) for block, own in pieces), *rest]
        return Mpcc(lower=full.lower, upper=full.upper, start=full.start, blocks=blocks)

    def readings(self, w: np.ndarray) -> Iterator[Structure]:
        """Return the structures that a point may mean, the likelier one first."""
        elements = self.transcription.unpack(w)
        found: list[Structure] = []
        for hover in (GRAZING_FLIGHT, 0.0):
            structure = read_structure(self.alternatives, elements, self._shares, hover)
            if structure not in found:
                found.append(structure)
                yield structure

    def out_of_elements(self, w: np.ndarray) -> list[int]:
        """Return the intervals of which no element is to spare at w, see `reading.out_of_elements`."""
        return out_of_elements(next(self.readings(w)), self.transcription.unpack(w))

    def revised(self, structure: Structure, w: np.ndarray) -> Structure | None:
        """Return the structure without elements that have shrunk to nothing at w; None if there are none."""
        return collapse(structure, self.transcription.unpack(w), self._shares)

    def held(self, structure: Structure) -> Held:
        """Return the bounds on variables and rows of `problem` that hold a structure."""
        return Holding(self).held(structure)

    @cached_property
    def _shares(self) -> np.ndarray:
        """Equal share of the interval of every element, numerical time."""
        ocp = self.transcription.ocp
        return np.concatenate([np.full(n, ocp.duration / ocp.intervals / n) for n in self.transcription.elements])

    @property
    def points(self) -> int:
        """Points of an element that are its own: the stages, and a right end that is none."""
        layout = next(iter(self.transcription.layouts.values()))
        return layout.stages + layout.own_end

    def _initial_rows(self, block: Block) -> Block:
        n_x, n_z = self.transcription.ocp.system.state.numel(), self.transcription.ocp.system.algebraic.numel()
        w = ca.SX.sym("w", block.function.sparsity_in(0))
        return _with_rows(block, w, self.alternatives.rows(w[:n_x], w[n_x : n_x + n_z]))

    def _interval_rows(self, block: Block, functions: IntervalFunctions) -> Block:
        layout = functions.layout
        w = ca.SX.sym("w", block.function.sparsity_in(0))
        left = layout.n_x + layout.n_z
        parts = read_elements(layout, self.transcription.options.tableau, w[:left], w[left:])
        rows = [
            self.alternatives.rows(x, z) for part in parts for x, z in [*part.stages, *[part.right] * layout.own_end]
        ]
        return _with_rows(block, w, ca.vertcat(ca.SX(0, 1), *rows))


def _with_rows(block: Block, w: ca.SX, rows: ca.SX) -> Block:
    """Return the block without its pairs, and with further rows that no structure holds yet."""
    p, nothing, count = ca.SX.sym("p", block.function.sparsity_in(1)), ca.SX(0, 1), rows.numel()
    f, g, _, _ = block.function(w, p)
    return Block(
        copy_names=block.copy_names,
        function=ca.Function(block.function.name(), [w, p], [f, ca.vertcat(g, rows), nothing, nothing]),
        index=block.index,
        parameters=block.parameters,
        lower=np.append(block.lower, np.full(count, -np.inf)),
        upper=np.append(block.upper, np.full(count, np.inf)),
        constraint_names=[*block.constraint_names, *[f"alternative {i}" for i in range(count)]],
        pair_names=[],
    )
