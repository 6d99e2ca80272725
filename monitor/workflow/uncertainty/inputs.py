"""What the uncertainty of a run propagates: its readings, the calibrated quantities, the errors of the linear axes.

The covariance of the readings is pooled by day from the repeated runs where there are enough of them, else all runs
together, else the stated standard uncertainty, uncorrelated but where the residuals show that neighbours of a run
resemble each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from monitor.discovery import Fit
from monitor.discovery.machine.compare import lack_of_fit
from monitor.exceptions import DataError, InputError
from monitor.records import Array, Campaign, LinearAxes
from monitor.reporting.budget import HoldsFor
from monitor.reporting.covariance_source import CovarianceKind, CovarianceSource
from monitor.uncertainty import Inputs, OutputContribution, overall, pooled_by_day, uncorrelated
from monitor.uncertainty.linear_axes import row_covariances
from monitor.uncertainty.parts import Estimated
from monitor.uncertainty.runs.measured_run import MeasuredRun, same_plan
from monitor.uncertainty.runs.row_run import repeated_readings
from monitor.uncertainty.runs.sensitivity import Sensitivity
from monitor.uncertainty.runs.touched_run import TouchedRun
from monitor.workflow.selections.readings import SelectedReadings
from monitor.workflow.uncertainty.neighbours import resemblance_of

READINGS = "readings"
BAR = "scale bar"
CALIBRATED = "calibrated quantities"
# A covariance from fewer degrees of freedom than this says little about itself; then the next choice is taken.
FEWEST_DEGREES_OF_FREEDOM = 8
#: Between-day scatter from two days may be 32 times as large (chi-square, one degree of freedom, 95 %); from three 6.
FEWEST_DAYS = 3


def reading_inputs(
    fit: Fit,
    campaign: Campaign,
    run: MeasuredRun,
    selected: SelectedReadings | None,
    holds_for: HoldsFor | None = None,
) -> tuple[Inputs, CovarianceSource]:
    """Inputs of the readings of a run, and where their covariance comes from: all runs, or a stored selection.

    With ``holds_for`` a run it is the scatter within runs. Raises DataError where the selection has too few runs, or
    the runs are too few for what is to hold within a day or over the campaign.
    """
    names = run.reading_names
    count = len(names)
    units = ("mm",) * count
    values, days = _repeated(fit, campaign, count) if selected is None else (selected.values, selected.days)
    name = None if selected is None else selected.name
    runs = len(days)
    if selected is not None and runs - 1 < FEWEST_DEGREES_OF_FREEDOM:
        raise DataError(
            f"--select {name}: {runs} runs leave {runs - 1} degrees of freedom for a "
            f"covariance; at least {FEWEST_DEGREES_OF_FREEDOM} are needed"
        )
    within_days = runs - len(np.unique(days))
    repeated = len(values) > 0 and holds_for is not HoldsFor.RUN
    if repeated and within_days >= FEWEST_DEGREES_OF_FREEDOM:
        inputs = pooled_by_day(values, days, names, units, source=READINGS)
        source = CovarianceSource(CovarianceKind.POOLED_BY_DAY, runs, within_days, selection=name)
    elif holds_for is HoldsFor.DAY:
        raise DataError(
            f"--holds-for day: {runs} runs of one plan on {len(np.unique(days))} days leave {max(within_days, 0)} "
            f"degrees of freedom within days; at least {FEWEST_DEGREES_OF_FREEDOM} are needed (write --holds-for run)"
        )
    elif repeated and runs - 1 >= FEWEST_DEGREES_OF_FREEDOM:
        inputs = overall(values, names, units, source=READINGS)
        source = CovarianceSource(CovarianceKind.ALL_RUNS, runs, runs - 1, selection=name)
    elif holds_for is HoldsFor.CAMPAIGN:
        raise DataError(
            f"--holds-for campaign: {runs} runs of one plan are too few; at least {FEWEST_DEGREES_OF_FREEDOM + 1} on "
            "three days or more are needed (write --holds-for run)"
        )
    else:
        inputs, source = _stated_inputs(fit, campaign, run, name)
        source = replace(source, for_the_run=_chose_the_run(holds_for, len(values)))
    # The estimate is that of the run itself: its results are stated.
    return replace(inputs, estimate=run.inputs[:count]), source


def _stated_inputs(
    fit: Fit, campaign: Campaign, run: MeasuredRun, selection: str | None
) -> tuple[Inputs, CovarianceSource]:
    """Inputs of the readings of a run from what is stated of them, or their repeatability where that is larger.

    They are uncorrelated where the residuals do not show that neighbours of the run resemble each other.
    """
    # Readings of several instruments each have their own: what repeats worse than stated does so in proportion.
    several = bool(campaign.artefact.setups)
    stated = fit.sigma if several else campaign.probe.standard_uncertainty
    u = max(stated, lack_of_fit(fit)[1] or 0.0)
    alike = None if selection is not None else resemblance_of(fit, run)
    if alike is not None:
        u = max(u, stated * alike.scale)
    names = run.reading_names
    deviation = run.stated * (u / stated)
    inputs = uncorrelated(names, ("mm",) * len(names), run.inputs[: len(names)], deviation, source=READINGS)
    source = _stated_source(u, stated, several=several, selection=selection)
    if alike is None:
        return inputs, source
    covariance = alike.matrix * np.outer(deviation, deviation)
    return replace(inputs, covariance=covariance), replace(
        source,
        neighbours=round(alike.neighbours, 3),
        further=alike.correlation.rho,
        of_poses=alike.of_poses or None,
    )


def readings_of_runs(
    fit: Fit,
    campaign: Campaign,
    runs: Sequence[MeasuredRun],
    index: int,
    inputs: Inputs,
    selection: str | None,
) -> tuple[Array, ...]:
    """The covariance of the readings of every run of a fit, of which that of the one at ``index`` is in ``inputs``.

    A run of the same plan has the same one. One of another plan (cut short, or in another order) has its own from what
    is stated; where repeated runs of one plan gave the covariance they say nothing of how its readings resemble each
    other, so that these are independent, each as many times what is stated as the largest of the evaluated run.
    """
    evaluated = runs[index]
    count = len(evaluated.reading_names)
    of_evaluated = inputs.covariance[:count, :count]
    with np.errstate(invalid="ignore", divide="ignore"):
        times = np.sqrt(np.diag(of_evaluated)) / evaluated.stated
    largest = float(np.max(times[np.isfinite(times)], initial=0.0))
    covariances = []
    for run in runs:
        if _is_alike(run, evaluated):
            covariances.append(of_evaluated)
        elif inputs.estimated_of(inputs.sources[0]) is Estimated.SCALE:
            covariances.append(_stated_inputs(fit, campaign, run, selection)[0].covariance)
        else:
            covariances.append(np.diag((largest * run.stated) ** 2))
    return tuple(covariances)


def _is_alike(run: MeasuredRun, other: MeasuredRun) -> bool:
    """Whether the readings of two runs are those of one plan, with one weight."""
    return same_plan(run.problem, other.problem) and bool(np.allclose(run.stated, other.stated))


def _chose_the_run(holds_for: HoldsFor | None, repeated: int) -> bool | None:
    """Whether an uncertainty of the run itself was asked for where the ``repeated`` runs would do; None where not."""
    return (holds_for is HoldsFor.RUN and repeated - 1 >= FEWEST_DEGREES_OF_FREEDOM) or None


def _stated_source(u: float, stated: float, *, several: bool, selection: str | None) -> CovarianceSource:
    """The source of a covariance from what probe or setups state, or from a repeatability ``u`` (mm) above it."""
    exceeds = u > stated
    if several:
        kind = CovarianceKind.REPEATABILITY_OF_SETUPS if exceeds else CovarianceKind.STATED_BY_SETUPS
        return CovarianceSource(kind, selection=selection, times=u / stated if exceeds else None)
    kind = CovarianceKind.REPEATABILITY if exceeds else CovarianceKind.STATED_BY_PROBE
    return CovarianceSource(kind, u_um=u * 1e3, selection=selection)


def holding_for(source: CovarianceSource, days: int) -> HoldsFor:
    """For which time a covariance of the readings holds by itself: what repeated runs show of ``days`` days."""
    if source.kind is CovarianceKind.POOLED_BY_DAY:
        return HoldsFor.DAY
    if source.kind is CovarianceKind.ALL_RUNS:
        return HoldsFor.CAMPAIGN if days >= FEWEST_DAYS else HoldsFor.DAY
    return HoldsFor.RUN


def _repeated(fit: Fit, campaign: Campaign, count: int) -> tuple[Array, npt.NDArray[np.int64]]:
    """Readings (runs, count) of all runs and the day of each; no readings where the runs follow different plans."""
    days = {run.run: run.day for run in campaign.runs}
    labels = np.array([days[int(run)] for run in fit.problem.runs])
    try:
        return repeated_readings(fit.problem), labels
    except DataError:
        return np.zeros((0, count)), labels


def calibrated_inputs(run: MeasuredRun) -> Inputs | None:
    """Inputs of the calibrated quantities of a run; None where it has none."""
    names, unit, u = run.calibrated
    if not names:
        return None
    count = len(run.reading_names)
    source = BAR if isinstance(run, TouchedRun) else CALIBRATED
    return uncorrelated(names, (unit,) * len(names), run.inputs[count:], u, source=source)


def with_linear_axes(
    run: MeasuredRun, inputs: Inputs, sensitivity: Sensitivity, names: tuple[str, ...], axes: LinearAxes
) -> tuple[Inputs, list[OutputContribution]]:
    """The inputs with what errors of the linear axes do to them, and the same by source as lines of the budget."""
    if isinstance(run, TouchedRun):
        raise InputError(
            "--linear-axes is for methods that take the linear axes as known, such as rotary-probing; this method "
            "identifies errors of the linear axes itself"
        )
    count = len(run.reading_names)
    rows = sensitivity.rows(names)[:, :count]
    covariance = inputs.covariance.copy()
    lines = []
    for source, of_rows in row_covariances(run, sensitivity.unknowns, axes).items():
        covariance[:count, :count] += of_rows
        of_outputs = rows @ of_rows @ rows.T
        lines.append(OutputContribution(source, 0.5 * (of_outputs + of_outputs.T)))
    return replace(inputs, covariance=covariance), lines
