"""How much of a parameter's scatter is a run's own, how much runs of a day add, and how much days add."""

from __future__ import annotations

import numpy as np

from monitor.discovery import Fit
from monitor.discovery.machine.compare import lack_of_fit
from monitor.exceptions import DataError
from monitor.methods.chain.shared_effects import FollowedEffects
from monitor.records import Array, Campaign
from monitor.reporting.budget import DayToDay
from monitor.statistics.nested import DayComponents, day_components
from monitor.uncertainty import Estimated, OutputContribution
from monitor.uncertainty.runs.measured_run import MeasuredRun
from monitor.units import Unit
from monitor.workflow.uncertainty.inputs import FEWEST_DAYS

#: The line of the budget for what days add.
BETWEEN_DAYS = "between days"


def components_of(
    fit: Fit,
    campaign: Campaign,
    run: MeasuredRun,
    rows: Array,
    names: tuple[str, ...],
    effects: FollowedEffects | None = None,
) -> DayComponents:
    """Components of the m outputs ``names`` over the runs that determine all of them; ``rows`` (m, N) as in the budget.

    A run's own scatter is that of its residuals, taken as uncorrelated, through its sensitivity. Behind the outputs
    stand the ``effects`` as every run says them by itself; all runs do.
    """
    count = len(run.reading_names)
    repeatability = lack_of_fit(fit)[1]
    if repeatability is None:
        repeatability = fit.sigma * (fit.scale if fit.degrees_of_freedom > 0 else 1.0)
    times = repeatability / fit.sigma
    within = np.sqrt(np.sum((rows[:, :count] * run.stated * times) ** 2, axis=1))
    places = [fit.problem.base_names.index(name) for name in names]
    whole = fit.solution.local_free[:, places].all(axis=1)
    day = {each.run: each.day for each in campaign.runs}
    labels = np.array([day[int(number)] for number in fit.problem.runs])
    values = fit.solution.local[:, places]
    if effects is not None:
        values = np.concatenate([values, effects.estimate], axis=1)
        variance = np.einsum("rii->ri", effects.covariance)[whole].mean(axis=0)
        within = np.concatenate([within, times * np.sqrt(variance)])
    return day_components(values[whole], labels[whole], within)


def between_days(components: DayComponents) -> OutputContribution:
    """The line of the budget for what days add. Raises DataError where it cannot be known."""
    if components.days < FEWEST_DAYS or components.covariance is None:
        raise DataError(
            f"--holds-for campaign: {components.days} day{'s' if components.days != 1 else ''} of repeated runs say "
            f"{'nothing' if components.days == 1 else 'too little'} of how days differ; measure on {FEWEST_DAYS} days "
            "or more, or state what holds within a day (--holds-for day)"
        )
    return OutputContribution(
        BETWEEN_DAYS, components.covariance, float(components.days - 1), Estimated.MATRIX
    )


def day_to_day(components: DayComponents, names: tuple[str, ...], units: tuple[Unit, ...]) -> DayToDay:
    """The components by parameter, in display units."""
    factors = np.array([unit.factor for unit in units])

    def by_name(values: Array) -> dict[str, float]:
        return dict(zip(names, map(float, values / factors), strict=True))

    interval = components.between_days_interval / factors[:, None]
    return DayToDay(
        runs=components.runs,
        days=components.days,
        within_run=by_name(components.within_run),
        between_runs=by_name(components.between_runs),
        u_day=by_name(components.between_days),
        u_day_interval={
            name: (float(low), float(high)) for name, (low, high) in zip(names, interval, strict=True)
        },
        spread=by_name(components.spread),
        not_from_zero=tuple(name for name, cut in zip(names, components.truncated_days, strict=True) if cut),
        not_known=None if components.not_known is None else components.not_known.value,
    )
