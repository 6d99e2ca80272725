"""Statistics of a campaign's probed coordinates, one by one."""

from __future__ import annotations

from typing import Any

import numpy as np

from monitor.documents import Said
from monitor.methods import Unable, campaign_method
from monitor.records import Array, Campaign
from monitor.statistics import Homogeneity
from monitor.units import DEGREE
from monitor.workflow.run_statistics.answer import CoordinateStatistics
from monitor.workflow.run_statistics.pooling import pooled_by_group
from monitor.workflow.run_statistics.tests import finite, histogram, normal_scatter


def coordinates(campaign: Campaign, runs: list[int]) -> tuple[list[str], Array] | None:
    """Names and values (R, 3 m), mm, of the probed coordinates; None where the runs' plans differ."""
    probings = campaign.probings
    linear = [axis for axis in ("X", "Y", "Z") if axis in probings.readings]
    turning = sorted(set(probings.readings) - set(linear))
    plan: list[tuple[Any, ...]] | None = None
    rows_of = []
    for run in runs:
        rows = np.flatnonzero(probings.run == run)
        rows = rows[np.argsort(probings.sequence[rows], kind="stable")]
        probed = [
            (str(probings.target[row]), *(round(float(probings.readings[axis][row]), 6) for axis in turning))
            for row in rows
        ]
        if plan is not None and probed != plan:
            return None
        plan = probed
        rows_of.append(rows)
    assert plan is not None
    names = []
    for number, (target, *angles) in enumerate(plan, start=1):
        angles_text = " ".join(
            f"{axis.lower()}={angle / DEGREE.factor:g}" for axis, angle in zip(turning, angles, strict=True)
        )
        names += [f"{number} ball {target} {angles_text} {axis.lower()}" for axis in linear]
    values = np.array(
        [np.stack([probings.readings[axis][rows] for axis in linear], axis=1).ravel() for rows in rows_of]
    )
    return names, values


def probed(campaign: Campaign, runs: list[int]) -> tuple[list[str], Array] | Said:
    """Names and values (R, 3 m), mm, of the probed coordinates, or why there are none."""
    comparable = campaign_method(campaign).coordinates
    if isinstance(comparable, Unable):
        return comparable.why
    several = coordinates(campaign, runs)
    if several is None:
        from monitor.reporting.run_notes import RunsOfSeveralPlans

        return RunsOfSeveralPlans()
    return several


def coordinate_statistics(campaign: Campaign, runs: list[int], groups: list[str]) -> CoordinateStatistics:
    """Standard deviations and tests of every probed coordinate, or why there are none."""
    readings = probed(campaign, runs)
    if not isinstance(readings, tuple):
        return CoordinateStatistics(n=0, why=readings, bartlett_p=(), anova_p=(), histograms={})
    names, values = readings
    pooled, tests = pooled_by_group(values, groups, names)
    bartlett, anova = _p_values(tests)
    return CoordinateStatistics(
        n=len(names),
        names=tuple(names),
        u_all_um=pooled.u_all * 1e3,
        u_pooled_um=pooled.u_pooled * 1e3,
        u_by_day_um={
            label: u * 1e3
            for label, u in zip(pooled.labels, pooled.u_by_group, strict=True)
            if np.isfinite(u).all()
        },
        bartlett_p=bartlett,
        anova_p=anova,
        normality_p=normal_scatter(values, groups),
        histograms={
            name: histogram(p_values)
            for name, p_values in (("bartlett", bartlett), ("anova", anova))
            if p_values
        },
    )


def _p_values(tests: Homogeneity | None) -> tuple[tuple[float | None, ...], tuple[float | None, ...]]:
    """p-values of Bartlett's test and of ANOVA for every coordinate; empty where a test was not made."""

    def finite_values(p_values: Array) -> tuple[float | None, ...]:
        return tuple(finite(p) for p in p_values)

    if tests is None:
        return (), ()
    bartlett = () if tests.bartlett is None else finite_values(tests.bartlett.p_value)
    return bartlett, finite_values(tests.anova.p_value)
