"""A campaign whose machine, probe or artefact another program wrote, or left out, is refused in words."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from monitor.exceptions import StoreError
from monitor.store import Database, described_machines, load_campaign
from monitor.workflow.intake.importing import ImportRequest, import_folders

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.fixture
def db(tmp_path: Path) -> Iterator[Database]:
    with Database(tmp_path / "monitor.duckdb", threads=1) as database:
        import_folders(database, ImportRequest([EXAMPLES / "r-test"]))
        yield database


@pytest.mark.parametrize("text", ["{}", "null", "[]", '{"axes": 3}', '{"axes": {}, "colour": "red"}'])
def test_a_machine_that_is_not_described_is_named(db: Database, text: str) -> None:
    db.execute("UPDATE imported_campaign SET machine_description = ?", [text])
    for read in (lambda: load_campaign(db, "r-test"), lambda: described_machines(db)):
        with pytest.raises(
            StoreError, match=r"no description of the machine.* of campaign 'r-test' that can be"
        ):
            read()


@pytest.mark.parametrize("column", ["probe", "artefact"])
def test_a_probe_or_an_artefact_that_is_not_described_is_named(db: Database, column: str) -> None:
    db.execute(f"UPDATE imported_campaign SET {column} = '{{}}'")
    with pytest.raises(StoreError, match="written or altered by another program"):
        load_campaign(db, "r-test")
    assert [machine.id for machine in described_machines(db)] == ["CENTRE-4"]
