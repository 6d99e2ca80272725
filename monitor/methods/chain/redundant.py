"""Coefficients of several effects of one error that do the same: held at zero, so that the others have numbers.

The weights of all links contain the load at the flange, and a first harmonic of a joint part of both. What the effects
of one error do together is determined then, only their shares are not: each coefficient that the ones before it can
replace, in the order of the model, is held at zero and named with what takes its part up. Effects of different errors
that cannot be told apart get no number, as before: which of them it is would be a guess.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain

import numpy as np
import numpy.typing as npt

from monitor.effects import ChainEffect
from monitor.methods.chain.added_effects import Added, columns_of
from monitor.methods.chain.least_squares import (
    COMMON_RANK_TOLERANCE,
    Linearisation,
    eliminate,
    project_out,
)
from monitor.records import Array


def several_of_an_error(shared: Sequence[Added]) -> bool:
    """Whether any error has several of the added effects."""
    return bool(_groups(shared))


def held_at_zero(shared: Sequence[Added], at: Linearisation) -> npt.NDArray[np.bool_]:
    """Mark the common unknowns (c,) of the added effects that earlier ones of the same error can replace."""
    held = np.zeros(at.common.shape[-1], dtype=bool)
    remainder: Array | None = None
    for group in _groups(shared):
        remainder = _scaled_remainder(at) if remainder is None else remainder
        for number, column in enumerate(group):
            before = [earlier for earlier in group[:number] if not held[earlier]]
            held[column] = _is_replaced(remainder[:, before], remainder[:, column])
    return held


def replaced_by(
    shared: Sequence[Added], at: Linearisation, held: npt.NDArray[np.bool_], column: int
) -> tuple[str, ...]:
    """The names of the unknowns that take the part of one held at zero: of those before it of its error."""
    group = next(group for group in _groups(shared) if column in group)
    before = [earlier for earlier in group if earlier < column and not held[earlier]]
    remainder = _scaled_remainder(at)
    shares = np.linalg.lstsq(remainder[:, before], remainder[:, column], rcond=COMMON_RANK_TOLERANCE)[0]
    names = [name for added in shared for name in added.names()]
    large = np.abs(shares) > COMMON_RANK_TOLERANCE * np.abs(shares).max(initial=0.0)
    return tuple(names[earlier] for earlier, is_member in zip(before, large, strict=True) if is_member)


def without_held(at: Linearisation, held: npt.NDArray[np.bool_]) -> Linearisation:
    """A linearisation in which what is held does nothing."""
    if not held.any():
        return at
    return Linearisation(at.residual, at.local, np.where(held, 0.0, at.common))


def _groups(shared: Sequence[Added]) -> list[list[int]]:
    """The coefficients of each error that has several effects, in the order of the model; time constants aside."""
    of_error: dict[str, list[range]] = {}
    for added, columns in zip(shared, columns_of(each.unknowns for each in shared), strict=True):
        if isinstance(added.effect, ChainEffect):
            part = range(columns.start, columns.start + added.size)
            of_error.setdefault(added.effect.term.symbol, []).append(part)
    return [list(chain.from_iterable(parts)) for parts in of_error.values() if len(parts) > 1]


def _scaled_remainder(at: Linearisation) -> Array:
    """What single runs leave of the common unknowns' columns (M, c), in parts of their lengths."""
    count = at.common.shape[-1]
    scale = np.linalg.norm(at.common.reshape(-1, count), axis=0)
    remainder = project_out(eliminate(at.local).basis, at.common).reshape(-1, count)
    return np.asarray(remainder / np.where(scale == 0.0, 1.0, scale))


def _is_replaced(before: Array, column: Array) -> bool:
    """Whether columns (M, b) do what a column (M,) does, which does something."""
    size = float(np.linalg.norm(column))
    if size <= COMMON_RANK_TOLERANCE or before.shape[1] == 0:
        return False
    basis, values, _ = np.linalg.svd(before, full_matrices=False)
    basis = basis[:, values > COMMON_RANK_TOLERANCE]
    rest = column - basis @ (basis.T @ column)
    return bool(np.linalg.norm(rest) <= COMMON_RANK_TOLERANCE * max(1.0, size))
