"""What a health report reads of stored results: the fields of their documents that stand on a machine's page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from monitor.documents import OMITTED, named
from monitor.records import Array
from monitor.reporting.covariance_source import CovarianceSource
from monitor.reporting.health.comparison import ResidualAgainst, ResidualMap
from monitor.reporting.refused import RefusedParameters
from monitor.reporting.svg.map_slices import Slice
from monitor.workflow.uncertainty.released import covariance_source_of


@dataclass(frozen=True)
class FrameworkResult:
    """The estimates of a run with uncertainties by the GUM framework, by parameter, in display units."""

    estimate: Mapping[str, float]
    u: Mapping[str, float]
    correlation: tuple[tuple[float, ...], ...]
    expanded: Mapping[str, float]
    degrees_of_freedom: float | None
    k_q_with_degrees_of_freedom: float


@dataclass(frozen=True)
class StatedUncertainty:
    """The uncertainty of a run, at the probability ``p``; ``input_covariance`` says in words what it rests on."""

    p: float
    parameters: tuple[str, ...]
    units: Mapping[str, str]
    input_covariance: str
    refused: tuple[RefusedParameters, ...]
    guf: FrameworkResult
    input_covariance_source: CovarianceSource | None = field(default=None, metadata=OMITTED)

    @property
    def rests_on_a_selection(self) -> bool:
        """Whether the scatter is that of runs that a user selected, and not of the campaign's own."""
        source = self.input_covariance_source or covariance_source_of(self.input_covariance)
        return source.selection is not None

    def covariance(self) -> Array:
        """Covariance (k, k) of the parameters, in display units."""
        u = np.array([self.guf.u[name] for name in self.parameters])
        return np.array(self.guf.correlation) * np.outer(u, u)


@dataclass(frozen=True)
class LackOfFit:
    """Residuals against repeatability: the ratio of variances and its p-value, None where there is none."""

    f: float | None
    p: float | None


@dataclass(frozen=True)
class MissingGroup:
    """An effect that the model lacks, with the error before and after it is added."""

    effect: str
    meaning: str
    cause: str
    remedy: str
    peak_um: float | None
    rms_before_um: float
    heldout_before_um: float | None
    rms_after_um: float
    heldout_after_um: float | None
    indistinguishable_from: tuple[str, ...]


@dataclass(frozen=True)
class FoundMove:
    """A change between two runs that the residuals show: of a ``target`` of the artefact, or of a parameter."""

    run: int
    size: float
    unit: str
    p_value: float
    target: str | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class SuspectPoint:
    """A touch that does not belong to the others."""

    run: int
    sequence: int
    target: str
    axis: str
    size_um: float


@dataclass(frozen=True)
class StoredExplanation:
    """Model against measurement of a campaign."""

    campaign: str
    model: str
    rms_um: float
    repeatability_um: float | None
    stated_uncertainty_um: float
    lack_of_fit: LackOfFit
    verdict: str
    missing: tuple[MissingGroup, ...]
    suspect_data: tuple[SuspectPoint, ...]
    changes: tuple[FoundMove, ...]
    blind_spots: tuple[str, ...]
    answer: str
    residual_map: ResidualMap | None
    residual_against: ResidualAgainst | None


@dataclass(frozen=True)
class WorstPoint:
    """Where the error is largest: ``at`` by axis and unit (``x_mm``, ``b_deg``)."""

    at: Mapping[str, float]
    error_um: float
    expanded_um: float


@dataclass(frozen=True)
class PoseOfMap:
    """The error with the rotary axes at one pose."""

    at: Mapping[str, float]
    worst_um: float
    rms_um: float


@dataclass(frozen=True)
class MapRegion:
    """Where the error was computed: so many points, and how the strokes are known."""

    points: int
    from_: str = field(metadata=named("from"))


@dataclass(frozen=True)
class RootMeanSquare:
    """The root mean square of the error over the region."""

    error_um: float


@dataclass(frozen=True)
class StoredMap:
    """The volumetric error of a run; uncertainties with ``k`` for the probability ``p``."""

    run: int
    p: float
    k: float
    region: MapRegion
    worst: WorstPoint
    rms: RootMeanSquare
    by_pose: tuple[PoseOfMap, ...]
    slices: tuple[Slice, ...]


@dataclass(frozen=True)
class VersionError:
    """The error of one version of the model, and the effects that it added or removed (joined by plus signs)."""

    model: str
    campaign: str
    added: str | None
    removed: str | None
    rms_um: float
    heldout_rms_um: float | None


@dataclass(frozen=True)
class VersionErrors:
    """The errors of all versions of a model, the first first."""

    steps: tuple[VersionError, ...]
