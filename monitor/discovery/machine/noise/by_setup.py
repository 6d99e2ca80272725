"""Noise of neighbours where setups may contradict each other: what each of them leaves when it is fitted by itself.

A setup that was read otherwise than its file says leaves something smooth in the common fit, which would pass for noise
that hardly changes. Fitted by itself it leaves noise alone, whatever the others say.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.noise.whitening import Whitening
from monitor.methods.chain.least_squares import eliminate, project_out
from monitor.records import Array


def whitening_by_setup(fit: Fit) -> Whitening | None:
    """Return the filter of the noise that setups leave by themselves; None where it is white, or there is one setup."""
    if fit.rows.begins is None:
        return None
    basis = _unknowns_by_setup(fit)
    alone = project_out(basis, fit.solution.last.residual[..., None])[..., 0]
    correlation = replace(fit.noise_design, basis=basis).correlation(alone)
    return None if correlation is None else Whitening(fit.rows, correlation)


def _unknowns_by_setup(fit: Fit) -> Array:
    """An orthonormal basis (R, N, p) of what is unknown in every run, where every setup has unknowns of its own."""
    problem, last, rows = fit.problem, fit.solution.last, fit.rows
    unknowns = last.local if len(last.local) > 1 else np.concatenate([last.local, last.common], axis=2)
    # Behind the setup of every touch, counted from one, stands what is no reading.
    of_touch = problem.padded(problem.series[:, None].astype(np.float64) + 1.0).reshape(rows.weighted.shape)
    setup = np.zeros(last.residual.shape)
    setup[:, : rows.count] = np.repeat(of_touch, rows.numbers, axis=1)
    columns = np.concatenate(
        [unknowns * (setup == number)[..., None] for number in np.unique(of_touch[of_touch > 0.0])], axis=2
    )
    basis = eliminate(columns[:, :, np.any(columns != 0.0, axis=(0, 1))]).basis
    return np.asarray(basis[:, :, np.any(basis != 0.0, axis=(0, 1))])
