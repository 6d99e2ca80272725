"""The page of a machine: what is there at once, and what comes when somebody scrolls to it."""

from __future__ import annotations

import html
import json
import re
from dataclasses import replace
from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from monitor.documents import from_document, to_document
from monitor.store import Database, list_runs
from monitor.web.charts.trend import groups_without_legend, trend_chart
from monitor.web.pages.shown_runs import ShownRuns
from monitor.workflow.events import EventRequest, event
from monitor.workflow.history.values import ValuesAnswer
from monitor.workflow.intake.importing import ImportRequest, import_folders
from monitor.workflow.trend.answer import TrendAnswer
from tests.web.test_pages import looked_at

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def test_the_table_of_all_parameters_is_computed_for_whoever_scrolls_to_it(local: Any) -> None:
    # The first look identifies, for which all are followed; another period is not computed yet.
    looked_at(local, "/machine?name=HU40-T")
    address = "/machine?name=HU40-T&parameter=EXX&since=2026-01-01"
    page = looked_at(local, address)
    assert "<h2>All parameters</h2>" in page
    later = re.search(r'<section id="every" data-later="([^"]+)"', page)
    assert later is not None
    assert "Drift a year" not in page
    for _ in range(60):
        table = local.client.get(html.unescape(later[1]))
        if table.status_code != 202:
            break
    assert table.status_code == 200
    assert table.text.count("<tr") == 14  # the head and 13 parameters
    assert '<tr class="current">' in table.text
    # Once it is computed the page has it at once; without a script a link asks for it.
    again = looked_at(local, f"{address}&every=true")
    assert "Drift a year" in again
    assert "data-later" not in again
    assert local.client.get("/machine/parameters").status_code == 400


def test_a_period_is_cut_of_the_history_as_the_database_cuts_it(local: Any) -> None:
    """The page shows what the question answers for the same ends."""
    looked_at(local, "/machine?name=HU40-T")
    for since, until in (
        ("2026-03-03", ""),
        ("", "2026-03-04"),
        ("2026-03-03", "2026-03-05"),
        ("2030-01-01", ""),
    ):
        ends = {"since": since, "until": until}
        document = {key: f"{text}T00:00:00Z" for key, text in ends.items() if text}
        status, answer = local.ask("values", {"machine": "HU40-T", **document})
        assert status == 200
        shown = values_of_page(local, since, until)
        assert shown == answer
    refused = local.client.get("/machine?name=HU40-T&since=yesterday")
    assert refused.status_code == 400
    assert "since is a day, such as 2026-03-02 or 02.03.2026, not" in refused.text


def values_of_page(local: Any, since: str, until: str) -> Any:
    """What the page cuts of the whole history, as the interface would answer it."""
    _, whole = local.ask("values", {"machine": "HU40-T"})
    return json.loads(json.dumps(to_document(ShownRuns(since, until).of(from_document(ValuesAnswer, whole)))))


@pytest.fixture(scope="module")
def crashed(tmp_path_factory: pytest.TempPathFactory, serve: Any) -> tuple[Any, datetime]:
    """A server of five days, and when something was noted: between two runs of one day by the shop's clock."""
    path = tmp_path_factory.mktemp("crashed") / "monitor.duckdb"
    with Database(path, threads=1) as db:
        import_folders(db, ImportRequest([EXAMPLES / "five-days"]))
        starts = [run.started_at_local for run in list_runs(db, "five-days") if run.day == 4]
        at = starts[1] + (starts[2] - starts[1]) / 2
        shop = timezone(timedelta(hours=-5))
        event(
            db,
            EventRequest(
                "HU40-T", "hit the vice", (starts[0] - timedelta(hours=1)).replace(tzinfo=shop), "crash"
            ),
        )
        event(db, EventRequest("HU40-T", "looked at it", at.replace(tzinfo=shop), "note"))
    return serve(path, False), at


