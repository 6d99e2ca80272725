"""Columns of text that are held a block at a time read as the list of their cells."""

from __future__ import annotations

import pytest

from monitor.readers.tables.packed_cells import CELLS_AT_ONCE, PackedCells


@pytest.mark.parametrize("count", [0, 1, CELLS_AT_ONCE - 1, CELLS_AT_ONCE, 2 * CELLS_AT_ONCE + 3])
def test_packed_cells_read_as_the_list_of_them(count: int) -> None:
    """Empty cells at the ends of blocks included, however they were put in."""
    cells = [("", f"{number}", "-1.5e-3")[number % 3] for number in range(count)]
    packed = PackedCells()
    for start in range(0, count, 1000):
        packed.extend(cells[start : start + 1000])
    assert len(packed) == count
    assert list(packed) == cells
    assert [packed[place] for place in range(-count, count)] == cells + cells
    assert packed[count - 2 :] == cells[count - 2 :]
    assert packed[::-1] == cells[::-1]
    with pytest.raises(IndexError, match="out of range"):
        packed[count]
