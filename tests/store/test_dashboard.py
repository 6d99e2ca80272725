"""The dashboard of examples/grafana: each of its queries runs on a database, and says what its panel shows."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from monitor.store import Database
from monitor.workflow.events import EventRequest, event
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.intake.importing import ImportRequest, import_folders

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
DASHBOARD = EXAMPLES / "grafana" / "machine-health.json"
CHOSEN = {"machine": "HU40-T", "model": "samba", "parameter": "EB0C"}


def queries(part: Any, title: str = "") -> Iterator[tuple[str, str, str]]:
    """Title, format and text of every query of a dashboard, wherever it stands."""
    if isinstance(part, dict):
        title = str(part.get("title") or part.get("name") or title)
        if "rawSql" in part:
            yield title, str(part["format"]), str(part["rawSql"])
        for member in part.values():
            yield from queries(member, title)
    elif isinstance(part, list):
        for member in part:
            yield from queries(member, title)


QUERIES = list(queries(json.loads(DASHBOARD.read_text(encoding="utf-8"))))


def as_asked(text: str) -> str:
    """A query as the tool sends it: variables by their values, the period as a condition."""
    for name, value in CHOSEN.items():
        text = text.replace(f"${{{name}}}", value)
    condition = r"\1 BETWEEN TIMESTAMP '2026-01-01' AND TIMESTAMP '2026-12-31'"
    text = re.sub(r"\$__timeFilter\(([\w.]+)\)", condition, text)
    assert "$" not in text, text
    return text


@pytest.fixture(scope="module")
def shop(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    room = tmp_path_factory.mktemp("shop")
    folder = room / "five-days"
    shutil.copytree(EXAMPLES / "five-days", folder)
    stated = folder / "campaign.toml"
    text = stated.read_text(encoding="utf-8")
    stated.write_text(f"{text}\n[machine.tolerances]\nEB0C = 40.0\nEX0C = 20.0\n", encoding="utf-8")
    with Database(room / "shop.duckdb") as db:
        import_folders(db, ImportRequest([folder, Path("no-such-folder")]))
        identify(db, IdentifyRequest("five-days"))
        event(db, EventRequest("HU40-T", "belt changed", datetime(2026, 3, 4, tzinfo=UTC), "repair"))
        yield db


def test_there_is_a_query_in_every_part_of_the_dashboard() -> None:
    titles = [title for title, _, _ in QUERIES]
    assert len(titles) == 13
    assert {"machine", "model", "parameter", "Events", "Certificates", "Runs a week, all machines"} <= set(
        titles
    )


@pytest.mark.parametrize(("title", "format", "text"), QUERIES, ids=[title for title, _, _ in QUERIES])
def test_every_query_of_the_dashboard_runs(shop: Database, title: str, format: str, text: str) -> None:
    frame = shop.frame(as_asked(text))
    if title != "Certificates":
        assert len(frame) > 0, title
    if format == "time_series":
        assert str(frame["time"].dtype).startswith("datetime64")
        assert frame["time"].is_monotonic_increasing
        numbers = frame.drop(columns="time")
        assert len(numbers.columns) >= 1
        assert numbers.notna().all().all()


def test_the_trend_panel_shows_what_the_view_holds(shop: Database) -> None:
    text = next(text for title, _, text in QUERIES if title == "${parameter} of ${machine}")
    shown = shop.rows(as_asked(text))
    stored = shop.rows(
        "SELECT value / display_factor, u / display_factor FROM parameter_value JOIN run USING (run) "
        "WHERE parameter = 'EB0C' ORDER BY started_at"
    )
    drawn = np.array([(row[1], row[3] - row[1], row[1] - row[2]) for row in shown])
    assert len(stored) == 20
    assert drawn == pytest.approx(np.array([(value, 2 * u, 2 * u) for value, u in stored]), rel=1e-9)
