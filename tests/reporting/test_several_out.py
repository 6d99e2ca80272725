"""A machine with several parameters out of tolerance: the first page names each, since when, and asks to mend each."""

from __future__ import annotations

import re
from dataclasses import replace
from datetime import date, datetime
from pathlib import Path

from by_path import load

from monitor.reporting.health.answers import answers
from monitor.reporting.health.page import machine_pages
from monitor.reporting.health.records import DataQuality, PoseError, VolumetricMap
from monitor.reporting.health.render import health_html
from monitor.reporting.health.trend_picture import trend_picture
from monitor.reporting.svg.map_slices import Slice
from monitor.reporting.svg.plot import text_width

page = load("first_page_records", Path(__file__).with_name("test_first_page.py"))

#: As certainly out as the other, further beyond its limit in its own unit and less far in limits.
GAIN = replace(
    page.parameter("EXX", value=-61.0, per_month=0.0, tolerance=40.0),
    unit="µm/m", probability_out=1.0, out_since=datetime(2025, 9, 15),
)  # fmt: skip
SQUARE = replace(
    page.parameter(value=58.0, tolerance=20.0), probability_out=1.0, out_since=datetime(2025, 10, 18)
)


def sentences(*parameters: object) -> dict[str, str]:
    week, _ = page.fleet(page.machine("M", "out of tolerance", *parameters, probability_out=1.0))
    return {answer.kind: answer.sentence for answer in answers(week)}


def test_every_parameter_that_is_out_is_named_and_mended() -> None:
    """It named the likeliest alone: who compensated that had a machine out of tolerance still."""
    for order in ((GAIN, SQUARE), (SQUARE, GAIN)):
        said = sentences(*order)
        assert said["why"] == (
            "Squareness X-Y (EC0Y) is +58.0 µrad (U = 4.0, tolerance ± 20.0) and grows by 4.00 µrad a month; out of "
            "tolerance with a probability of > 99.9 %; also out of tolerance: positioning gain of axis X (EXX: −61.0 "
            "µm/m, tolerance ± 40.0)."
        )
        assert said["do"] == (
            "Adjust or compensate squareness X-Y (EC0Y), positioning gain of axis X (EXX) and measure again now."
        )


def test_each_has_its_own_day_since_when() -> None:
    """The first day of any stood behind the name of the other, whose picture showed runs within the limit then."""
    assert sentences(GAIN, SQUARE)["since"] == (
        "Since 2025-10-18 (EC0Y), 2025-09-15 (EXX): every run since then lies beyond the tolerance."
    )
    together = replace(GAIN, out_since=SQUARE.out_since)
    assert sentences(together, SQUARE)["since"].startswith("Since 2025-10-18: every run")
    # One of them alone is out: its own day.
    assert sentences(SQUARE, replace(GAIN, probability_out=0.4))["since"].startswith("Since 2025-10-18: ")


def test_of_many_the_most_urgent_are_named_and_the_others_counted() -> None:
    many = [replace(SQUARE, name=f"E{index}", in_words=f"error {index}") for index in range(6)]
    said = sentences(*many)
    assert "(E2: +58.0 µrad, tolerance ± 20.0) and 3 more." in said["why"]
    assert said["do"].startswith(
        "Adjust or compensate error 0 (E0), error 1 (E1), error 2 (E2) and 3 more and"
    )


def test_a_line_that_is_no_more_than_chance_is_not_drawn_as_a_forecast() -> None:
    drawn = page.parameter(value=15.0, per_month=2.0)
    assert "line: drift, dashed: forecast" in trend_picture("M", drawn)
    assert drawn.drift is not None
    chance = replace(drawn, drift=replace(drawn.drift, p_value=0.4, crosses_at=date(2060, 1, 1)))
    assert "forecast" not in trend_picture("M", chance)
    # The line of a step lies beyond the limit before the last run: no forecast either.
    stepped = replace(drawn, drift=replace(drawn.drift, p_value=0.4, crosses_at=date(2026, 1, 1)))
    assert "forecast" not in trend_picture("M", stepped)


