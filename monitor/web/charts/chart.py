"""A chart: a document for plotly.js, a sentence that says what it shows, and the layout that all charts share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

Trace = dict[str, Any]

#: Colours of series in their order, as the style sheet names them; each has its marker, so that grey tells them apart.
SERIES = ("@blue", "@orange", "@teal", "@violet", "@olive", "@rose")
MARKERS = ("circle", "diamond", "square", "triangle-up", "x", "star")
DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot")


@dataclass(frozen=True)
class Chart:
    """A chart by its ``key`` in the page; ``says`` is read to who cannot see it, ``height`` in pixels."""

    key: str
    says: str
    traces: Sequence[Trace]
    layout: Mapping[str, Any]
    height: int = 340

    @property
    def document(self) -> Mapping[str, Any]:
        """Return what the page's script hands to plotly.js."""
        return {"data": list(self.traces), "layout": {**BASE, **self.layout, "height": self.height}}


def axis(title: str, **more: Any) -> dict[str, Any]:
    """Return an axis with a title, in the colours of the page."""
    return {
        "title": {"text": title}, "gridcolor": "@rule", "linecolor": "@mid", "zerolinecolor": "@mid",
        "automargin": True, **more,
    }  # fmt: skip


def look(index: int) -> tuple[str, str]:
    """Return colour and marker of the series of that number."""
    return SERIES[index % len(SERIES)], MARKERS[index % len(MARKERS)]


BASE: Mapping[str, Any] = {
    "paper_bgcolor": "rgba(0,0,0,0)",
    "plot_bgcolor": "rgba(0,0,0,0)",
    "font": {"color": "@ink", "family": "DejaVu Sans, sans-serif", "size": 12},
    "margin": {"l": 56, "r": 16, "t": 12, "b": 52},
    "hoverlabel": {"bgcolor": "@paper", "bordercolor": "@mid", "font": {"color": "@ink"}},
    "legend": {"orientation": "h", "y": 1.0, "yanchor": "bottom", "x": 0},
}
