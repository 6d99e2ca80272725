"""Model against measurement on a machine's page: what the stored explanation says, and of which runs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence, Set

import numpy as np

from monitor.reporting.health.comparison import ErrorStep, MissingEffect, ModelHealth, ReversalValue
from monitor.reporting.health.sentences import ErrorOf, ErrorWith, RunsNamed
from monitor.workflow.explain.explain_answer import ChangedParameter, MachineExplanation
from monitor.workflow.explain.version_answer import CurveVersion, HistoryAnswer, MachineVersion
from monitor.workflow.health.runs import Span
from monitor.workflow.history.refuted import CONTRADICTED
from monitor.workflow.identify.answer import Estimate


def model_health(
    explanation: MachineExplanation | None,
    versions: HistoryAnswer | None,
    span: Span,
    unchanged: Set[str],
    refuted_p: float | None = None,
) -> ModelHealth | None:
    """The comparison, which is of the runs of ``span``: their number and days are said with it.

    ``versions`` of the model are None where there is one only.
    ``unchanged`` are the parameters whose history shows no change; ``refuted_p`` is the p-value of lack of fit, where
    the readings of the whole campaign refute the model.
    """
    if explanation is None:
        return None
    comparison = explanation.comparison
    left_out = tuple(each.run for each in explanation.runs_left_out or ())
    compared = [start for run, start in span.starts.items() if run not in left_out]
    # The days of all of them where none of these was compared.
    days = compared or list(span.starts.values())
    times = comparison.residual_deviation_um / comparison.stated_uncertainty_um
    return ModelHealth(
        campaign=comparison.campaign,
        runs=RunsNamed(
            comparison.campaign,
            len(compared),
            span.later,
            min(days),
            max(days),
            left_out,
        ),
        model=comparison.model,
        verdict=comparison.verdict.value,
        answer=explanation.answer,
        rms_um=comparison.rms_um,
        repeatability_um=_finite(comparison.repeatability_um),
        lack_of_fit_f=_finite(comparison.lack_of_fit.f),
        lack_of_fit_p=_finite(comparison.lack_of_fit.p),
        missing=tuple(
            MissingEffect(
                effect.effect,
                effect.description.meaning,
                effect.description.cause,
                effect.description.remedy,
                _finite(effect.peak_um),
                _finite(effect.rms_before_um),
                _finite(effect.rms_after_um),
                effect.indistinguishable_from,
                _reversal(effect.reversal_value),
                effect.refers_to,
                effect.peak_urad,
            )
            for effect in explanation.missing
        ),
        stated_um=comparison.stated_uncertainty_um,
        where=explanation.residual_map,
        against=explanation.residual_against,
        steps=tuple(_steps(explanation, () if versions is None else versions.steps)),
        unchanged=tuple(
            dict.fromkeys(
                change.parameter
                for change in explanation.changes
                if isinstance(change, ChangedParameter) and change.parameter in unchanged
            )
        ),
        refuted_p=refuted_p,
        work_points_elsewhere=explanation.work_points_elsewhere,
        times_stated=times if times > CONTRADICTED else None,
    )


def _reversal(value: Estimate | None) -> ReversalValue | None:
    return None if value is None else ReversalValue(value.value, value.u, value.unit)


def _finite(value: float | None) -> float | None:
    return None if value is None or not np.isfinite(value) else float(value)


def _steps(
    explanation: MachineExplanation, versions: Sequence[MachineVersion | CurveVersion]
) -> Iterator[ErrorStep]:
    """The error from the method's own model on: what was added, and what adding the missing effects would give."""
    for version in versions:
        yield ErrorStep(
            ErrorOf(version.model, _effects(version.added), _effects(version.removed)),
            version.rms,
            version.heldout_rms,
            proposed=False,
        )
    missing = explanation.missing
    if missing and not versions:
        first = missing[0]
        yield ErrorStep(
            ErrorOf(explanation.comparison.model),
            first.rms_before_um,
            first.heldout_before_um,
            proposed=False,
        )
    for effect in missing:
        yield ErrorStep(ErrorWith(effect.effect), effect.rms_after_um, effect.heldout_after_um, proposed=True)


def _effects(text: str | None) -> tuple[str, ...]:
    """The effects of a text that joins them by plus signs."""
    return tuple(effect for effect in (text or "").split(" + ") if effect)
