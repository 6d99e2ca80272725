"""Databases of every released version are opened by this one, and hold what they held."""

from __future__ import annotations

import gzip
import importlib.util
import json
from pathlib import Path
from types import ModuleType

import pytest

from monitor import __version__
from monitor.store import Database, import_campaign, verify_audit

HERE = Path(__file__).resolve().parent
ARCHIVES = sorted(HERE.glob("*.duckdb.gz"))


@pytest.fixture(scope="module")
def maker() -> ModuleType:
    """``make_archive.py``, loaded by its path."""
    specification = importlib.util.spec_from_file_location("make_archive", HERE / "make_archive.py")
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


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


def test_archives_stay_small() -> None:
    assert [path.name for path in ARCHIVES if path.stat().st_size > 1_000_000] == []
