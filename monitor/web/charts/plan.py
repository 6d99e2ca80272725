"""What a plan promises beside what the present one does."""

from __future__ import annotations

from typing import TYPE_CHECKING

from monitor.web.charts.chart import Chart, axis

if TYPE_CHECKING:
    from monitor.workflow.plan.answer import BallPlanAnswer


def plan_chart(answer: BallPlanAnswer) -> Chart:
    """Show by how much the proposed plan changes the uncertainty of every parameter that both determine."""
    assert answer.proposed is not None
    rows = [
        (name, before.u, after.u, before.unit)
        for name, before in answer.present.parameters.items()
        if (after := answer.proposed.parameters[name]).u is not None and before.u
    ]
    return Chart(
        key="plan",
        says="standard uncertainty with the plan that was asked for, in per cent of the present plan's",
        traces=[
            {
                "type": "bar", "x": [name for name, _, _, _ in rows],
                "y": [100.0 * (after or 0.0) / before for _, before, after, _ in rows if before],
                "marker": {"color": "@blue"},
                "text": [f"{before:.2g} → {after:.2g} {unit}" for _, before, after, unit in rows],
                "textposition": "none", "hovertemplate": "%{x}: %{text} (%{y:.0f} %)<extra></extra>",
            }
        ],
        layout={
            "xaxis": axis("", type="category"), "yaxis": axis("u / % of the present", rangemode="tozero"),
            "shapes": [
                {
                    "type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": 100, "y1": 100,
                    "line": {"color": "@orange", "dash": "dash", "width": 1.5},
                }
            ],
        },
        height=280,
    )  # fmt: skip
