"""What counts beside the readings of a run: Type B sources and days; and what is said of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from monitor.discovery import Fit
from monitor.effects import ChainEffect
from monitor.records import Array, Campaign
from monitor.reporting.budget import DayToDay, HoldsFor
from monitor.reporting.covariance_source import CovarianceSource
from monitor.statistics.nested import DayComponents
from monitor.uncertainty import Inputs, OutputContribution
from monitor.uncertainty.monte_carlo.sourced_trials import FurtherOutputs, Moves, output_moves
from monitor.uncertainty.runs.measured_run import MeasuredRun
from monitor.uncertainty.runs.sensitivity import Sensitivity
from monitor.uncertainty.type_b import SourceColumns
from monitor.units import Unit
from monitor.workflow.selections.readings import SelectedReadings
from monitor.workflow.uncertainty.day_to_day import between_days, components_of, day_to_day
from monitor.workflow.uncertainty.effect_scatter import scatter_of_effects
from monitor.workflow.uncertainty.inputs import holding_for, readings_of_runs
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
from monitor.workflow.uncertainty.unchecked import unchecked_readings
from monitor.workflow.uncertainty.with_effects import EffectOutputs, source_effect


@dataclass(frozen=True)
class Linearised:
    """The run at ``index`` of a fit, its sensitivity, and its outputs ``names`` (m) with their ``units``.

    ``effects`` are outputs of the whole campaign behind them.
    """

    run: MeasuredRun
    sensitivity: Sensitivity
    index: int
    names: tuple[str, ...]
    units: tuple[Unit, ...]
    effects: EffectOutputs | None = None

    @property
    def own_rows(self) -> Array:
        """The sensitivity (m, N) of the run's parameters, effects held."""
        return self.sensitivity.rows(self.names)

    @property
    def rows(self) -> Array:
        """The sensitivity (m + a, N) of all outputs to the inputs of the run."""
        rows = self.own_rows
        return rows if self.effects is None else self.effects.padded(rows) + self.effects.linear


@dataclass(frozen=True)
class Beside:
    """Lines of the budget beside those of the readings, what a Monte Carlo draws for them, and what is said of them.

    ``lines`` of the budget, ``sampled`` the same as trials draw it by ``moves``. ``axes_covered``: whether a source
    speaks of every linear axis.
    """

    lines: tuple[OutputContribution, ...]
    sampled: tuple[OutputContribution, ...]
    moves: Moves
    behind: Behind
    axes_covered: bool


def beside_readings(
    campaign: Campaign,
    fit: Fit,
    run: Linearised,
    readings: Inputs,
    source: CovarianceSource,
    asked: Asked,
    selected: SelectedReadings | None,
) -> Beside:
    """What counts beside ``readings`` with a covariance from ``source``, of the ``selected`` runs where there are any.

    Raises InputError for a source that does not fit or counts twice, DataError where days cannot be known.
    """
    chain, number = fit.problem.context.chain, int(fit.problem.runs[run.index])
    rows = run.own_rows
    sources = all_sources(campaign, asked.sources)
    refuse_twice(sources, asked.linear_axes, chain)
    components = components_of(fit, campaign, run.run, rows, run.names)
    runs_of_days = _runs_of_days(fit, campaign, selected)
    holds = holding_for(source, len(runs_of_days))
    adds_days = asked.holds_for is HoldsFor.CAMPAIGN and holds is not HoldsFor.CAMPAIGN
    of_days = (between_days(components),) if adds_days else ()
    holds = HoldsFor.CAMPAIGN if adds_days else holds
    shown = shown_part(source.kind, runs_of_days, adds_days)
    counted = counted_columns(run.run, run.sensitivity.unknowns, campaign, number, sources, shown)
    if run.effects is None:
        lines = (*_alone(counted, rows), *of_days)
        sampled = (*_drawn_alone(counted, rows), *of_days)
        moves = Moves(counted, output_moves(of_days))
    else:
        others = tuple(
            counted_columns(each, local, campaign, int(other), sources, shown)
            for each, local, other in zip(
                run.effects.runs, run.effects.unknowns, fit.problem.runs, strict=True
            )
        )
        covariances = readings_of_runs(fit, campaign, run.effects.runs, run.index, readings, source.selection)
        of_others = run.effects.of_other_runs(readings, covariances)
        lines, sampled, moves = _with_effects(
            campaign, fit, run, readings, of_others, counted, others, of_days, holds
        )
    linear = {joint.name for joint in chain.of_kind("linear")}
    return Beside(
        lines,
        sampled,
        moves,
        Behind(
            holds_for=holds,
            day_to_day=_day_to_day(fit, campaign, run, components),
            sources=stated(sources, counted),
            length=length_reference(campaign, number, _gains(fit, run.names), sources),
            unchecked=unchecked_readings(fit, run.names),
        ),
        bool(linear) and linear <= axes_stated(sources, chain),
    )


