"""What the style sheet has to know of the charts, and how numbers of any size are written."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from monitor.reporting.resources import report_text
from monitor.web import charts
from monitor.web.words import channel, with_u

CHARTS = Path(charts.__file__).parent


def test_every_chart_has_its_height_before_it_is_drawn() -> None:
    """A box that grows when the chart comes would move what stands below it from under the reader."""
    rules = dict(
        re.findall(r'\[data-height="(\d+)"\] \{ height: (\d+)px; \}', report_text("pages/pages.css"))
    )
    assert all(height == pixels for height, pixels in rules.items())
    fixed = {
        height
        for path in CHARTS.glob("*.py")
        for line in re.findall(r"height=([^,\n]*)", path.read_text(encoding="utf-8"))
        for height in re.findall(r"\b\d{3}\b", line)
        if "len(" not in line
    }
    assert len(fixed) > 5
    assert fixed <= set(rules)
    assert {str(110 + 34 * count) for count in range(2, 21)} <= set(rules)  # the ranking of effects


def test_the_buttons_of_a_chart_show_where_it_is_pointed_at_alone() -> None:
    """Without a mouse plotly.js shows them at all times, over the legend on a telephone, over bars elsewhere."""
    rules = dict(
        re.findall(r"^(\.canvas[^{]*\.modebar-group) \{ opacity: (\d)", report_text("pages/pages.css"), re.M)
    )
    shown = ".canvas:hover .modebar-group, .canvas:focus-within .modebar-group"
    assert rules == {".canvas .modebar-group": "0", shown: "1"}


@pytest.mark.parametrize(
    ("value", "u", "text"),
    [
        (6.14, 0.22, "6.14 ± 0.22 µm"),
        (0.000348, 0.00002, "0.000348 ± 0.000020 µm"),
        (-3.1e-8, 1.1e-10, "(−3.100 ± 0.011) · 10⁻⁸ µm"),
        (0.0, 2.0e-9, "(0.0 ± 2.0) · 10⁻⁹ µm"),
        (1.0, None, "1 µm"),
    ],
)
def test_jcgm_100_7_2_6_a_small_number_is_written_with_its_power(
    value: float, u: float | None, text: str
) -> None:
    assert with_u(value, u, "µm") == text


def test_a_condition_is_written_with_its_unit() -> None:
    assert [channel(name) for name in ("x_axis_degC", "load")] == ["x axis / °C", "load"]
