"""The results that a certificate or a report prints, in display units, as they were stored.

A ``ResultSet`` is what one evaluation says of one state of the machine (as found, as left). ``result_set``
makes it from numbers in internal units; nothing is evaluated here.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.reporting.symbols import describe
from monitor.reporting.texts import Texts
from monitor.units import Unit


@dataclass(frozen=True)
class RefusedParameters:
    """Parameters without a number, and why."""

    parameters: tuple[str, ...]
    why: str


@dataclass(frozen=True)
class ResidualSummary:
    """RMS of the residuals over groups of probings, and the probe's stated standard uncertainty, all in µm.

    ``by`` says in words what the groups are: target, axis or run.
    """

    by: str
    labels: tuple[str, ...]
    rms_um: tuple[float, ...]
    probe_um: float | None = None


@dataclass(frozen=True, eq=False)
class ResultSet:
    """Estimates and joint uncertainty of m parameters, in their display units.

    ``state`` of the machine that they describe: as found, as left. ``estimate`` (m,), ``covariance`` (m, m) in
    products of the display units. ``k_q`` is the coverage factor of the hyper-rectangle, ``k_p`` that of the
    hyper-ellipsoid of ``rank`` dimensions, both for probability ``p`` (JCGM 102:2011 6.5). ``evaluation``
    names the way the uncertainty was found, with its clause. ``trials`` and ``validation`` belong to Monte
    Carlo. ``tolerances`` (m,) are limits of absolute values, NaN where there is none. ``dof``: degrees of freedom of
    the covariance, for which the factors hold (Student, Hotelling); not finite where it is known.
    """

    state: str
    names: tuple[str, ...]
    descriptions: tuple[str, ...]
    units: tuple[str, ...]
    estimate: Array
    covariance: Array
    p: float
    k_p: float
    k_q: float
    rank: int
    evaluation: str
    refused: tuple[RefusedParameters, ...] = ()
    residuals: ResidualSummary | None = None
    trials: int | None = None
    validation: str | None = None
    tolerances: Array | None = None
    dof: float = math.inf

    @property
    def u(self) -> Array:
        """Standard uncertainties (m,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def expanded(self) -> Array:
        """U = k_q u (m,)."""
        return self.k_q * self.u

    @property
    def correlation(self) -> Array:
        """Correlation matrix (m, m), exactly 1 on its diagonal."""
        u = self.u
        matrix = self.covariance / np.outer(u, u)
        np.fill_diagonal(matrix, 1.0)
        return np.asarray(matrix)

    @property
    def half_axes(self) -> Array:
        """Half-axes of the ellipsoid in the coordinates (y_j - estimate_j)/u_j, the longest first."""
        return np.asarray(self.k_p * np.sqrt(np.clip(np.linalg.eigvalsh(self.correlation)[::-1], 0.0, None)))

    def gaps(self) -> tuple[str, ...]:
        """Which statements a certificate needs and this result lacks."""
        needed = {
            "state of the machine (as found, as left)": self.state,
            "how the uncertainty was evaluated": self.evaluation,
            "at least one parameter with a number": self.names,
        }
        return tuple(
            what for what, value in needed.items() if not (value.strip() if isinstance(value, str) else value)
        )


def result_set(
    names: Sequence[str],
    units: Sequence[Unit],
    estimate: npt.ArrayLike,
    covariance: npt.ArrayLike,
    *,
    state: str,
    p: float,
    k_p: float,
    k_q: float,
    rank: int,
    evaluation: str,
    descriptions: Mapping[str, str] | None = None,
    refused: Sequence[RefusedParameters] = (),
    residuals: ResidualSummary | None = None,
    trials: int | None = None,
    validation: str | None = None,
    tolerances: Mapping[str, float] | None = None,
    dof: float = math.inf,
    texts: Texts | None = None,
) -> ResultSet:
    """A result to print from ``estimate`` (m,) and ``covariance`` (m, m) in internal units.

    Parameters named in ``refused`` are left out of the numbers. ``tolerances`` are in display units by name.
    What has no word in ``descriptions`` is described in the language of ``texts`` (English without).
    Raises DataError where shapes differ, a number is not finite, a factor is not positive or a variance is
    not positive: such a result cannot be certified.
    """
    every = np.asarray(estimate, dtype=np.float64)
    matrix = np.asarray(covariance, dtype=np.float64)
    count = len(names)
    if every.shape != (count,) or matrix.shape != (count, count) or len(units) != count:
        raise DataError(
            f"{count} parameters need as many units and estimates and a covariance of shape ({count}, {count}), "
            f"not {len(units)}, {every.shape} and {matrix.shape}"
        )
    without = {name for refusal in refused for name in refusal.parameters}
    kept = [place for place, name in enumerate(names) if name not in without]
    factor = np.array([units[place].factor for place in kept])
    shown = every[kept] / factor
    spread = matrix[np.ix_(kept, kept)] / np.outer(factor, factor)
    chosen = tuple(names[place] for place in kept)
    _check_numbers(chosen, shown, spread, p, k_p, k_q)
    words = descriptions or {}
    limits = None
    if tolerances is not None:
        limits = np.array([tolerances.get(name, math.nan) for name in chosen])
    return ResultSet(
        state=state,
        names=chosen,
        descriptions=tuple(words.get(name, describe(name, texts)) for name in chosen),
        units=tuple(units[place].name for place in kept),
        estimate=shown,
        covariance=spread,
        p=p,
        k_p=k_p,
        k_q=k_q,
        rank=rank,
        evaluation=evaluation,
        refused=tuple(refused),
        residuals=residuals,
        trials=trials,
        validation=validation,
        tolerances=limits,
        dof=dof,
    )


def _check_numbers(
    names: tuple[str, ...], estimate: Array, covariance: Array, p: float, k_p: float, k_q: float
) -> None:
    for place, name in enumerate(names):
        if not math.isfinite(estimate[place]) or not np.all(np.isfinite(covariance[place])):
            raise DataError(f"parameter {name} has no finite number; name it among the refused parameters")
        if not covariance[place, place] > 0.0:
            raise DataError(
                f"parameter {name} has the variance {covariance[place, place]:g}; it must be positive"
            )
    if not 0.0 < p < 1.0:
        raise DataError(f"the coverage probability p must lie between 0 and 1, but is {p}")
    for symbol, factor in (("k_p", k_p), ("k_q", k_q)):
        if not (math.isfinite(factor) and factor > 0.0):
            raise DataError(f"the coverage factor {symbol} must be positive and finite, but is {factor}")
