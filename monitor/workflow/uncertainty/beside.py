"""What counts beside the readings of a run: Type B sources and days; and what is said of them."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from monitor.discovery import Fit
from monitor.effects import ChainEffect
from monitor.records import Campaign
from monitor.reporting.budget import HoldsFor
from monitor.reporting.covariance_source import CovarianceSource
from monitor.uncertainty import OutputContribution
from monitor.uncertainty.monte_carlo.sourced_trials import Moves, output_moves
from monitor.uncertainty.runs.measured_run import MeasuredRun
from monitor.uncertainty.runs.sensitivity import Sensitivity
from monitor.units import Unit
from monitor.workflow.selections.readings import SelectedReadings
from monitor.workflow.uncertainty.day_to_day import between_days, components_of, day_to_day
from monitor.workflow.uncertainty.inputs import holding_for
from monitor.workflow.uncertainty.request import Asked
from monitor.workflow.uncertainty.result import Behind
from monitor.workflow.uncertainty.sources import (
    all_sources,
    axes_stated,
    counted_columns,
    length_reference,
    refuse_twice,
    shown_part,
    stated,
)


@dataclass(frozen=True)
class Linearised:
    """The run at ``index`` of a fit, its sensitivity, and its outputs ``names`` (m) with their ``units``."""

    run: MeasuredRun
    sensitivity: Sensitivity
    index: int
    names: tuple[str, ...]
    units: tuple[Unit, ...]


@dataclass(frozen=True)
class Beside:
    """Lines of the budget beside those of the readings, what a Monte Carlo draws for them, and what is said of them.

    ``axes_covered``: whether a source speaks of every linear axis.
    """

    of_sources: tuple[OutputContribution, ...]
    of_days: tuple[OutputContribution, ...]
    moves: Moves
    behind: Behind
    axes_covered: bool


def beside_readings(
    campaign: Campaign,
    fit: Fit,
    run: Linearised,
    source: CovarianceSource,
    asked: Asked,
    selected: SelectedReadings | None,
) -> Beside:
    """What counts beside readings whose covariance is from ``source``, of the ``selected`` runs where there are any.

    Raises InputError for a source that does not fit or counts twice, DataError where days cannot be known.
    """
    chain, number = fit.problem.context.chain, int(fit.problem.runs[run.index])
    rows = run.sensitivity.rows(run.names)
    sources = all_sources(campaign, asked.sources)
    refuse_twice(sources, asked.linear_axes, chain)
    components = components_of(fit, campaign, run.run, rows, run.names)
    runs_of_days = _runs_of_days(fit, campaign, selected)
    holds = holding_for(source, len(runs_of_days))
    adds_days = asked.holds_for is HoldsFor.CAMPAIGN and holds is not HoldsFor.CAMPAIGN
    of_days = (between_days(components),) if adds_days else ()
    counted = counted_columns(
        run.run, run.sensitivity.unknowns, campaign, number, sources,
        shown_part(source.kind, runs_of_days, adds_days),
    )  # fmt: skip
    linear = {joint.name for joint in chain.of_kind("linear")}
    return Beside(
        tuple(part.contribution(rows) for part in counted),
        of_days,
        Moves(counted, output_moves(of_days)),
        Behind(
            holds_for=HoldsFor.CAMPAIGN if adds_days else holds,
            day_to_day=day_to_day(components, run.names, run.units),
            sources=stated(sources, counted),
            length=length_reference(campaign, number, _gains(fit, run.names), sources),
        ),
        bool(linear) and linear <= axes_stated(sources, chain),
    )


def _runs_of_days(fit: Fit, campaign: Campaign, selected: SelectedReadings | None) -> list[int]:
    """How many of the runs that show the scatter each of their days has: those selected, else all of the fit."""
    if selected is not None:
        return list(Counter(selected.days.tolist()).values())
    day = {run.run: run.day for run in campaign.runs}
    return list(Counter(day[int(number)] for number in fit.problem.runs).values())


def _gains(fit: Fit, names: tuple[str, ...]) -> tuple[str, ...]:
    """The positioning gains among the outputs."""
    context = fit.problem.context
    gains = [
        name
        for effect in fit.problem.base
        if isinstance(effect, ChainEffect) and effect.is_gain
        for name in effect.parameters(context)
    ]
    return tuple(name for name in names if name in gains)