def test_an_event_is_drawn_between_the_runs_that_it_lay_between(crashed: tuple[Any, datetime]) -> None:
    """Runs were drawn by the clock of the shop (-05:00) and events by UTC: five hours late, behind the last run."""
    served, at = crashed
    text = looked_at(served, "/machine?name=HU40-T&parameter=EB0C")
    chart = json.loads(html.unescape(re.findall(r'class="figure">(.*?)</script>', text, re.DOTALL)[0]))
    upright = [shape for shape in chart["layout"]["shapes"] if shape.get("yref") == "paper"]
    drawn = [datetime.fromisoformat(shape["x0"]) for shape in upright if shape["line"]["dash"] == "dash"]
    assert [moment.replace(tzinfo=None) for moment in drawn][1:] == [at]
    runs = sorted(time for trace in chart["data"] if trace["name"] == "five-days" for time in trace["x"])
    before = sum(datetime.fromisoformat(time).replace(tzinfo=None) < at for time in runs)
    assert before == 14  # twelve of three days, two of the fourth


def test_the_words_at_a_line_hide_no_runs_and_no_other_words(crashed: tuple[Any, datetime]) -> None:
    """The words of the step stood on two of the four runs behind it."""
    text = looked_at(crashed[0], "/machine?name=HU40-T&parameter=EB0C")
    chart = json.loads(html.unescape(re.findall(r'class="figure">(.*?)</script>', text, re.DOTALL)[0]))
    words = [note for note in chart["layout"]["annotations"] if note["yref"] == "paper"]
    assert len(words) >= 2
    runs = next(trace for trace in chart["data"] if "error_y" in trace)
    times = np.array([datetime.fromisoformat(time).timestamp() for time in runs["x"]])
    ends = np.array(runs["y"]) + np.array([[-1.0], [1.0]]) * np.array(runs["error_y"]["array"])
    begin, top = chart["layout"]["yaxis"]["domain"]
    heights = begin + (top - begin) * (ends - ends.min()) / np.ptp(ends)
    for note in words:
        # Some letters beside the line: the first or the last ones, whichever side they stand on.
        side = 1.0 if note["xanchor"] == "left" else -1.0
        beside = side * (times - datetime.fromisoformat(note["x"]).timestamp()) / np.ptp(times)
        near = (beside >= 0.0) & (beside < 0.004 * len(note["text"]))
        covered = (heights[1] > note["y"] - 0.05) & (heights[0] < note["y"])
        assert not (near & covered).any(), note["text"]
    assert len({(note["x"], note["y"]) for note in words}) == len(words)


def test_a_step_at_an_event_is_told_where_changes_are(crashed: tuple[Any, datetime]) -> None:
    text = looked_at(crashed[0], "/machine?name=HU40-T&parameter=EB0C")
    changes = re.search(r"<dt>Changes</dt><dd>(.*?)</dd>", text, re.DOTALL)
    assert changes is not None
    assert "the crash of 2026-03-05" in changes[1]
    assert "none found" not in changes[1]


def test_colours_that_come_twice_have_no_legend(local: Any) -> None:
    assert local.ask("identify", {"campaign": "hidden-spindle-growth"})[0] == 200
    _, whole = local.ask("values", {"machine": "HU40-T"})
    values = from_document(ValuesAnswer, whole)
    days = trend_chart(values, "EXX", None, "day")
    assert {trace["showlegend"] for trace in days.traces if "error_y" in trace} == {True}
    assert groups_without_legend(values, "EXX", "day") == 0
    many = replace(values, campaign=tuple(f"campaign {row}" for row in range(len(values.run))))
    shown = trend_chart(many, "EXX", None, "campaign")
    assert {trace["showlegend"] for trace in shown.traces if "error_y" in trace} == {False}
    assert groups_without_legend(many, "EXX", "campaign") == len(values.run)


