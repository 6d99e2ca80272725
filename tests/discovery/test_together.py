"""Columns of candidates one below the other: the same rows, without a copy of those that were cut from one array."""

from __future__ import annotations

import numpy as np

from monitor.discovery.search.together import WORTH_A_BLOCK, together


def test_parts_of_one_array_are_that_array_again_and_others_are_copied_in_their_order() -> None:
    rng = np.random.default_rng(1)
    whole = rng.standard_normal((3 * WORTH_A_BLOCK, 7))
    cut = [whole[first : first + 3] for first in range(0, len(whole), 3)]
    alone = [rng.standard_normal((2, 7)) for _ in range(4)]
    turned = np.asfortranarray(rng.standard_normal((4, 7)))[:2]
    # A part that is missing ends a block, and so does an order that is not that of the array.
    parts = [*alone[:2], *cut[:40], *alone[2:], turned, *cut[41:], cut[40]]
    blocks = together(parts)
    assert np.array_equal(np.concatenate(blocks), np.concatenate(parts))
    shared = [block for block in blocks if np.shares_memory(block, whole)]
    assert [len(block) for block in shared] == [120, 69]
    assert len(blocks) == 5


def test_parts_of_runs_that_follow_each_other_are_cut_from_their_numbers() -> None:
    """Columns are made as (k, R, m) and stand as (k, R m)."""
    numbers = np.arange(2.0 * WORTH_A_BLOCK * 3 * 5).reshape(2 * WORTH_A_BLOCK, 3, 5)
    flat = numbers.reshape(len(numbers), 15)
    (block,) = together([flat[first : first + 2].T.T for first in range(0, len(flat), 2)])
    assert np.shares_memory(block, numbers)
    assert np.array_equal(block, flat)
    assert together([]) == ()
