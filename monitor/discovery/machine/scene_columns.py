"""The columns of many effects as the scan sees them, made term by term: what the machine does with an error is the same
for all effects of that error, and a block of a few dozen columns stays in the cache of a core from its first step to
its last.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from monitor.discovery.machine.fit import Fit
from monitor.discovery.search.candidate import SMALLEST_SHARE
from monitor.effects import Basis
from monitor.effects.effect import ChainBasis
from monitor.records import Array

#: A unit of a coefficient (1 mm, 1 rad) that moves the tip by less than this, in mm, is a sine of 180 degrees.
ROUNDING = 1e-9
#: Effects of an error whose columns are made together: thousands of pitches of a long axis would stand in memory three
#: times, and in no cache.
AT_ONCE = 100


@dataclass(frozen=True)
class EffectColumns:
    """One effect: ``columns`` (k, M) whitened, what every run's own unknowns can do taken out; ``share`` the largest
    part that remains; ``peak`` mm the largest displacement that a unit of any coefficient causes at any probing."""

    columns: Array
    share: float
    peak: float


@dataclass(frozen=True)
class _Displacements:
    """The displacement (k, n d) mm of the rows' numbers for a unit of each coefficient of effects; zero where all of it
    is rounding. ``peaks`` (k,) are the largest of a row."""

    moved: Array
    peaks: Array


def raw_columns(fit: Fit, basis: Basis) -> Array:
    """The displacement (k, n, d) in mm at every probing for a unit of each coefficient."""
    moved = _displacements(fit, basis).moved
    return moved.reshape(len(moved), *fit.problem.sigma.shape)


def raw_lengths(fit: Fit, basis: Basis) -> Array:
    """The lengths (k,) in mm of those displacements over all probings."""
    if isinstance(basis, ChainBasis):
        squares = np.sum(_direction(fit, basis) ** 2, axis=1)
        return np.asarray(np.sqrt(squares @ basis.columns**2))
    return np.asarray(np.linalg.norm(_displacements(fit, basis).moved, axis=1))


def _direction(fit: Fit, basis: ChainBasis) -> Array:
    """How the rows (n, d) move with the error of a basis."""
    term = basis.term
    direction: Array = fit.observed_by_error[:, :, term.joint, term.stage, term.component]
    return direction


def _displacements(fit: Fit, basis: Basis) -> _Displacements:
    if isinstance(basis, ChainBasis):
        direction = _direction(fit, basis)
        columns = np.ascontiguousarray(basis.columns.T)
        sizes = np.abs(columns)
        columns[(sizes * np.abs(direction).max(axis=1)).max(axis=1, initial=0.0) < ROUNDING] = 0.0
        peaks = (np.abs(columns) * np.sqrt(np.sum(direction**2, axis=1))).max(axis=1, initial=0.0)
        # Repeated first: products along three numbers of a row at a time would take four times as long.
        moved = np.repeat(columns, direction.shape[1], axis=1)
        moved *= direction.reshape(-1)
        return _Displacements(moved, peaks)
    moved = np.ascontiguousarray(np.moveaxis(fit.moved_by(basis), 2, 0))
    moved[np.abs(moved).max(axis=(1, 2), initial=0.0) < ROUNDING] = 0.0
    peaks = np.sqrt(np.sum(moved**2, axis=2)).max(axis=1, initial=0.0)
    return _Displacements(moved.reshape(len(moved), -1), peaks)


def columns_of(fit: Fit, bases: Sequence[Basis]) -> list[EffectColumns]:
    """The columns of every effect, in the order given."""
    layout = _Layout(fit)
    every: dict[int, EffectColumns] = {}
    for members in _of_one_term(bases):
        every |= _block(layout, {member: bases[member] for member in members})
    return [every[index] for index in range(len(bases))]


def _of_one_term(bases: Sequence[Basis]) -> Iterator[list[int]]:
    """The effects that share what the machine does with their error, by their places in the list, so many at once;
    others alone."""
    terms: dict[object, list[int]] = {}
    for index, basis in enumerate(bases):
        terms.setdefault(basis.term if isinstance(basis, ChainBasis) else index, []).append(index)
    for members in terms.values():
        for start in range(0, len(members), AT_ONCE):
            yield members[start : start + AT_ONCE]


def _block(layout: _Layout, bases: Mapping[int, Basis]) -> dict[int, EffectColumns]:
    """The columns of the effects of one term, or of one that has none."""
    fit = layout.fit
    first = next(iter(bases.values()))
    if isinstance(first, ChainBasis):
        stacked = np.concatenate([basis.columns for basis in bases.values()], axis=1)  # type: ignore[union-attr]
        first = ChainBasis(first.term, stacked)
    displacements = _displacements(fit, first)
    projected, before = layout.projected(displacements.moved)
    scale = np.where(before == 0, 1.0, before)
    shares = np.sqrt(np.einsum("km,km->k", projected, projected)) / scale
    columns = {}
    start = 0
    for index, basis in bases.items():
        rows = slice(start, start + basis.size)
        start += basis.size
        significant, share = _significant(projected[rows], scale[rows], float(shares[rows][0]))
        columns[index] = EffectColumns(significant, share, float(displacements.peaks[rows].max(initial=0.0)))
    return columns


class _Layout:
    """Where the rows of a fit stand among the whitened numbers of its runs."""

    def __init__(self, fit: Fit) -> None:
        self.fit = fit
        self._shape: tuple[int, int] = fit.solution.last.residual.shape

    @cached_property
    def _weights(self) -> Array:
        return np.asarray(1.0 / self.fit.problem.sigma)

    @cached_property
    def _is_straight(self) -> bool:
        """Whether the rows are in the order of the whitened numbers: one run after another, all of one length."""
        return np.array_equal(self.fit.sources.reshape(-1), np.arange(self._weights.size))

    def projected(self, moved: Array) -> tuple[Array, Array]:
        """Whitened columns (k, M) of displacements (k, n d), less what every run's own unknowns can do, and their
        lengths (k,) before."""
        runs, numbers = self._shape
        white = moved * self._weights.reshape(-1)
        projected = np.zeros((len(moved), runs, numbers))
        sources = self.fit.sources
        target = projected[:, :, : sources.shape[1]]
        if self._is_straight:
            target[...] = white.reshape(len(moved), *sources.shape)
        else:
            target[...] = white[:, np.maximum(sources, 0)]
            target[:, sources < 0] = 0.0
        if self.fit.whitening is not None:
            projected = self.fit.whitening(projected)
        before = np.sqrt(np.einsum("krn,krn->k", projected, projected))
        for run, basis in enumerate(self.fit.nuisance.basis):
            part = projected[:, run]
            part -= (part @ basis) @ basis.T
        return projected.reshape(len(moved), runs * numbers), before


def _significant(projected: Array, scale: Array, first: float) -> tuple[Array, float]:
    """Rows (k, M) without the directions of which nothing remains, and the largest share of ``scale`` (k,) that
    remains; ``first`` is that of the first row."""
    if len(projected) == 1:
        return (projected if first > SMALLEST_SHARE else np.zeros_like(projected)), first
    values, vectors = np.linalg.eigh(projected @ projected.T / (scale[:, None] * scale))
    share = float(np.sqrt(max(values.max(initial=0.0), 0.0)))
    if values.min(initial=1.0) > SMALLEST_SHARE**2:
        return projected, share
    keep = vectors[:, values > SMALLEST_SHARE**2]
    cleaned: Array = (keep @ keep.T) @ (projected / scale[:, None])
    # A coefficient of which nothing remains (a ball touched once) must not come back as rounding at full length.
    cleaned[np.sqrt(np.einsum("km,km->k", cleaned, cleaned)) <= SMALLEST_SHARE] = 0.0
    cleaned *= scale[:, None]
    return cleaned, share