def test_all_of_a_filtered_page_is_of_the_runs_that_it_shows(crashed: tuple[Any, datetime]) -> None:
    """The file of its values had both campaigns and the latest value was of a day outside the period."""
    served = crashed[0]
    looked_at(served, "/machine?name=HU40-T")
    chosen = "campaign=five-days&warm_up=warm&since=2026-03-03&until=2026-03-05"
    text = looked_at(served, f"/machine?name=HU40-T&parameter=EB0C&{chosen}")
    chart = json.loads(html.unescape(re.findall(r'class="figure">(.*?)</script>', text, re.DOTALL)[0]))
    drawn = [time for trace in chart["data"] if "error_y" in trace for time in trace["x"]]
    link = re.search(r'href="(/machine/values.csv[^"]+)"', text)
    assert link is not None
    rows = served.client.get(html.unescape(link[1])).text.splitlines()[1:]
    assert [row.split(",")[0] for row in rows] == sorted(drawn)
    assert len(rows) == 8
    latest = re.search(r"<dt>Latest</dt><dd>(.*?)</dd>", text, re.DOTALL)
    assert latest is not None
    assert "2026-03-04" in latest[1]
    later = re.search(r'data-later="([^"]+)"', text)
    assert later is not None
    assert all(part in html.unescape(later[1]) for part in chosen.split("&"))
    _, none = served.ask("trend", {"machine": "HU40-T", "warm_up": True})
    assert none["runs"] == 0
    assert "among those that were chosen" in str(none["why"])


def test_an_event_long_before_the_runs_is_asked_about_and_squeezes_no_chart(
    imported: Path, serve: Any, tmp_path: Path
) -> None:
    """One of 1999 was recorded for ever, and pressed the runs of every chart into a line."""
    copy = tmp_path / "copy.duckdb"
    copy.write_bytes(imported.read_bytes())
    own = serve(copy, False)
    looked_at(own, "/machine?name=HU40-T")

    def recorded(**more: str) -> Any:
        texts = {"machine": "HU40-T", "text": "delivered", "kind": "repair", "at": "1999-03-05", **more}
        return own.sent("/machine/event", data={"proof": own.proof(), **texts})

    wordless = recorded(text="")
    assert (wordless.status_code, 'value="1999-03-05"' in wordless.text) == (400, True)
    assert "say in words what happened" in wordless.text
    asked = recorded()
    assert "lies more than a year before the first run of HU40-T" in html.unescape(asked.text)
    assert 'name="before_runs"' in asked.text
    recorded(before_runs="1")
    page = looked_at(own, "/machine?name=HU40-T")
    assert "1999-03-05: repair, delivered" in page
    chart = json.loads(html.unescape(re.findall(r'class="figure">(.*?)</script>', page, re.DOTALL)[0]))
    assert min(chart["layout"]["xaxis"]["range"]) > "2026"
    assert "1999" not in json.dumps(chart["layout"]["shapes"])
    number = re.search(r'name="number" value="(\d+)"', page)
    assert number is not None
    texts = {"machine": "HU40-T", "number": number[1], "reason": "of another machine"}
    own.sent("/machine/event/withdraw", data={"proof": own.proof(), **texts})
    assert "none recorded" in looked_at(own, "/machine?name=HU40-T")


def test_a_forecast_of_no_slope_widens_no_chart(local: Any) -> None:
    looked_at(local, "/machine?name=HU40-T")
    _, whole = local.ask("values", {"machine": "HU40-T"})
    _, followed = local.ask("trend", {"machine": "HU40-T", "parameter": "EXX"})
    values, answer = from_document(ValuesAnswer, whole), from_document(TrendAnswer, followed)
    statement = answer.parameters["EXX"]
    last = max(values.started_at).isoformat()
    ends = []
    for p_value in (0.9, 0.001):
        forecast = replace(statement.forecast, crosses_limit_at="2038-01-01T00:00:00-05:00", limit=9.0)
        moved = replace(statement, forecast=forecast, drift=replace(statement.drift, p_value=p_value))
        chart = trend_chart(values, "EXX", replace(answer, parameters={"EXX": moved}))
        ends.append(max(chart.layout["xaxis"]["range"]))
    span = max(values.started_at) - min(values.started_at)
    assert last < ends[0] < (max(values.started_at) + span / 8).isoformat()
    assert (max(values.started_at) + span).isoformat() < ends[1] < "2027"
