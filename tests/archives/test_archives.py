"""Databases of every released version are opened by this one, and hold what they held."""

from __future__ import annotations

import gzip
import importlib.util
import json
from pathlib import Path
from types import ModuleType

import duckdb
import pytest

from monitor import __version__
from monitor.store import (
    Database,
    curves,
    import_campaign,
    import_curve,
    load_campaign,
    record_json,
    verify_audit,
)

HERE = Path(__file__).resolve().parent
ARCHIVES = sorted(HERE.glob("monitor-*.duckdb.gz"))
#: Written by commit 18700241, before setups had a drift and the uncertainties of tool points and scales.
FEWER_KEYS = HERE / "instruments-2026-11-24.duckdb.gz"
#: Tables of which an entry of the audit holds whole rows, with every column.
HELD_AS_ROWS = (
    "analysis", "event", "import_note", "refusal_cleared", "refused_import", "selection", "withdrawn_campaign",
)  # fmt: skip


def _module(name: str) -> ModuleType:
    specification = importlib.util.spec_from_file_location(name, HERE / f"{name}.py")
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def maker() -> ModuleType:
    """``make_archive.py``, loaded by its path."""
    return _module("make_archive")


@pytest.fixture
def fewer_keys(tmp_path: Path) -> Path:
    """A database whose setups, machine and probe have fewer keys than those of today."""
    path = tmp_path / "archive.duckdb"
    path.write_bytes(gzip.decompress(FEWER_KEYS.read_bytes()))
    return path


def test_this_version_has_an_archive() -> None:
    assert HERE / f"monitor-{__version__}.duckdb.gz" in ARCHIVES


@pytest.mark.parametrize("archive", ARCHIVES, ids=lambda path: path.name)
def test_archive_opens_and_holds_what_it_held(archive: Path, maker: ModuleType, tmp_path: Path) -> None:
    path = tmp_path / "archive.duckdb"
    path.write_bytes(gzip.decompress(archive.read_bytes()))
    expected = json.loads(
        archive.with_name(archive.name.replace(".duckdb.gz", ".json")).read_text(encoding="utf-8")
    )
    with Database(path) as db:
        assert verify_audit(db).faults == ()
        assert maker.expected(db) == expected
        assert import_campaign(db, maker.small_campaign()).state == "unchanged"


def test_records_that_had_fewer_keys_when_they_were_written_are_as_they_were(fewer_keys: Path) -> None:
    """Until 27 November 2026 every campaign of instruments that an earlier version stored was called altered."""
    maker = _module("make_instruments")
    with Database(fewer_keys) as db:
        ((artefact,),) = db.rows("SELECT artefact FROM imported_campaign WHERE campaign = 'instruments'")
        assert "drift_uncertainty" not in artefact
        assert verify_audit(db).faults == ()
        assert load_campaign(db, "instruments").artefact == maker.instruments().artefact
        # Without files the content decides, which this version describes with more keys.
        assert import_campaign(db, maker.instruments()).state == "unchanged"
        assert import_curve(db, maker.curve()).state == "unchanged"


@pytest.mark.parametrize(
    ("column", "before", "after"),
    [
        ("artefact", '"certificate": "L-1"', '"certificate": "L-2"'),
        ("artefact", '"turn_uncertainty": 5e-06', '"turn_uncertainty": 5e-06, "drift_uncertainty": null'),
        ("artefact", '"turn_uncertainty": 5e-06', '"turn_uncertainty": 5e-06, "drift_uncertainty": 0.01'),
        ("artefact", '"id": "bar"', '"id": "other", "id": "bar"'),
        ("probe", '"tip": null', '"tip": null, "scale_uncertainty": null'),
        ("machine_description", '"id": "M-2"', '"id": "M-2", "virtual": false'),
        ("machine_description", '"gear_ratio": 90.0', '"gear_ratio": 90.00'),
        # Of a key that stands there twice the database reads the first and Python the last.
        ("machine_description", '"model": "cell"', '"model": "other", "model": "cell"'),
    ],
)
def test_whatever_somebody_alters_in_records_with_fewer_keys_is_seen(
    fewer_keys: Path, column: str, before: str, after: str
) -> None:
    with Database(fewer_keys) as db:
        name = db.rows(
            f"SELECT campaign FROM imported_campaign WHERE contains({column}, ?) ORDER BY campaign_id",
            [before],
        )[0][0]
        db.execute(
            f"UPDATE imported_campaign SET {column} = replace({column}, ?, ?) WHERE campaign = ?",
            [before, after, name],
        )
        assert f"campaign {name} was altered after it was stored" in verify_audit(db).faults


def test_a_key_that_a_later_version_adds_to_a_record_accuses_nobody(
    fewer_keys: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever this version writes of a machine, probe or artefact, what is stored has the hash of then."""
    for write in ("machine_json", "probe_json", "artefact_json"):
        monkeypatch.setattr(record_json, write, lambda *_: '{"of a later version": null}')
    monkeypatch.setattr(curves, "asdict", lambda record: {"of a later version": None})
    with Database(fewer_keys) as db:
        assert verify_audit(db).faults == ()


@pytest.mark.parametrize("table", HELD_AS_ROWS)
def test_a_table_whose_rows_are_held_whole_gets_no_further_column(fewer_keys: Path, table: str) -> None:
    """What a later version adds goes into a table of its own, or all rows of before are called altered."""
    question = "SELECT column_name FROM duckdb_columns() WHERE table_name = ? ORDER BY column_index"
    with duckdb.connect(fewer_keys, read_only=True) as before:
        columns = before.execute(question, [table]).fetchall()
    with Database(fewer_keys) as db:
        assert columns
        assert db.rows(question, [table]) == columns


def test_archives_stay_small() -> None:
    assert [path.name for path in [*ARCHIVES, FEWER_KEYS] if path.stat().st_size > 1_000_000] == []
