"""The answer to the question for statistics of a campaign's runs: what is shown and what is stored.

Numbers of a parameter are in its display unit; a number that does not exist is None.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from monitor.documents import OMITTED, WORDED, Said
from monitor.records import Array
from monitor.reporting.lacks import Lack

#: Below this false discovery rate of ANOVA the groups differ in a parameter.
DIFFERENT = 0.001


@dataclass(frozen=True)
class NoVarianceComponents:
    """Why the components of variance of a parameter were not estimated."""

    why: Lack = field(metadata=WORDED)


@dataclass(frozen=True)
class VarianceComponents:
    """Standard deviations between and within the groups, with 95 % intervals; ``why`` is None.

    A negative estimate is given as zero and marked ``truncated``; its interval still holds.
    """

    why: None
    between: float
    between_interval: tuple[float | None, ...]
    truncated: bool
    within: float
    within_interval: tuple[float | None, ...]
    u_run_on_a_day_of_its_own: float
    degrees_of_freedom: float | None


@dataclass(frozen=True)
class ParameterStatistics:
    """Statistics of one parameter over ``n`` runs: of all, pooled over the groups, by group (which a key calls day).

    ``bartlett_p`` and ``levene_p`` belong to equal variances, ``anova_p``, ``welch_p``, ``brown_forsythe_p`` and
    ``kruskal_p`` to equal means; the false discovery rates ``anova_q`` and ``bartlett_q`` are those among all
    parameters.
    ``anova_q`` holds whatever the scatter of the groups: it rests on the larger p-value of Welch and of Brown and
    Forsythe.
    """

    unit: str
    n: int
    mean: float
    u_all: float
    u_pooled: float
    u_by_day: Mapping[str, float | None]
    mean_by_day: Mapping[str, float]
    dof_all: int
    dof_pooled: int
    bartlett_p: float | None
    levene_p: float | None
    anova_p: float | None
    welch_p: float | None
    brown_forsythe_p: float | None
    kruskal_p: float | None
    anova_q: float | None
    bartlett_q: float | None
    normality_p: float | None
    components: VarianceComponents | NoVarianceComponents


@dataclass(frozen=True)
class NoVectorTest:
    """Why a test of all parameters together was not made."""

    why: str
    p_value: None = None


@dataclass(frozen=True)
class VectorTestAnswer:
    """A test of all parameters together; ``why`` is None."""

    why: None
    name: str
    statistic: float | None
    f: float | None
    degrees_of_freedom: tuple[float | None, float | None]
    p_value: float | None


@dataclass(frozen=True)
class VectorTests:
    """Box's M (equal covariances) and MANOVA (equal means; Hotelling's T² for two groups)."""

    box_m: VectorTestAnswer | NoVectorTest
    manova: VectorTestAnswer | NoVectorTest


@dataclass(frozen=True)
class ParameterDrift:
    """The slope of one parameter within the days, and how its scatter compares with the stated uncertainty."""

    per_hour: float
    u: float
    unit: str
    p_value: float
    q_value: float
    scatter_over_stated: float


@dataclass(frozen=True, kw_only=True)
class SessionDrift:
    """Which parameters drift within the days; empty, with the reason under ``why``, where the runs do not suffice."""

    why: Lack | None = field(metadata=WORDED)
    drifts: tuple[str, ...]
    degrees_of_freedom: float | None = field(default=None, metadata=OMITTED)
    common_scatter: float | None = field(default=None, metadata=OMITTED)
    parameters: Mapping[str, ParameterDrift]


@dataclass(frozen=True)
class HistogramAnswer:
    """How many coordinates have a p-value in each twentieth from 0 to 1, and how many are expected of equal groups."""

    edges: tuple[float, ...]
    counts: tuple[int, ...]
    expected: float


@dataclass(frozen=True, eq=False, kw_only=True)
class CoordinateStatistics:
    """Statistics of the ``n`` probed coordinates ``names``, µm; ``why`` says why there are none."""

    n: int
    why: Said | None = field(default=None, metadata=OMITTED)
    names: tuple[str, ...] | None = field(default=None, metadata=OMITTED)
    u_all_um: Array | None = field(default=None, metadata=OMITTED)
    u_pooled_um: Array | None = field(default=None, metadata=OMITTED)
    u_by_day_um: Mapping[str, Array] | None = field(default=None, metadata=OMITTED)
    bartlett_p: tuple[float | None, ...]
    anova_p: tuple[float | None, ...]
    normality_p: tuple[float | None, ...] | None = field(default=None, metadata=OMITTED)
    histograms: Mapping[str, HistogramAnswer]


@dataclass(frozen=True, eq=False)
class GroupCorrelation:
    """Correlation matrix of the parameters within one group."""

    degrees_of_freedom: int
    correlation: Array


@dataclass(frozen=True, eq=False)
class StatisticsAnswer:
    """Statistics of a campaign's runs. ``groups`` has the number of runs by group; correlation matrices are over the
    parameters in ``parameter_order``. ``seed`` is that of the test of normality; ``refers_to`` says in words what the
    parameters are relative to, those that are errors of the chain. ``copied_readings`` says which of its runs equal
    those of another campaign, and which rows of a run earlier ones: no part of what is stored."""

    campaign: str
    machine: str
    by: str
    where: str | None
    select: str | None
    groups: Mapping[str, int]
    parameters: Mapping[str, ParameterStatistics]
    vector: VectorTests
    drift: SessionDrift
    coordinates: CoordinateStatistics
    parameter_order: tuple[str, ...]
    correlation_all: Array
    correlation_pooled: Array
    correlation_by_group: Mapping[str, GroupCorrelation]
    degrees_of_freedom_all: int
    degrees_of_freedom_pooled: int
    seed: int
    refers_to: Mapping[str, str]
    matrices: tuple[str, ...] | None = field(default=None, metadata=OMITTED)
    copied_readings: tuple[Said, ...] | None = field(default=None, metadata=OMITTED)
    figures: tuple[str, ...] | None = field(default=None, metadata=OMITTED)

    @property
    def moved(self) -> tuple[str, ...]:
        """The parameters in which the groups differ."""
        rates = {name: statistics.anova_q for name, statistics in self.parameters.items()}
        return tuple(name for name, q in rates.items() if q is not None and q < DIFFERENT)