def test_what_is_in_tolerance_is_not_said_to_be_beyond_it_by_a_trend_of_chance() -> None:
    """A line of +1 (-40 to +41) a year stood at 25.3 at the last run, whose estimate was 22.3 of ± 25."""
    inside = page.parameter(value=15.0, per_month=2.0)
    assert inside.drift is not None
    crossed = replace(inside.drift, crosses_at=date(2026, 3, 1), crosses_between=(None, None))
    (chance, drifts) = (replace(inside, drift=replace(crossed, p_value=p_value)) for p_value in (0.9, 1e-4))
    (printed,) = machine_pages([page.machine("M", "in tolerance", chance, drifts)])
    assert [line.drift.partition("; ")[2] for line in printed.lines] == [
        "", "by this trend beyond its tolerance since about 2026-03-01",
    ]  # fmt: skip


def a_map(worst_um: float) -> VolumetricMap:
    """Three slices whose longest error is 4 µm, of a machine whose worst is elsewhere or among them."""
    nodes = ((0.0, 1.0), (2.0, 4.0))
    part = Slice("Z", 0.0, ("X", "Y"), (0.0, 1.0), (0.0, 1.0), nodes, nodes, nodes, nodes)
    return VolumetricMap(
        1, "16 points", "A -90°", worst_um, 1.0, 2.0, (PoseError("A -90°", worst_um, 2.0),), (part,) * 3
    )


def test_slices_that_lack_the_worst_error_say_so() -> None:
    """A scale to 4 µm stood below a worst error of 83 µm without a word."""
    (elsewhere, among) = machine_pages([replace(page.GOOD, map=a_map(worst)) for worst in (83.32, 4.0)])
    assert elsewhere.map_beyond == (
        "The longest here is 4.00\N{NO-BREAK SPACE}µm: the worst, 83.32\N{NO-BREAK SPACE}µm, "
        "lies outside of these slices."
    )
    assert among.map_beyond == ""


def test_a_machine_that_was_not_measured_has_no_empty_headings() -> None:
    gone = replace(page.AWAY, quality=DataQuality(0, 0, 0, (), (), (), (), ()))
    (away, moved) = machine_pages([gone, replace(gone, changes=page.CHANGED.changes)])
    assert not away.says_more
    assert moved.says_more
    assert all(measured.says_more for measured in machine_pages([page.GOOD, page.CHANGED, page.DRIFTED]))


def test_without_a_tolerance_the_table_has_no_columns_of_dashes() -> None:
    bare = page.machine("M", "no change seen", page.parameter(tolerance=None))
    week, machines = page.fleet(bare, page.GOOD)
    html = "".join(health_html(week, machines))
    assert html.count('<th class="number">Tolerance</th>') == 1
    assert html.count('data-name="Tolerance"') == 1
    (judged,) = machine_pages([page.GOOD])
    (free,) = machine_pages([bare])
    assert (len(judged.widths), len(free.widths)) == (6, 4)


def test_a_title_of_the_longest_names_stays_in_the_picture() -> None:
    """The words of an effect and its symbol were cut off at the edge, and the machine's name was a letter."""
    effect = "EXC1:harmonic2@lagged_spindle_front_degC"
    long = replace(page.parameter(effect), in_words=f"displacement in X of spindle C1 ({effect[5:]})")
    machine = "Bearbeitungszentrum_ohne_Trennstellen_im_Namen_0815_in_Halle_17"
    (title,) = re.findall(r"<text[^>]*>(Bearb[^<]*)</text>", trend_picture(machine, long))
    assert title.startswith("Bearbeitung")
    assert title.endswith(f"…: {effect} / µrad")
    assert text_width(title, bold=True) < 1040.0  # 104 mm
