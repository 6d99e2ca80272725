"""Which Type B sources count beside the readings of a run, and which the scatter of repeated runs contains already."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from monitor.effects import ChainEffect, parse_effect
from monitor.exceptions import InputError
from monitor.machine import Chain
from monitor.methods.bar_temperature import bar_temperature
from monitor.records import Array, Campaign, LinearAxes
from monitor.reporting.budget import LengthKind, LengthReference, StatedSource
from monitor.reporting.covariance_source import CovarianceKind
from monitor.sources import Quantity, Sharing, Source
from monitor.uncertainty.runs.measured_run import MeasuredRun
from monitor.uncertainty.type_b import SourceColumns, source_columns
from monitor.units import ONE

_OF_STANDARD = (Quantity.STANDARD_TEMPERATURE, Quantity.STANDARD_EXPANSION)
_LINEAR = (Quantity.LINEAR_POSITIONING, Quantity.LINEAR_STRAIGHTNESS)
#: What a covariance from repeated runs contains: what takes another value in every run, and within it.
_BY_RUN: Mapping[Sharing, float] = {Sharing.RUN: 1.0, Sharing.PROBING: 1.0}
#: Less of a variance is the rounding of sums.
_LEAST_MISSING = 1e-9


def all_sources(campaign: Campaign, further: tuple[Source, ...] | None) -> tuple[Source, ...]:
    """The sources of the campaign and those of a file. Raises InputError for a name that both have."""
    named = {source.name for source in campaign.sources}
    for source in further or ():
        if source.name in named:
            raise InputError(
                f"--sources: '{source.name}' is a source of campaign {campaign.name} already; it would count twice"
            )
    return (*campaign.sources, *(further or ()))


def shown_part(
    kind: CovarianceKind, runs_of_days: Sequence[int], between_days: bool
) -> Mapping[Sharing, float]:
    """Which part of a source's variance the scatter of the repeated runs shows, by what shares its values; else none.

    A value a day shows among all N runs of days of n_d in (N - sum n_d^2 / N) / (N - 1) of its variance: five days of
    four runs show 84 %, two days of one and eight 22 % (S. R. Searle, G. Casella, C. E. McCulloch, Variance Components,
    1992, 3.6).
    """
    if kind is CovarianceKind.POOLED_BY_DAY:
        return {**_BY_RUN, Sharing.DAY: 1.0} if between_days else _BY_RUN
    if kind is CovarianceKind.ALL_RUNS:
        runs = sum(runs_of_days)
        squares = sum(count**2 for count in runs_of_days)
        return {**_BY_RUN, Sharing.DAY: (runs - squares / runs) / (runs - 1)}
    return {}


def counted_columns(
    run: MeasuredRun,
    unknowns: Array,
    campaign: Campaign,
    number: int,
    sources: tuple[Source, ...],
    shown: Mapping[Sharing, float],
) -> tuple[SourceColumns, ...]:
    """What the sources that count do to the inputs: of each the part that the scatter of the runs has not ``shown``."""
    columns = source_columns(run, unknowns, campaign, number, sources)
    missing = [1.0 - shown.get(part.source.shared_by, 0.0) for part in columns]
    return tuple(
        replace(part, columns=math.sqrt(rest) * part.columns)
        for part, rest in zip(columns, missing, strict=True)
        if rest > _LEAST_MISSING
    )


def axes_stated(sources: tuple[Source, ...], chain: Chain) -> frozenset[str]:
    """The linear axes of whose errors a source speaks."""
    names = {source.axis for source in sources if source.quantity in _LINEAR}
    for source in sources:
        if source.effect is not None:
            effect = parse_effect(source.effect, chain)
            if isinstance(effect, ChainEffect) and not effect.joint.turns:
                names.add(effect.joint.name)
    return frozenset(name for name in names if name is not None)


def refuse_twice(sources: tuple[Source, ...], axes: LinearAxes | None, chain: Chain) -> None:
    """InputError where the errors of a linear axis are stated by a source and by --linear-axes."""
    twice = sorted(axes_stated(sources, chain) & set(axes.axes)) if axes is not None else []
    if twice:
        raise InputError(
            f"errors of {', '.join(twice)} stand in --linear-axes and among the sources, and would count twice; state "
            "those of an axis in one of them"
        )


def stated(sources: tuple[Source, ...], counted: tuple[SourceColumns, ...]) -> tuple[StatedSource, ...]:
    """The sources as they are shown."""
    names = {part.source.name for part in counted}
    return tuple(
        StatedSource(
            name=source.name,
            quantity=source.quantity.value,
            size=source.unit.to_display(source.size),
            unit="1/K" if source.unit is ONE else source.unit.name,
            distribution=source.law.value,
            degrees_of_freedom=source.degrees_of_freedom,
            shared_by=source.shared_by.value,
            counted=source.name in names,
            acts_on=source.axis or source.along or source.effect,
        )
        for source in sources
    )


def length_reference(
    campaign: Campaign, number: int, gains: tuple[str, ...], sources: tuple[Source, ...]
) -> LengthReference | None:
    """At which temperature the gains of a run hold, and what of the bar's no source states; None for no gains."""
    if not gains:
        return None
    bar = campaign.artefact.scale_bar
    run = next(run for run in campaign.runs if run.run == number)
    if bar is None:
        return LengthReference(LengthKind.NO_BAR, gains, temperature=run.conditions.get("ambient_degC"))
    measured, of_sources = bar_temperature(campaign, run), {source.quantity for source in sources}
    reference = LengthReference(
        LengthKind.NOT_CORRECTED,
        gains,
        temperature=None if measured is None else measured.degrees,
        columns=None if measured is None else measured.columns,
        not_in_u=tuple(quantity.value for quantity in _OF_STANDARD if quantity not in of_sources),
    )
    if bar.expansion_coefficient is None or bar.reference_temperature is None or measured is None:
        return reference
    return replace(
        reference,
        kind=LengthKind.CORRECTED,
        reference=bar.reference_temperature,
        expansion=bar.expansion_coefficient,
    )