def _day_to_day(fit: Fit, campaign: Campaign, run: Linearised, components: DayComponents) -> DayToDay:
    """The ``components`` of the run's parameters, and those of the effects that every run says by itself."""
    if run.effects is None:
        return day_to_day(components, run.names, run.units)
    followed = run.effects.said_by_every_run
    both = components_of(fit, campaign, run.run, run.own_rows, run.names, followed)
    return day_to_day(both, (*run.names, *followed.names), (*run.units, *followed.units))


def _alone(counted: Sequence[SourceColumns], rows: Array) -> tuple[OutputContribution, ...]:
    """The lines of the sources of a run without effects; ``rows`` (m, N) is its sensitivity."""
    return tuple(part.contribution(rows) for part in counted)


def _drawn_alone(counted: Sequence[SourceColumns], rows: Array) -> tuple[OutputContribution, ...]:
    """The same by the variance that is drawn, which is larger for Student's t."""
    lines = _alone(counted, rows)
    return tuple(
        replace(line, covariance=part.law_factor**2 * line.covariance)
        for line, part in zip(lines, counted, strict=True)
    )


def _with_effects(
    campaign: Campaign,
    fit: Fit,
    run: Linearised,
    readings: Inputs,
    of_others: OutputContribution,
    counted: tuple[SourceColumns, ...],
    others: tuple[tuple[SourceColumns, ...], ...],
    of_days: tuple[OutputContribution, ...],
    holds: HoldsFor,
) -> tuple[tuple[OutputContribution, ...], tuple[OutputContribution, ...], Moves]:
    """Lines, what is sampled and moves of a run with effects; ``of_others`` is what the readings of the other runs
    add, ``others`` has what every source does to every run."""
    effects, of_run = run.effects, run.own_rows
    assert effects is not None
    day = {each.run: each.day for each in campaign.runs}
    days = [day[int(number)] for number in fit.problem.runs]
    moved = [
        source_effect(effects, of_run, [columns[index] for columns in others], days)
        for index in range(len(counted))
    ]
    count = len(run.run.reading_names)
    rows = run.rows[:, :count]
    of_readings = rows @ readings.covariance[:count, :count] @ rows.T + of_others.covariance
    scatter = scatter_of_effects(effects, fit, day, of_readings, of_others.dof, holds)
    of_model = (of_others if effects.others else None, effects.known_in_other_runs, scatter)
    on_outputs = (
        *(effects.contribution(part) for part in of_days),
        *(part for part in of_model if part is not None),
    )
    rest = tuple(each.rest for each in moved)
    none = np.zeros((len(rows), 0))
    further = FurtherOutputs(
        effects.estimate, effects.linear, np.concatenate([none, *(each.beside for each in moved)], axis=1)
    )
    return (
        (*(each.line for each in moved), *on_outputs),
        (*(each.drawn for each in moved), *on_outputs, *rest),
        Moves(counted, output_moves((*on_outputs, *rest)), further),
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
