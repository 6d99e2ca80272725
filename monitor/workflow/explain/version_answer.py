"""The answer of `model history`: the error of every version of a model on a campaign."""

from __future__ import annotations

from dataclasses import dataclass, field

from monitor.documents import OMITTED
from monitor.reporting.refused import RefusedParameters
from monitor.units import MICROMETRE


@dataclass(frozen=True)
class MachineVersion:
    """The error of a version on a machine's campaign in µm: on all runs, and on runs that took no part in the fit."""

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

    @property
    def unit(self) -> str:
        """The unit of ``rms`` and its like: a micrometre."""
        return MICROMETRE.name

    @property
    def rms(self) -> float:
        """The RMS in ``unit``."""
        return self.rms_um

    @property
    def heldout_rms(self) -> float | None:
        """The RMS on held-out readings in ``unit``, None where there is none."""
        return self.heldout_rms_um

    @property
    def repeatability(self) -> float | None:
        """The repeatability in ``unit``, None where it is not known."""
        return self.repeatability_um


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
