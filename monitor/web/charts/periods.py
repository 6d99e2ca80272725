"""Two periods of a machine: the change of every parameter with its uncertainty."""

from __future__ import annotations

from typing import TYPE_CHECKING

from monitor.web.charts.chart import Chart, axis

if TYPE_CHECKING:
    from monitor.workflow.history.periods import ParameterOfPeriods, PeriodsAnswer

#: Colour and marker of what differs, does not, and is not decided.
_LOOKS = {
    True: ("differs", "@orange", "diamond"),
    False: ("does not differ", "@blue", "circle"),
    None: ("not decided", "@mid", "circle-open"),
}


def periods_chart(answer: PeriodsAnswer) -> Chart:
    """Show by how many expanded uncertainties each parameter changed; beyond 1 it would differ by itself."""
    rows = [(name, of, ratio) for name, of in answer.parameters.items() if (ratio := _ratio(of)) is not None]
    traces = []
    for differs, (title, colour, marker) in _LOOKS.items():
        part = [(name, of, ratio) for name, of, ratio in rows if of.differs is differs]
        traces.append(
            {
                "type": "scatter", "mode": "markers", "name": title, "x": [name for name, _, _ in part],
                "y": [ratio for _, _, ratio in part],
                "marker": {"color": colour, "symbol": marker, "size": 10},
                "text": [f"{of.difference:+.3g} {of.unit}" for _, of, _ in part],
                "hovertemplate": "%{x}: %{text}<extra></extra>",
            }
        )  # fmt: skip
    return Chart(
        key="periods",
        says="change from the earlier to the later period, in expanded uncertainties (95 %) of each parameter; "
        "the colour says what differs among all parameters together",
        traces=traces,
        layout={
            "xaxis": axis("", type="category", categoryorder="array", categoryarray=[name for name, _, _ in rows]),
            "yaxis": axis("change / U"),
            "shapes": [
                {
                    "type": "rect", "xref": "paper", "x0": 0, "x1": 1, "y0": -1, "y1": 1, "fillcolor": "@faint",
                    "line": {"width": 0}, "layer": "below",
                }
            ],
        },
        height=320,
    )  # fmt: skip


def _ratio(of: ParameterOfPeriods) -> float | None:
    if of.difference is None or not of.u or of.k is None:
        return None
    return of.difference / (of.k * of.u)
