"""The error of every version of a model on a campaign: what `model history` shows falling."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from monitor.discovery import Fit, version_error
from monitor.discovery.curve.compare import lack_of_fit
from monitor.discovery.curve.quality import bic, held_out
from monitor.documents import OMITTED, to_document
from monitor.exceptions import NotFoundError
from monitor.methods.chain.identification import Refusal
from monitor.methods.chain.shared_effects import shared_parameters
from monitor.methods.curve.fit import CurveFit
from monitor.records import Campaign, CurveCampaign
from monitor.store import Database, StoredModel, last_used_campaign, model_history
from monitor.units import MICROMETRE
from monitor.workflow.explain.machine_answer import micrometres
from monitor.workflow.explain.request import HistoryRequest
from monitor.workflow.identify.curve import in_micrometres, response_unit
from monitor.workflow.identify.fitting import fit_of, load_measured
from monitor.workflow.models import label, resolve


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
    no_number: tuple[Refusal, ...]

    @property
    def unit(self) -> str:
        return MICROMETRE.name

    @property
    def rms(self) -> float:
        return self.rms_um

    @property
    def heldout_rms(self) -> float | None:
        return self.heldout_rms_um

    @property
    def repeatability(self) -> float | None:
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
    no_number: tuple[Refusal, ...]


@dataclass(frozen=True)
class HistoryAnswer:
    """Every version from the base on, fitted to one campaign."""

    steps: tuple[MachineVersion | CurveVersion, ...]
    figures: tuple[str, ...] | None = field(default=None, metadata=OMITTED)


def history(db: Database, request: HistoryRequest) -> HistoryAnswer:
    """Fit every version of a model, from the base on, to one campaign. Raises NotFoundError, DataError."""
    model = resolve(db, request.model)
    campaign = load_measured(db, request.campaign or latest_campaign(db, model))
    steps = error_steps(campaign, model_history(db, model.name, model.version))
    figures = None if request.figures is None else _figures(steps, request.figures)
    return HistoryAnswer(steps, figures)


def latest_campaign(db: Database, model: StoredModel) -> str:
    """The campaign on which a version or an ancestor of it was last used. Raises NotFoundError where none was."""
    campaign = last_used_campaign(db, model)
    if campaign is None:
        raise NotFoundError(
            f"model {label(model)} has not been compared with a campaign yet; name one with --campaign"
        )
    return campaign


def error_steps(
    campaign: Campaign | CurveCampaign, versions: Sequence[StoredModel]
) -> tuple[MachineVersion | CurveVersion, ...]:
    """The error of every version of a model on a campaign."""
    return tuple(_step(campaign, version) for version in versions)


def _step(campaign: Campaign | CurveCampaign, version: StoredModel) -> MachineVersion | CurveVersion:
    fit = fit_of(campaign, version)
    return (
        _curve_step(fit, version) if isinstance(fit, CurveFit) else _machine_step(fit, campaign.name, version)
    )


def _machine_step(fit: Fit, campaign: str, version: StoredModel) -> MachineVersion:
    error = version_error(fit)
    return MachineVersion(
        model=label(version),
        campaign=campaign,
        added=" + ".join(version.added) or None,
        removed=" + ".join(version.removed) or None,
        rms_um=MICROMETRE.to_display(error.rms),
        heldout_rms_um=micrometres(error.held_out_rms),
        repeatability_um=micrometres(error.repeatability),
        stated_uncertainty_um=MICROMETRE.to_display(error.stated_uncertainty),
        lack_of_fit_p=error.lack_of_fit_p,
        no_number=shared_parameters(fit.problem, fit.solution).refused,
    )


def _curve_step(fit: CurveFit, version: StoredModel) -> CurveVersion:
    curve = fit.problem.curve
    test, repeatability = lack_of_fit(fit)
    held_out_rms = held_out(fit)
    return CurveVersion(
        model=label(version),
        campaign=curve.name,
        method=curve.method,
        unit=response_unit(curve),
        added=" + ".join(version.added) or None,
        removed=" + ".join(version.removed) or None,
        rms_um=in_micrometres(curve, fit.rms),
        rms=fit.rms,
        residual_deviation_um=in_micrometres(curve, fit.deviation),
        residual_deviation=fit.deviation,
        heldout_rms_um=in_micrometres(curve, held_out_rms),
        heldout_rms=held_out_rms,
        repeatability_um=in_micrometres(curve, repeatability),
        repeatability=repeatability,
        stated_uncertainty_um=in_micrometres(curve, curve.standard_uncertainty),
        stated_uncertainty=curve.standard_uncertainty,
        lack_of_fit_f=None if test is None else test.f,
        lack_of_fit_p=None if test is None else test.p_value,
        bic=bic(fit),
        no_number=fit.refused,
    )


def _figures(steps: Sequence[MachineVersion | CurveVersion], folder: Path) -> tuple[str, ...]:
    # Loaded here: drawing costs a second that a history without figures need not wait.
    from monitor.workflow.explain.curve_figures import curve_history_figure
    from monitor.workflow.explain.figures import history_figure

    draw = curve_history_figure if isinstance(steps[0], CurveVersion) else history_figure
    return tuple(draw([to_document(step) for step in steps], folder))
