"""Setups of a run side by side, each with as few rows as say the same of the unknowns.

What sets of setups separate and what they span is asked again and again, beside other sets, and computed once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.methods.chain.least_squares import space_of_run
from monitor.methods.instruments.run_rows import RunRows, Separated, separated_by
from monitor.records import Array


@dataclass(frozen=True)
class Block:
    """The ``rows`` of one setup, what is ``remaining`` of the sum of squares of its readings when they are fitted by
    themselves, with so many ``numbers`` more than unknowns; the ``deviation`` by which they count, and the degrees of
    ``freedom`` of that, infinite where it is as stated."""

    rows: npt.NDArray[np.int64]
    remaining: float
    numbers: float
    deviation: float
    freedom: float


class Sides:
    """The ``blocks`` of a run by name, of which any may stand on a side; names stand in their order."""

    def __init__(self, at: RunRows, blocks: Mapping[str, Block]) -> None:
        self.at, self.blocks = at, blocks
        self._turned = {name: _turned(at, block) for name, block in blocks.items()}
        self._separated: dict[frozenset[str], Separated] = {}
        self._bases: dict[frozenset[str], Array] = {}

    def separated(self, side: frozenset[str]) -> Separated:
        """What the rows of a side separate of the unknowns."""
        if side not in self._separated:
            nominal = self._of(side)[:, : len(self.at.sizes)]
            self._separated[side] = separated_by(nominal, self.at.sizes)
        return self._separated[side]

    def basis(self, side: frozenset[str]) -> Array:
        """An orthonormal basis (m, r) of what the unknowns that a side separates do to its rows."""
        if side not in self._bases:
            self._bases[side] = basis_of(self.jacobian(side), self.separated(side))
        return self._bases[side]

    def jacobian(self, side: frozenset[str]) -> Array:
        """The derivatives (m, p) of the rows of a side, over the deviation by which they count."""
        return self._of(side)[:, len(self.at.sizes) : -1]

    def residual(self, side: frozenset[str]) -> Array:
        """The residuals (m,) of the rows of a side, over the deviation by which they count."""
        return self._of(side)[:, -1]

    def counts(self, side: frozenset[str]) -> list[tuple[int, float]]:
        """How many rows each block of a side has here, and the degrees of freedom of its deviation."""
        return [
            (len(self._turned[name]), block.freedom) for name, block in self.blocks.items() if name in side
        ]

    def _of(self, side: frozenset[str]) -> Array:
        return np.concatenate([self._turned[name] for name in self.blocks if name in side])


def _turned(at: RunRows, block: Block) -> Array:
    """The rows of a block turned among themselves: nominal derivatives, derivatives and residual (m, 2 p + 1) side by
    side, the last two over the deviation; of more rows than columns the triangle, which has the same products."""
    whole = np.column_stack(
        [
            at.nominal[block.rows],
            at.jacobian[block.rows] / block.deviation,
            at.residual[block.rows] / block.deviation,
        ]
    )
    shown = np.any(whole != 0.0, axis=0)
    if np.count_nonzero(shown) >= len(whole):
        return whole
    triangle = np.linalg.qr(whole[:, shown], mode="r")
    turned = np.zeros((len(triangle), whole.shape[1]))
    turned[:, shown] = triangle
    return turned


def basis_of(jacobian: Array, separated: Separated) -> Array:
    """An orthonormal basis (m, r) of what the unknowns (p,) do that rows (m, p) separate."""
    space = space_of_run(jacobian @ separated.unknowns)
    return space.basis[:, : space.rank]
