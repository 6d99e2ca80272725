"""An event that is typed without an offset is by the clock of the shop, as the runs of the machine had it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from monitor.store import Database
from monitor.workflow.intake.importing import ImportRequest, import_folders

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def test_before_anything_is_identified_the_clock_is_that_of_the_imported_runs(
    tmp_path: Path, serve: Any
) -> None:
    """The clock of the server stood in for it, and what is recorded cannot be undone."""
    path = tmp_path / "a.duckdb"
    with Database(path, threads=1) as db:
        import_folders(db, ImportRequest([EXAMPLES / "five-days"]))
    served = serve(path, False)
    form = {
        "machine": "HU40-T",
        "text": "belt",
        "kind": "repair",
        "at": "02.03.2026 07:00",
        "proof": served.proof(),
    }
    assert served.sent("/machine/event", data=form).status_code == 200
    assert served.db.rows("SELECT strftime(happened_at, '%Y-%m-%dT%H:%M') FROM v_events") == [
        ("2026-03-02T12:00",)
    ]
