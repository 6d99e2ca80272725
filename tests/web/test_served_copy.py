"""A database that may be read and not written is served to viewers; what others store is seen with the next page."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from monitor.readers import read_campaign
from monitor.store import Database, import_campaign, record_event
from monitor.web.app import application
from monitor.web.opening import opened
from monitor.web.settings import ServerSettings

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "five-days"


@pytest.fixture
def shop(tmp_path: Path) -> Path:
    path = tmp_path / "shop.duckdb"
    with Database(path) as db:
        import_campaign(db, read_campaign(EXAMPLE))
    return path


def _events(client: TestClient) -> list[str]:
    answer = client.post("/api/v1/sql", json={"query": "SELECT description FROM event ORDER BY ALL"})
    assert answer.status_code == 200, answer.text
    return [row[0] for row in answer.json()["rows"]]


def test_viewers_see_what_others_stored_and_nobody_is_kept_from_the_file(
    shop: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    room = tmp_path / "room"
    room.mkdir()
    monkeypatch.setattr("monitor.web.opening.why_not_written", lambda path: f"{path} may not be written")
    before = shop.read_bytes()
    with opened(shop, room) as served:
        assert served.unwritten == f"{shop} may not be written"
        settings = ServerSettings(database=shop, reading_only=True)
        gate = application(served.db, settings, room, served.copies)
        client = TestClient(gate, base_url="http://127.0.0.1:8765")
        assert client.get("/").status_code == 200
        assert _events(client) == []
        assert client.post("/api/v1/event", json={"machine": "HU40-T"}).status_code == 403
        assert shop.read_bytes() == before
        for number in range(3):
            # Nobody has the file: another process writes it at once.
            with Database(shop) as db:
                record_event(
                    db, "HU40-T", datetime(2026, 3, 1 + number, tzinfo=UTC), "repair", f"event {number}"
                )
            assert _events(client) == [f"event {seen}" for seen in range(number + 1)]
        copies = [Path(served.db.path)]
        gate.close()
    assert not any(copy.exists() for copy in copies)


def test_a_file_that_may_be_written_is_served_itself(shop: Path, tmp_path: Path) -> None:
    with opened(shop, tmp_path) as served:
        assert (served.unwritten, served.copies, served.db.path) == (None, None, str(shop))
