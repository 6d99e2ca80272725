"""Covariance of the input quantities: all probed coordinates from repeated runs, and what is known besides.

Which to use (Los 2017, 5.7): ``covariance_of_day`` for the scatter within one day, ``pooled_by_day`` for
short-term scatter from several days, ``overall`` where the differences between the days belong to the
uncertainty. Every estimate carries its degrees of freedom; sources that are not estimated from the runs (the
scale bar) join as uncorrelated inputs through ``joined``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.uncertainty.parts import Estimated
from monitor.uncertainty.roots import WithCovariance, checked_covariance, covariance_root


@dataclass(frozen=True)
class Inputs(WithCovariance):
    """The input quantities X of a model, their estimates (n,) and covariance (n, n), in internal units.

    ``sources`` names for every input where its uncertainty comes from; ``dof`` gives the degrees of freedom
    of each source's covariance (infinite where it is known, not estimated), ``estimated`` what they are of
    (``Estimated.MATRIX`` where nothing is said).
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    estimate: Array
    covariance: Array
    sources: tuple[str, ...]
    dof: Mapping[str, float] = field(default_factory=dict)
    estimated: Mapping[str, Estimated] = field(default_factory=dict)

    def __post_init__(self) -> None:
        count = len(self.names)
        for what, length in (("units", len(self.units)), ("sources", len(self.sources))):
            if length != count:
                raise DataError(f"{count} inputs need {count} {what}, but {length} are given")
        if np.shape(self.estimate) != (count,) or np.shape(self.covariance) != (count, count):
            raise DataError(
                f"{count} inputs need an estimate of shape ({count},) and a covariance of ({count}, {count}), "
                f"not {np.shape(self.estimate)} and {np.shape(self.covariance)}"
            )
        if len(set(self.names)) != count:
            twice = sorted({name for name in self.names if self.names.count(name) > 1})
            raise DataError(f"every input needs its own name, but these come twice: {', '.join(twice)}")
        unknown = sorted(set(self.dof) - set(self.sources))
        if unknown:
            raise DataError(f"degrees of freedom for '{unknown[0]}', but the sources are {set(self.sources)}")
        if not np.all(np.isfinite(self.estimate)):
            raise DataError("the estimates of the inputs must be finite")
        checked_covariance(self.covariance)

    @property
    def source_names(self) -> tuple[str, ...]:
        """Every source once, in the order of the inputs."""
        return tuple(dict.fromkeys(self.sources))

    @property
    def rank(self) -> int:
        """The rank of the covariance."""
        return covariance_root(self.covariance).rank

    def indices(self, source: str) -> npt.NDArray[np.int64]:
        """The positions of the inputs of one source."""
        indices = np.array([i for i, name in enumerate(self.sources) if name == source], dtype=np.int64)
        if not len(indices):
            raise DataError(f"no source '{source}'; there are {', '.join(self.source_names)}")
        return indices

    def degrees_of_freedom(self, source: str) -> float:
        """The degrees of freedom of one source, infinite where none are given."""
        return float(self.dof.get(source, math.inf))

    def estimated_of(self, source: str) -> Estimated:
        """Return what the degrees of freedom of one source are of."""
        return self.estimated.get(source, Estimated.MATRIX)


def overall(
    values: Array,
    names: Sequence[str],
    units: Sequence[str],
    *,
    source: str = "repeated runs",
    mean_of: int = 1,
) -> Inputs:
    """Inputs from repeated runs ``values`` (runs, n), covariance about the overall mean (GUM 4.2, 5.2.3).

    ``mean_of`` is the number of runs whose mean is used as input (1: a single run's coordinates). Raises
    DataError with fewer than two runs.
    """
    values = _checked_values(values, names)
    if len(values) < 2:
        raise DataError(f"a covariance needs at least two runs, but there is {len(values)}")
    dof = len(values) - 1
    centred = values - values.mean(axis=0)
    return _inputs(values, centred.T @ centred / dof, dof, names, units, source, mean_of)


