"""Errors of instruments that the readings cannot tell from errors of the machine that are free in every run.

A laser alone reads a wrong scale as a gain of its axis: nothing of the scale is left to be searched for, and the gain
is reported. Such an effect is named with the parameters that do the same.
"""

from __future__ import annotations

import numpy as np

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.effects import InstrumentEffect
from monitor.methods.chain.identification import TakenUp
from monitor.records import Array

#: Parameters that make less than this part of an effect are rounding, and products of small errors.
LEAST_PART = 1e-2


def taken_for_machine(scene: ChainScene) -> tuple[TakenUp, ...]:
    """The errors of instruments that leave nothing to see, with the base parameters that do the same."""
    hidden = [
        candidate
        for candidate in scene.candidates
        if isinstance(candidate.effect, InstrumentEffect)
        and not candidate.visible
        and not candidate.effect.driver_text
    ]
    aliases = (TakenUp(candidate.family, _members(scene.fit, candidate)) for candidate in hidden)
    return tuple(alias for alias in aliases if alias.by)


def _members(fit: Fit, candidate: ChainCandidate) -> tuple[str, ...]:
    """The base parameters that do, together with unknowns of the setups, what a candidate does in the first run."""
    problem = fit.problem
    whole = fit.solution.last.local[0]
    of_machine = fit.solution.local_free[0][: len(problem.base_names)]
    names = [name for name, is_free in zip(problem.base_names, of_machine, strict=True) if is_free]
    # Unknowns of the setups that do it alone leave nothing to the machine.
    of_setups = whole[:, len(problem.base_names) :]
    local = np.hstack([whole[:, : len(problem.base_names)][:, of_machine], of_setups])
    columns = whitened(fit, candidate)
    members: dict[str, None] = {}
    scale = np.linalg.norm(local, axis=0)
    for column in columns.T:
        length = float(np.linalg.norm(column))
        if length == 0.0 or _left(of_setups, column) < LEAST_PART * length:
            continue
        shares = np.linalg.lstsq(local / np.where(scale == 0.0, 1.0, scale), column / length, rcond=1e-9)[0]
        members |= dict.fromkeys(
            name for name, share in zip(names, shares, strict=False) if abs(share) > LEAST_PART
        )
    return tuple(members)


def _left(columns: Array, column: Array) -> float:
    """The length of what columns (N, q) leave of a column (N,)."""
    solved = np.linalg.lstsq(columns, column, rcond=1e-9)[0]
    return float(np.linalg.norm(column - columns @ solved))


def whitened(fit: Fit, candidate: ChainCandidate) -> Array:
    """The whitened columns (N, k) of a candidate in the first run, zero for what is known beforehand."""
    problem = fit.problem
    white = problem.padded(candidate.raw / problem.sigma[:, :, None])[0]
    columns = np.zeros((len(fit.solution.last.local[0]), white.shape[1]))
    columns[: len(white)] = white
    return columns
