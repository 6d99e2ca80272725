"""Refuses a solution that is that of another machine than the file describes: errors that are none of a machine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from monitor.exceptions import DataError
from monitor.methods.chain.least_squares import Solution
from monitor.methods.chain.measured import LARGEST_GAIN, MeasuredChain
from monitor.methods.chain.mistaken_unit import mistaken_unit

#: A gain is told for certain beyond its limit by so many standard uncertainties.
CERTAIN = 4.0


@dataclass(frozen=True)
class Limited:
    """An error that cannot be large: its ``name``, its ``column`` among a run's unknowns, whether it is a gain."""

    name: str
    column: int
    is_gain: bool


def refuse_another_machine(problem: MeasuredChain, solution: Solution, limited: Sequence[Limited]) -> None:
    """Raise DataError where a location angle or a gain comes out too large to be an error, or too much is left.

    The largest of all runs is named, and how many runs have one.
    """
    columns = [each.column for each in limited]
    free = solution.local_free[:, columns]
    small = (
        np.zeros(free.shape[1], dtype=bool) if problem.stays_small is None else problem.stays_small[columns]
    )
    errors = np.where(free | small, solution.local[:, columns], 0.0)
    gains = np.array([each.is_gain for each in limited], dtype=bool)
    too_large = np.abs(errors) > np.where(free, problem.largest_error, LARGEST_GAIN)
    u = np.sqrt(np.diagonal(solution.local_covariance, axis1=-2, axis2=-1)[:, columns])
    certain = free & gains & (np.abs(errors) - CERTAIN * u > problem.largest_gain)
    # A bar of another length is one in all runs; of one run of several a reading may be wrong, and is sought. Of two
    # halves neither tells which is wrong.
    too_large |= certain & (certain.mean(axis=0) >= 0.5)
    if too_large.any():
        run, which = np.unravel_index(int((np.abs(errors) * too_large).argmax()), errors.shape)
        largest, error = limited[int(which)], float(errors[run, which])
        others = int(too_large.any(axis=1).sum()) - 1
        alike = f" ({others} other run{'s' * (others > 1)} too)" if others else ""
        unit, looks, of_bar = "rad", "", ""
        if largest.is_gain:
            unit, of_run = "mm/mm", errors[run, free[run] & gains]
            if error > -1.0 and of_run.size:
                looks = mistaken_unit(error, of_run, has_bar=bool(problem.measured_joints))
            if problem.measured_joints and problem.extra_names:
                of_bar = ", the length of the bar"
        raise DataError(
            f"run {problem.runs[run]}{alike}: {largest.name} comes out at {error:.3g} {unit}, which is "
            f"no error of a machine: the readings contradict the machine file{looks}; check the axis signs, the "
            f"topology, the units, the columns{of_bar} and the order of the targets"
        )
    wrong = problem.contradiction(solution)
    if wrong is not None:
        raise DataError(f"the readings contradict the machine file: {wrong}")
