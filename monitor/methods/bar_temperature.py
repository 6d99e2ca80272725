"""How warm the scale bar was in a run: of the recorded temperatures the one that says most of it.

A bar has the temperature of the air only where it lay in it for hours. A machine that is 5 K warmer warms the bar that
stands on its table, and 5 K are 57 µm/m of steel; so what was measured at the bar stands before what the air had.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from monitor.records import Campaign, Run
from monitor.units import nearness_to_bar


@dataclass(frozen=True)
class BarTemperature:
    """The temperature of the bar in °C, and the ``columns`` it is the mean of."""

    degrees: float
    columns: tuple[str, ...]


def bar_temperature(campaign: Campaign, run: Run) -> BarTemperature | None:
    """Return how warm the bar was in a run; None where no temperature that speaks of it is recorded.

    A column of the probings counts by its mean over the touches of the bar's balls (over all rows where none of those
    has a value), and stands before a column of the runs of the same name. Several columns of one rank are averaged.
    """
    recorded = {name: value for name, value in run.conditions.items() if np.isfinite(value)}
    recorded |= dict(_of_touches(campaign, run.run))
    ranks = {name: rank for name in recorded if (rank := nearness_to_bar(name)) is not None}
    if not ranks:
        return None
    columns = sorted(name for name, rank in ranks.items() if rank == min(ranks.values()))
    return BarTemperature(float(np.mean([recorded[name] for name in columns])), tuple(columns))


def _of_touches(campaign: Campaign, number: int) -> Iterator[tuple[str, float]]:
    """The means of the channels of a run's probings, of those with a value."""
    probings, bar = campaign.probings, campaign.artefact.scale_bar
    in_run = probings.run == number
    of_bar = in_run & np.isin(probings.target, () if bar is None else bar.balls)
    for name, values in probings.channels.items():
        finite = np.isfinite(values)
        rows = finite & of_bar if np.any(finite & of_bar) else finite & in_run
        if np.any(rows):
            yield name, float(np.mean(values[rows]))
