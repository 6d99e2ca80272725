"""What the database writes is its owner's alone from its first byte, whatever mode the process gives its files."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from monitor.records import Campaign
from monitor.store import (
    Database,
    archive_files,
    compact,
    export_tables,
    import_campaign,
    record_event,
    restore,
    take_backup,
    take_increment,
)

OTHERS = 0o077


@pytest.fixture
def open_to_all() -> Iterator[None]:
    """A process whose files anybody may read and write."""
    before = os.umask(0)
    yield
    os.umask(before)


@pytest.fixture
def modes(monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    """The mode that each file had before it was changed: what anybody could open it with until then."""
    seen: dict[str, int] = {}

    def noted(function: Callable[..., Any]) -> Callable[..., Any]:
        def called(path: Any, *arguments: Any, **options: Any) -> Any:
            if Path(path).is_file():
                seen.setdefault(Path(path).name, stat.S_IMODE(os.stat(path).st_mode))
            return function(path, *arguments, **options)

        return called

    for name in ("chmod", "replace"):
        monkeypatch.setattr(os, name, noted(getattr(os, name)))
    return seen


@pytest.mark.usefixtures("open_to_all", "made_anew")
def test_everything_is_its_owners_alone_from_its_first_moment(
    tmp_path: Path, make_campaign: Callable[..., Campaign], modes: dict[str, int]
) -> None:
    path, backups = tmp_path / "shop.duckdb", tmp_path / "backups"
    backups.mkdir(mode=0o755)
    campaign = make_campaign("one", files=(("probings.csv", b"1,2,3\n"),))
    with Database(path) as db:
        import_campaign(db, campaign)
        take_backup(db, backups / "full.duckdb")
        record_event(db, campaign.machine.id, datetime(2026, 1, 1, tzinfo=UTC), "crash", "x")
        take_increment(db, backups / "next.duckdb")
        export_tables(db, tmp_path / "exported")
        archive_files(db, tmp_path / "archive", datetime(2999, 1, 1))
        compact(db)
    restore(backups / "next.duckdb", tmp_path / "again.duckdb")
    assert {"shop.duckdb.new", "full.duckdb.partial", "next.duckdb.partial", "shop.duckdb.partial"} <= set(
        modes
    )
    assert {name: oct(mode) for name, mode in modes.items() if mode & OTHERS} == {}
    reached = [file for file in tmp_path.rglob("*") if file.is_file()]
    assert {file.name for file in reached} >= {"again.duckdb", "full.duckdb", "SHA256SUMS", "run.csv"}
    # Files of an export may have any mode: nobody else enters their folder.
    assert stat.S_IMODE((tmp_path / "exported").stat().st_mode) == 0o700
    assert {
        str(file.relative_to(tmp_path)): oct(file.stat().st_mode)
        for file in reached
        if file.stat().st_mode & OTHERS and tmp_path / "exported" not in file.parents
    } == {}
    assert os.umask(0) == 0
