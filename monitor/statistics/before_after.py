"""Did a quantity change between two stretches of runs by the same method, before and after an event?

Whatever both share, as the scale of the bar or the form of the probe, drops out of their difference and has no part in
its
uncertainty: what is left is the scatter of the runs, divided by their number, and that of the days where a side has
several. Judged by E_n with the expanded uncertainty at 95 % for the degrees of freedom that there are, so that of
machines that did not change one in twenty is said to have. Compare results of different methods, which share less, with
``normalised_error``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.checks import as_vector
from monitor.statistics.mixed import fit_with_days
from monitor.statistics.sums import label_groups

#: Probability with which the expanded uncertainty holds the difference of a machine that did not change.
LEVEL = 0.95


@dataclass(frozen=True)
class BeforeAfter:
    """``difference`` of the means, after less before, in the unit of the values; ``u`` with ``dof``, ``k`` for 95 %.

    ``u_before`` and ``u_after`` are those of the two means. ``between`` is the standard deviation of the days, None
    where
    each side has one: then the difference of the machine and that of the two days are one, and ``u`` is of runs alone.
    """

    before: float
    after: float
    u_before: float
    u_after: float
    difference: float
    u: float
    dof: float
    k: float
    between: float | None

    @property
    def expanded(self) -> float:
        """Expanded uncertainty of the difference."""
        return self.k * self.u

    @property
    def e_n(self) -> float:
        """The difference in units of its expanded uncertainty."""
        return self.difference / self.expanded

    @property
    def agree(self) -> bool:
        """Whether the difference is no larger than its expanded uncertainty."""
        return abs(self.e_n) <= 1.0


def before_after(
    before: npt.ArrayLike, after: npt.ArrayLike, days_before: npt.ArrayLike, days_after: npt.ArrayLike
) -> BeforeAfter:
    """Compare runs (n,) before with runs (m,) after an event, of the days (n,) and (m,).

    A day that the event cuts in two counts on both sides: its two halves share what is of the day only in part, which
    is neglected. Raises ``DataError`` where no day has two runs and neither side two days, or where nothing scatters.
    Measured: docs/trials-statistics.md.
    """
    x, y = as_vector(before, "before"), as_vector(after, "after")
    sides = [label_groups(days, len(column))[1] for days, column in ((days_before, x), (days_after, y))]
    day = np.concatenate([sides[0], sides[1] + int(sides[0].max()) + 1])
    values = np.concatenate([x, y])
    # Of each side its own mean: what the two columns have for coefficients, and uncertainties.
    is_after = np.arange(len(values)) >= len(x)
    design = np.column_stack([~is_after, is_after]).astype(np.float64)
    count = int(day.max()) + 1
    if len(values) - 2 < 1 or len(values) == 2:
        raise DataError(
            f"{len(x)} run(s) before and {len(y)} after say nothing of their scatter; three are needed."
        )
    # One day a side: of the days nothing is known, and every run counts for itself.
    fit = fit_with_days(values, design, None, day if count > 2 else np.arange(len(values)))
    means = fit.coefficients
    u = float(np.sqrt(fit.covariance[0, 0] + fit.covariance[1, 1] - 2.0 * fit.covariance[0, 1]))
    if np.ptp(x) == 0.0 and np.ptp(y) == 0.0:
        raise DataError("no run differs from the others of its side; the difference has no uncertainty.")
    dof = _dof(fit.covariance, fit.dof)
    return BeforeAfter(
        before=float(means[0]),
        after=float(means[1]),
        u_before=float(fit.u[0]),
        u_after=float(fit.u[1]),
        difference=float(means[1] - means[0]),
        u=u,
        dof=dof,
        k=-float(scipy.special.stdtrit(dof, (1.0 - LEVEL) / 2.0)),
        between=float(fit.between) if count > 2 else None,
    )


def _dof(covariance: Array, dof: Array) -> float:
    """Degrees of freedom of the difference: those of the two means, which rest on one estimate of the scatter."""
    return float(dof[int(np.argmax(np.diag(covariance)))])