def pooled_by_day(
    values: Array,
    days: npt.ArrayLike,
    names: Sequence[str],
    units: Sequence[str],
    *,
    source: str = "repeated runs",
    mean_of: int = 1,
) -> Inputs:
    """Inputs from ``values`` (runs, n) with the covariance pooled over days: sum (n_d - 1) S_d / sum (n_d - 1).

    Days count by their degrees of freedom (the printed words of Los 2017, 5.7.1 omit the squares: erratum
    E34). The estimate is the mean of all runs. Raises DataError where no day has two runs.
    """
    values = _checked_values(values, names)
    labels = _checked_days(values, days)
    centred = values.copy()
    present = np.unique(labels)
    for day in present:
        of_day = labels == day
        centred[of_day] -= values[of_day].mean(axis=0)
    dof = len(values) - len(present)
    if dof < 1:
        raise DataError("pooling by day needs a day with two runs or more, but every day has a single run")
    return _inputs(values, centred.T @ centred / dof, dof, names, units, source, mean_of)


def uncorrelated(
    names: Sequence[str],
    units: Sequence[str],
    estimate: npt.ArrayLike,
    u: npt.ArrayLike,
    *,
    source: str,
    dof: float = math.inf,
) -> Inputs:
    """Inputs that are correlated with nothing, such as a scale bar with its certificate's uncertainty."""
    uncertainties = np.asarray(u, dtype=np.float64)
    if np.any(~(uncertainties >= 0.0)):
        raise DataError(f"standard uncertainties must not be negative or missing, but are {uncertainties}")
    return Inputs(
        tuple(names),
        tuple(units),
        np.asarray(estimate, dtype=np.float64),
        np.diag(uncertainties**2),
        (source,) * len(names),
        {source: dof},
        {source: Estimated.SCALE},
    )


def joined(*parts: Inputs) -> Inputs:
    """All inputs of ``parts`` one after the other, uncorrelated between the parts (block-diagonal)."""
    if not parts:
        raise DataError("joining needs at least one group of inputs")
    count = sum(len(part.names) for part in parts)
    covariance = np.zeros((count, count))
    dof: dict[str, float] = {}
    estimated: dict[str, Estimated] = {}
    start = 0
    for part in parts:
        stop = start + len(part.names)
        covariance[start:stop, start:stop] = part.covariance
        start = stop
        for source in part.source_names:
            if source in dof:
                raise DataError(f"two groups of inputs both name the source '{source}'; name them apart")
            dof[source] = part.degrees_of_freedom(source)
            estimated[source] = part.estimated_of(source)
    return Inputs(
        tuple(name for part in parts for name in part.names),
        tuple(unit for part in parts for unit in part.units),
        np.concatenate([part.estimate for part in parts]),
        covariance,
        tuple(source for part in parts for source in part.sources),
        dof,
        estimated,
    )


def _checked_values(values: Array, names: Sequence[str]) -> Array:
    checked = np.asarray(values, dtype=np.float64)
    if checked.ndim != 2 or checked.shape[1] != len(names):
        raise DataError(f"values must have shape (runs, {len(names)}), not {checked.shape}")
    if not np.all(np.isfinite(checked)):
        run, column = np.argwhere(~np.isfinite(checked))[0]
        raise DataError(f"every run needs every coordinate: run row {run + 1} has no finite {names[column]}")
    return checked


def _checked_days(values: Array, days: npt.ArrayLike) -> npt.NDArray[np.int64]:
    labels = np.asarray(days)
    if labels.shape != (len(values),):
        raise DataError(f"{len(values)} runs need as many days, but days have shape {labels.shape}")
    return labels.astype(np.int64)


def _inputs(
    values: Array,
    covariance: Array,
    dof: int,
    names: Sequence[str],
    units: Sequence[str],
    source: str,
    mean_of: int,
) -> Inputs:
    if mean_of < 1:
        raise DataError(f"mean_of must be at least 1, but is {mean_of}")
    return Inputs(
        tuple(names),
        tuple(units),
        values.mean(axis=0),
        covariance / mean_of,
        (source,) * len(names),
        {source: float(dof)},
    )
