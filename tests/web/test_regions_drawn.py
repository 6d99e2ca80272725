"""The regions of two parameters on a campaign's page claim what the degrees of freedom allow, and no more."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from monitor.web.charts.statistics import cloud_chart
from monitor.web.pages.campaign import _charts
from monitor.workflow.uncertainty.cloud import CloudAnswer

CLOUD = CloudAnswer(
    campaign="five-days", run=20, parameters=13, names=("EXX", "EZZ"), units=("µm/m", "µm/m"), estimate=(0.0, 0.0),
    u=(1.0, 2.0), correlation=0.0, p=0.95, k_p=2.45, k_q=2.24, k_p_of_all=4.73, k_q_of_all=2.81, trial_count=10_000,
    seed=1, trials=np.zeros((5, 2)), k_p_with_degrees_of_freedom=2.8, k_q_with_degrees_of_freedom=2.5,
    k_p_of_all_with_degrees_of_freedom=14.88, k_q_of_all_with_degrees_of_freedom=3.29,
)  # fmt: skip


def test_regions_are_those_with_degrees_of_freedom() -> None:
    traces = {trace["name"]: trace for trace in cloud_chart(CLOUD).traces}
    ellipse = np.array(traces["ellipse of all 13, k_p = 14.88"]["x"])
    assert ellipse.max() == 14.88
    assert max(traces["rectangle of all 13, k_q = 3.29"]["y"]) == 2 * 3.29
    assert {"ellipse of the pair, k_p = 2.80", "rectangle of the pair, k_q = 2.50"} <= set(traces)


def test_no_ellipse_is_drawn_where_nothing_bounds_it() -> None:
    few = replace(CLOUD, k_p_with_degrees_of_freedom=None, k_p_of_all_with_degrees_of_freedom=None)
    chart = cloud_chart(few)
    assert not [trace["name"] for trace in chart.traces if "ellipse" in trace["name"]]
    assert (
        "no ellipse, which would need more degrees of freedom than parameters, rectangle with k_q = 2.50"
        in chart.says
    )


def test_two_runs_draw_no_correlations_and_more_say_their_degrees_of_freedom() -> None:
    """With one degree of freedom all of them are +1 or -1, and look like a finding."""
    two, many = (
        SimpleNamespace(
            parameter_order=("EXX", "EYY"), correlation_pooled=np.eye(2), degrees_of_freedom_pooled=freedom,
            coordinates=SimpleNamespace(histograms={}, n=0),
        )
        for freedom in (1, 16)
    )  # fmt: skip
    assert _charts(two) == []
    (chart,) = _charts(many)
    assert chart.says.endswith("pooled within the groups (16 degrees of freedom)")
