"""The page of a campaign of which a run was broken off: explained without it, and nothing is compared."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from monitor.store import Database
from monitor.workflow.intake.importing import ImportRequest, import_folders
from tests.discovery.laser_along_x import laser_along_x


@pytest.mark.slow
def test_what_is_found_can_be_added_to_the_model(tmp_path: Path, serve: Callable[[Path, bool], Any]) -> None:
    """Was: "every campaign of ,", and a form that lacks 'to'."""
    positions = [50.0 * number for number in range(11)]
    folder = tmp_path / "broken"
    laser_along_x(folder, [positions, positions, positions], lambda x: 8.0 if x > 260.0 else 0.0, 1)
    table = folder / "probings.csv"
    rows = table.read_text(encoding="utf-8").splitlines()
    # Of the last run two positions alone.
    kept = [row for row in rows if not row.startswith("3,")]
    kept += [row for row in rows if row.startswith("3,")][:2]
    table.write_text("\n".join(kept) + "\n", encoding="utf-8")
    path = tmp_path / "monitor.duckdb"
    with Database(path, threads=1) as db:
        import_folders(db, ImportRequest([folder]))
    served = serve(path, False)
    for _ in range(600):
        page = served.client.get("/model?campaign=broken").text
        if "is being computed" not in page:
            break
        time.sleep(0.1)
    assert 'name="to" value="instruments@1"' in page
    assert "Of the other 2 runs" in page
