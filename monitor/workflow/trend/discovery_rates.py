"""How many of the findings that one trend states may be false: rates over all parameters, one for each kind of finding.

A kind (drifts, conditions, cycles, warm-ups) is stated by these rates, not by the p-values: of thirteen parameters and
two conditions one is below 5 % by chance in three histories of four.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from monitor.statistics import control_false_discoveries
from monitor.workflow.trend.answer import ParameterTrend
from monitor.workflow.trend.parameter import number


def with_discovery_rates(parameters: Mapping[str, ParameterTrend]) -> dict[str, ParameterTrend]:
    """Return the parameters with the false discovery rate of each drift, condition, cycle and warm-up, over those of
    its kind of all parameters."""
    trends = parameters.values()
    drifts = _rates(trend.drift.p_value for trend in trends)
    conditions = _rates(effect.p_value for trend in trends for effect in trend.conditions)
    cycles = _rates(wave.p_value for trend in trends for wave in trend.cycles)
    warm_ups = _rates(trend.warm_up.p_value for trend in trends if trend.warm_up)
    return {
        name: replace(
            trend,
            q_value=next(drifts),
            conditions=tuple(replace(effect, q_value=next(conditions)) for effect in trend.conditions),
            cycles=tuple(replace(wave, q_value=next(cycles)) for wave in trend.cycles),
            warm_up=trend.warm_up and replace(trend.warm_up, q_value=next(warm_ups)),
        )
        for name, trend in parameters.items()
    }


def _rates(p_values: Iterable[float | None]) -> Iterator[float | None]:
    """The rates in the order of the p-values; None where there is none."""
    or_nan = [np.nan if p is None else p for p in p_values]
    return map(number, control_false_discoveries(or_nan).q_value.tolist())
