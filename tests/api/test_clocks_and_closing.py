"""Tables say by which clock their moments are, messages name arguments, and what is closed does not answer."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

import pytest

import monitor as mm
from monitor.api.tables import main_table
from monitor.documents import IN_UTC
from monitor.exceptions import InputError

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@dataclass(frozen=True)
class Row:
    """A row with moments of two clocks."""

    machine: str
    since: datetime | None
    made_at: datetime = field(metadata=IN_UTC)


@dataclass(frozen=True)
class Listing:
    """An answer of rows."""

    machines: tuple[Row, ...]


def test_moments_of_a_table_say_their_clock() -> None:
    """The same run had two times in `machines()` and in the table of a report, and neither said which."""
    table = main_table(Listing((Row("M", None, datetime(2026, 3, 2)),)))
    assert table.attrs["meanings"] == {"since": "by the clock of the shop", "made_at": "in UTC"}


def test_a_closed_database_does_not_answer(tmp_path: Path) -> None:
    with mm.open(tmp_path / "shop.duckdb", new=True) as db:
        db.add(EXAMPLES / "cold-cold")
        assert "UTC" in db.machines().attrs["meanings"]["latest_run_at"]
        assert db.campaigns().attrs["meanings"]["imported_at"] == "in UTC"
        campaign = db.campaign("cold-cold")
        runs = campaign.runs()
        meanings = runs.attrs["meanings"]
        assert "in UTC" in meanings["started_at"]
        assert "shop" in meanings["started_at_local"]
        assert set(meanings) <= {*runs.columns}
    for question in (db.machines, db.campaigns, campaign.runs, campaign.parameters):
        with pytest.raises(
            InputError, match=r"this database is closed; open it again: mm\.open\(.*shop\.duckdb"
        ):
            question()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"machines": ["M", "m"]}, "^machines: each machine is named once"),
        (
            {"machines": ["M"], "events": [("2031-05-01", "EB0C", 9.0)]},
            "^events 2031-05-01 EB0C: the runs are of",
        ),
    ],
)
def test_messages_of_python_name_arguments(tmp_path: Path, options: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message) as refusal:
        mm.simulate(tmp_path / "out", like=EXAMPLES / "cold-cold", start="2026-01-12", months=2, **options)
    assert "--" not in str(refusal.value)
