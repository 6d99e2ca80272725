"""A column of text whose cells are held a block at a time: a string of its own takes 50 bytes beside its 10."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from typing import overload

#: Cells of a block.
CELLS_AT_ONCE = 4096


class PackedCells(Sequence[str]):
    """Cells without line feeds, as no cell of a table has one that stands on a line of its own."""

    def __init__(self, cells: Iterable[str] = ()) -> None:
        self._blocks: list[str] = []
        self._last: list[str] = []
        self._unpacked: tuple[int, list[str]] = (-1, [])
        self.extend(cells)

    def extend(self, cells: Iterable[str]) -> None:
        """Put cells at the end."""
        self._last.extend(cells)
        while len(self._last) >= CELLS_AT_ONCE:
            self._blocks.append("\n".join(self._last[:CELLS_AT_ONCE]))
            del self._last[:CELLS_AT_ONCE]

    def __len__(self) -> int:
        return len(self._blocks) * CELLS_AT_ONCE + len(self._last)

    def __iter__(self) -> Iterator[str]:
        return chain(chain.from_iterable(block.split("\n") for block in self._blocks), self._last)

    @overload
    def __getitem__(self, index: int) -> str: ...
    @overload
    def __getitem__(self, index: slice) -> list[str]: ...
    def __getitem__(self, index: int | slice) -> str | list[str]:
        if isinstance(index, slice):
            return [self[row] for row in range(*index.indices(len(self)))]
        block, row_of_block = divmod(range(len(self))[index], CELLS_AT_ONCE)
        if block == len(self._blocks):
            return self._last[row_of_block]
        if block != self._unpacked[0]:
            self._unpacked = block, self._blocks[block].split("\n")
        return self._unpacked[1][row_of_block]
