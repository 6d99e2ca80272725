"""Names from outside in charts: plotly.js reads markup in every text, and would show a link that somebody typed."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime
from html import unescape
from typing import Any

from monitor.web.charts.chart import Chart, in_template
from monitor.web.charts.trend import trend_chart
from monitor.workflow.history.values import ParameterValues, ValuesAnswer

NAME = 'Mess "A" <i>kampagne</i> & <a href="javascript:alert(1)">@ 5 %{x}</a>'
OWN_MARKUP = ("<br>", "<extra>", "</extra>")


def _texts(value: Any, key: str = "") -> Iterator[tuple[str, str]]:
    """Every text below a part of a chart, with its key."""
    if isinstance(value, dict):
        for name, element in value.items():
            yield from _texts(element, name)
    elif isinstance(value, list):
        for element in value:
            yield from _texts(element, key)
    elif isinstance(value, str):
        yield key, value


def _markup(chart: Chart) -> list[str]:
    """The texts of a chart that hold a tag of others, or a value that a name asks a template for."""
    faults = []
    for key, text in _texts(json.loads(json.dumps(chart.document))):
        rest = text
        for tag in OWN_MARKUP:
            rest = rest.replace(tag, "")
        if "<" in rest or (key.endswith("template") and "5 %{x}" in rest):
            faults.append(text)
    return faults


def _values(name: str) -> ValuesAnswer:
    return ValuesAnswer(
        machine=name, topology="t", started_at=(datetime(2026, 3, 2, tzinfo=UTC),), campaign=(name,), method=(name,),
        run=(1,), day=(1,), warm_up=(False,),
        parameters={name: ParameterValues(name, (1.0,), (0.1,), 2.0)}, conditions={f"{name}_degC": (20.0,)},
    )  # fmt: skip


def test_every_text_of_a_trend_is_shown_as_it_was_typed() -> None:
    chart = trend_chart(_values(NAME), NAME, None)
    # Told by the traces before: the same chart would have held markup.
    assert any("<i>" in text for _, text in _texts(list(chart.traces)))
    assert _markup(chart) == []
    first = chart.document["data"][0]
    assert unescape(first["name"]) == NAME
    assert unescape(in_template(NAME)) == NAME


def test_a_history_of_one_run_is_drawn_between_days() -> None:
    """Was: over "1 runs", on an axis of milliseconds."""
    chart = trend_chart(_values("A"), "A", None)
    assert "A of A over 1 run in " in chart.says
    assert chart.document["layout"]["xaxis"]["range"] == [
        "2026-03-01T00:00:00+00:00",
        "2026-03-03T00:00:00+00:00",
    ]
    two = replace(
        _values("A"), started_at=(datetime(2026, 3, 2, tzinfo=UTC), datetime(2026, 3, 4, tzinfo=UTC)),
        campaign=("A", "A"), method=("A", "A"), run=(1, 2), day=(1, 2), warm_up=(False, False),
        parameters={"A": ParameterValues("A", (1.0, 2.0), (0.1, 0.1), 2.0)}, conditions={},
    )  # fmt: skip
    begin, end = map(datetime.fromisoformat, trend_chart(two, "A", None).document["layout"]["xaxis"]["range"])
    assert datetime(2026, 3, 1, tzinfo=UTC) < begin < datetime(2026, 3, 2, tzinfo=UTC)
    assert datetime(2026, 3, 4, tzinfo=UTC) < end < datetime(2026, 3, 5, tzinfo=UTC)


def test_a_name_that_begins_as_a_colour_is_no_colour() -> None:
    chart = trend_chart(
        replace(_values("@blue"), parameters={"EXX": _values("EXX").parameters["EXX"]}), "EXX", None
    )
    first = chart.document["data"][0]
    assert (first["name"], first["marker"]["color"]) == ("&#64;blue", "@blue")
