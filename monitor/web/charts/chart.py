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
        layout = {**BASE, **self.layout, "height": self.height}
        return {"data": [_escaped("", trace) for trace in self.traces], "layout": _escaped("", layout)}


#: What plotly.js would read as markup or as an entity, by the entity that it shows as what was typed.
_ENTITIES = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;", "\n": "<br>"})
_IN_TEMPLATE = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;", "%": "&#37;"})
#: Texts that hold markup of our own.
_TEMPLATES = frozenset({"hovertemplate", "texttemplate"})


def in_template(text: str) -> str:
    """Return a text from outside as a template (``hovertemplate``) shows it as it was typed."""
    return text.translate(_IN_TEMPLATE)


def _escaped(key: str, value: Any) -> Any:
    """A part of a chart with every text as it was typed: names of campaigns and events are no markup. The end of a line
    begins a new one; templates escape what they take from outside themselves (``in_template``)."""
    if isinstance(value, Mapping):
        return {name: _escaped(name, element) for name, element in value.items()}
    if isinstance(value, list | tuple):
        return [_escaped(key, element) for element in value]
    if not isinstance(value, str) or key in _TEMPLATES or key.endswith(("color", "colorscale")):
        return value
    text = value.translate(_ENTITIES)
    return f"&#64;{text[1:]}" if text.startswith("@") else text


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
