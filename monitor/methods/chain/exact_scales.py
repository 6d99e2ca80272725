"""What hangs on scales that are taken as exact: of lasers, trackers, cameras, CMMs.

A compensation of the wavelength that is wrong by 1 K of air or 3.5 hPa makes every length wrong by 1 um/m, of a gain by
a laser three standard uncertainties of what its readings say, and where no second unit of length stands beside it no
reading shows that.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from monitor.methods.chain.identification import AsStated
from monitor.methods.chain.least_squares import MEMBER_SHARE, RANK_TOLERANCE, eliminate, inverse_of
from monitor.methods.chain.problem import ChainProblem
from monitor.records import Array
from monitor.sources import SCALE
from monitor.units import METRE, MICROMETRE

#: A scale that is off by so much, as by 1 K of air, moves a number by this part of its u or more, or it is not named.
OFF, MOVED = MICROMETRE.per(METRE).to_internal(1.0), 0.1


def exact_scales(
    problem: ChainProblem, lengths: Mapping[str, tuple[tuple[str, ...], Array]]
) -> Iterator[AsStated]:
    """The instruments whose scale moves numbers, with these, in the fit with what is known beforehand of all others.

    ``lengths`` are by the name of an instrument its setups and the lengths (n, d) mm that it read, 0 for what is none.
    """
    if not lengths:
        return
    at = problem.linearise(problem.start, problem.common_start)
    for name, (setups, of_instrument) in lengths.items():
        columns = problem.padded(of_instrument / problem.sigma)
        moved: dict[str, None] = {}
        for read, local, common in zip(columns, at.local, at.common, strict=True):
            column = np.zeros(len(local))
            column[: len(read)] = read
            moved |= dict.fromkeys(_moved_by(column, np.hstack([local, common]), problem.base_names))
        if moved:
            yield AsStated(name, setups, {SCALE: tuple(moved)})


def _moved_by(column: Array, jacobian: Array, names: tuple[str, ...]) -> Iterator[str]:
    """The determined errors that a scale with the whitened ``column`` (N,) moves by more than a part of their u."""
    inverse = inverse_of(jacobian, RANK_TOLERANCE)[: len(names)]
    is_open = np.abs(eliminate(jacobian[None]).null_space[0][:, : len(names)]).max(axis=0, initial=0.0)
    change, u = OFF * np.abs(inverse @ column), np.linalg.norm(inverse, axis=1)
    for name, by, least, is_free in zip(names, change, MOVED * u, is_open < MEMBER_SHARE, strict=True):
        if is_free and by > least:
            yield name
