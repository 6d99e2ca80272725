"""The error of every version of a model on a campaign: what `model history` shows falling."""

from __future__ import annotations

from collections.abc import Sequence

from monitor.discovery import Fit, version_error
from monitor.discovery.curve.compare import lack_of_fit
from monitor.discovery.curve.quality import bic, held_out
from monitor.exceptions import EffectError, NotFoundError
from monitor.methods.chain.shared_effects import shared_parameters
from monitor.methods.curve.fit import CurveFit
from monitor.records import Campaign, CurveCampaign
from monitor.reporting.refused import refused_parameters
from monitor.store import Database, StoredModel, last_used_campaign, model_history
from monitor.units import MICROMETRE
from monitor.workflow.explain.machine_answer import micrometres
from monitor.workflow.explain.request import HistoryRequest
from monitor.workflow.explain.version_answer import CurveVersion, HistoryAnswer, MachineVersion
from monitor.workflow.identify.curve import in_micrometres, response_unit
from monitor.workflow.identify.fitting import fit_of, machine_problem
from monitor.workflow.measured import load_measured
from monitor.workflow.models import label, resolve
from monitor.workflow.uncertainty.machine_frame import refers_to


def history(db: Database, request: HistoryRequest) -> HistoryAnswer:
    """Fit every version of a model, from the base on, to one campaign. Raises NotFoundError, DataError."""
    model = resolve(db, request.model)
    campaign = load_measured(db, request.campaign or latest_campaign(db, model))
    steps = error_steps(campaign, model_history(db, model.name, model.version))
    if request.figures is None:
        return HistoryAnswer(steps)
    # Loaded here: drawing costs a second that a history without figures need not wait.
    from monitor.workflow.explain.figures import history_figures

    return HistoryAnswer(steps, tuple(history_figures(steps, request.figures)))


def fitted_version(
    db: Database, version: StoredModel, campaign: str | None
) -> tuple[MachineVersion | CurveVersion, ...]:
    """Fit a version that need not be stored yet, and its ancestors, to a campaign.

    Raises NotFoundError, DataError, EffectError where an effect that it adds has no column in the campaign.
    """
    ancestors = () if version.parent is None else model_history(db, *version.parent)
    if campaign is None:
        campaign = latest_campaign(db, ancestors[-1] if ancestors else version)
    measured = load_measured(db, campaign)
    left_out = machine_problem(measured, version).left_out if isinstance(measured, Campaign) else {}
    for effect in version.added:
        if effect in left_out:
            raise EffectError(left_out[effect])
    return error_steps(measured, (*ancestors, version))


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
        no_number=tuple(map(refused_parameters, shared_parameters(fit.problem, fit.solution).refused)),
        refers_to=refers_to((*version.added, *version.removed), fit.problem.context.chain),
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
        no_number=tuple(map(refused_parameters, fit.refused)),
    )
