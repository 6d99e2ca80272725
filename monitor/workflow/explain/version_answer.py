"""The answer of `model history`: the error of every version of a model on a campaign."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from monitor.documents import OMITTED
from monitor.reporting.refused import RefusedParameters
from monitor.workflow.explain.compare_answer import InMicrometres


@dataclass(frozen=True)
class MachineVersion(InMicrometres):
    """The error of a version on a machine's campaign in µm: on all runs, and on runs that took no part in the fit.

    ``refers_to`` says in words what the effects that it added or removed are stated relative to.
    """

    model: str
    campaign: str
    added: str | None
    removed: str | None
    rms_um: float
    heldout_rms_um: float | None
    repeatability_um: float | None
    stated_uncertainty_um: float
    lack_of_fit_p: float | None
    no_number: tuple[RefusedParameters, ...]
    refers_to: Mapping[str, str] = field(default_factory=dict)

    @property
    def heldout_rms(self) -> float | None:
        """The RMS on held-out readings in ``unit``, None where there is none."""
        return self.heldout_rms_um


@dataclass(frozen=True)
class CurveVersion:
    """The error of a version on a curve, in the unit of the response and in µm where that is a length."""

    model: str
    campaign: str
    method: str
    unit: str
    added: str | None
    removed: str | None
    rms_um: float | None
    rms: float
    residual_deviation_um: float | None
    residual_deviation: float
    heldout_rms_um: float | None
    heldout_rms: float | None
    repeatability_um: float | None
    repeatability: float | None
    stated_uncertainty_um: float | None
    stated_uncertainty: float | None
    lack_of_fit_f: float | None
    lack_of_fit_p: float | None
    bic: float
    no_number: tuple[RefusedParameters, ...]


@dataclass(frozen=True)
class HistoryAnswer:
    """Every version from the base on, fitted to one campaign."""

    steps: tuple[MachineVersion | CurveVersion, ...]
    figures: tuple[str, ...] | None = field(default=None, metadata=OMITTED)
