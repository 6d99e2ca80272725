"""A file that may be read and not written: what is computed is answered, not stored, and that is said once."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import duckdb
import pytest

from monitor.exceptions import StoreError
from monitor.records import Campaign
from monitor.store import (
    Database,
    SharedDatabase,
    StoredIdentification,
    analysis_text,
    compact,
    import_campaign,
    load_identification,
    record_event,
    save_analysis,
    save_identification,
)
from monitor.store.unwritable import why_not_written


class Reading:
    """The database of a campaign that may not be written, whoever asks, and what was said."""

    def __init__(self, path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.path, self.said = path, list[str]()
        self.before = self.files()
        monkeypatch.setattr(
            "monitor.store.sharing.why_not_written", lambda name: f"{name} may not be written"
        )

    def opened(self) -> SharedDatabase:
        return SharedDatabase(self.path, unstored=self.said.append)

    def files(self) -> dict[str, bytes]:
        """The file and all that lies beside it but the lock."""
        return {path.name: path.read_bytes() for path in self.path.parent.iterdir() if path.suffix != ".lock"}


@pytest.fixture
def identification(
    campaign: Campaign, make_identification: Callable[[Campaign], StoredIdentification]
) -> StoredIdentification:
    return make_identification(campaign)


@pytest.fixture
def reading(path: Path, campaign: Campaign, monkeypatch: pytest.MonkeyPatch) -> Reading:
    with Database(path) as db:
        import_campaign(db, campaign)
    return Reading(path, monkeypatch)


def test_an_answer_is_remembered_and_said_once_not_to_be_stored(reading: Reading, campaign: Campaign) -> None:
    with reading.opened() as db:
        numbers = [
            save_analysis(db, "comparison", {"of": count}, method="guf", campaign=campaign.name)
            for count in (1, 2)
        ]
        assert [analysis_text(db, number) for number in numbers] == ['{"of": 1}', '{"of": 2}']
        assert db.rows("SELECT count(*) FROM analysis") == [(0,)]
    assert reading.said == [f"the answer was not stored: {reading.path} may not be written"]
    assert reading.files() == reading.before


def test_an_answer_that_is_stored_already_needs_no_word(
    path: Path, campaign: Campaign, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Database(path) as db:
        import_campaign(db, campaign)
        stored = save_analysis(db, "statistics", {"of": 1}, method="by day", campaign=campaign.name)
    reading = Reading(path, monkeypatch)
    with reading.opened() as db:
        again = save_analysis(
            db, "statistics", {"of": 1}, method="by day", campaign=campaign.name, repeated=False
        )
    assert (again, reading.said) == (stored, [])


def test_what_is_identified_is_read_again_in_the_same_session_and_gone_behind_it(
    reading: Reading,
    campaign: Campaign,
    identification: StoredIdentification,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    folders: list[str] = []
    monkeypatch.setattr("monitor.store.sharing._IDLE_ALONE_S", 0.0)
    with reading.opened() as db:
        save_identification(db, identification)
        folders += [os.path.dirname(db.rows("SELECT path FROM duckdb_databases() WHERE NOT internal")[0][0])]
        assert os.stat(folders[0]).st_mode & 0o077 == 0
        loaded = load_identification(db, campaign.name)
        assert loaded.runs[0].estimate == pytest.approx(identification.runs[0].estimate, nan_ok=True)
        # A change is refused as ever, also behind an answer.
        monkeypatch.setattr("monitor.store.sharing.connect", _refused)
        with pytest.raises(StoreError, match="permission denied"):
            record_event(db, campaign.machine.id, campaign.runs[0].started_at, "crash", "hit the vice")
    assert not os.path.exists(folders[0])
    assert len(reading.said) == 1
    assert reading.files() == reading.before


def test_a_question_of_a_long_session_sees_what_others_stored_since_the_copy(
    reading: Reading, campaign: Campaign, identification: StoredIdentification
) -> None:
    """A notebook that is open for days answered from its copy until it was closed."""
    seen = "SELECT (SELECT count(*) FROM identification), (SELECT count(*) FROM event)"
    with reading.opened() as db:
        save_identification(db, identification)
        db.begin_question()
        # Nobody wrote the file: what the session identified is still there.
        assert db.rows(seen) == [(1, 0)]
        with Database(reading.path) as other:
            record_event(other, campaign.machine.id, campaign.runs[0].started_at, "crash", "hit the vice")
        # Within a question the copy stays.
        assert db.rows(seen) == [(1, 0)]
        db.begin_question()
        assert db.rows(seen) == [(0, 1)]
        save_identification(db, identification)
        assert db.rows(seen) == [(1, 1)]


def _refused(path: str, *options: object) -> None:
    raise StoreError(f"{path} may not be opened by this user for writing: permission denied")


def test_a_log_that_a_crash_left_is_part_of_what_is_copied(
    reading: Reading, campaign: Campaign, identification: StoredIdentification
) -> None:
    with Database(reading.path) as db:
        record_event(db, campaign.machine.id, campaign.runs[0].started_at, "crash", "hit the vice")
        left = {ending: Path(f"{reading.path}{ending}").read_bytes() for ending in ("", ".wal", ".blocks")}
    for ending, content in left.items():
        Path(f"{reading.path}{ending}").write_bytes(content)
    assert len(left[".wal"]) > 0
    before = reading.files()
    with reading.opened() as db:
        save_identification(db, identification)
        assert db.rows("SELECT count(*) FROM event") == [(1,)]
    assert reading.files() == before


def test_no_room_for_the_copy_is_said(
    reading: Reading, identification: StoredIdentification, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: str, copy: str) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("monitor.store.unwritable._copy", full)
    with (
        reading.opened() as db,
        pytest.raises(StoreError, match=r"no room for the copy in .*TMPDIR.*: No space left"),
    ):
        save_identification(db, identification)


def test_why_a_file_may_not_be_written(path: Path, tmp_path: Path) -> None:
    assert why_not_written(":memory:") is None
    assert why_not_written(str(path)) is None  # it is made
    Database(path).close()
    assert why_not_written(str(path)) is None
    os.link(path, tmp_path / "other name")
    assert why_not_written(str(path)) == f"{path} has several names (hard links)"


def test_no_folder_for_the_copy_is_said(
    reading: Reading, identification: StoredIdentification, monkeypatch: pytest.MonkeyPatch
) -> None:
    def nowhere(**options: object) -> str:
        raise FileNotFoundError(2, "No usable temporary directory found")

    monkeypatch.setattr("tempfile.TemporaryDirectory", nowhere)
    with reading.opened() as db, pytest.raises(StoreError, match=r"TMPDIR.*: No usable temporary directory"):
        save_identification(db, identification)


@pytest.mark.parametrize("kind", [Database, SharedDatabase])
def test_a_mount_for_reading_is_no_damaged_file(
    path: Path, monkeypatch: pytest.MonkeyPatch, kind: type[Database]
) -> None:
    """It was advised to restore a backup; `compact` ended with status 3 (as seen on a tmpfs that was mounted so)."""
    Database(path).close()

    def refused(name: str, *options: object, read_only: bool = False, **config: object) -> object:
        raise duckdb.IOException(f'IO Error: Cannot open file "{name}": Read-only file system')

    with monkeypatch.context() as patch:
        patch.setattr(duckdb, "connect", refused)
        with (
            pytest.raises(StoreError, match="lies on a file system that can only be read; nothing"),
            kind(path),
        ):
            pass
    with kind(path) as db:
        monkeypatch.setattr(
            "monitor.store.copies.compaction.why_not_written", lambda name: f"{name} may not be"
        )
        with pytest.raises(StoreError, match=r"may not be; it stays as it was"):
            compact(db)


_AS_NOBODY = """
import os, sys, warnings
from monitor.store import Database, SharedDatabase, load_identification, save_identification, verify_audit
from monitor.store.unwritable import why_not_written
import monitor.api
with Database(":memory:") as db: verify_audit(db)
with Database(sys.argv[3]) as db: save_identification(db, load_identification(db, sys.argv[4]))
os.setuid(65534)
for name in sys.argv[1:3]:
    with SharedDatabase(name, unstored=print) as db:
        save_identification(db, load_identification(db, sys.argv[4]))
        print(db.rows("SELECT count(*) FROM identification")[0][0])
with warnings.catch_warnings(record=True) as told:
    warnings.simplefilter("always")
    with monitor.open(sys.argv[1]) as shop:
        save_identification(shop._store, load_identification(shop._store, sys.argv[4]))
    print(*(warning.message for warning in told))
"""


def test_another_user_gets_answers_of_a_file_and_of_a_folder_that_he_may_not_write(
    tmp_path: Path, campaign: Campaign, identification: StoredIdentification
) -> None:
    if os.geteuid() != 0:
        pytest.skip("only root can become another user")
    shut = [folder for folder in tmp_path.parents if folder.stat().st_mode & 0o005 != 0o005]
    if any(not str(folder).startswith(str(tmp_path.parents[2])) for folder in shut):
        pytest.skip("the temporary folder is closed to other users")
    names = []
    for mode, of_folder in ((0o444, 0o777), (0o666, 0o555), (0o600, 0o700)):
        folder = tmp_path / f"{mode:o}"
        folder.mkdir()
        with Database(folder / "shop.duckdb") as db:
            import_campaign(db, campaign)
            save_identification(db, identification)
        (folder / "shop.duckdb").chmod(mode)
        folder.chmod(of_folder)
        names.append(str(folder / "shop.duckdb"))
    for folder in (tmp_path, *shut):
        folder.chmod(0o755)
    said = subprocess.run(
        [sys.executable, "-c", _AS_NOBODY, *names, campaign.name], capture_output=True, text=True, check=False
    )
    assert said.stdout.splitlines() == [
        f"the answer was not stored: {names[0]} may not be written by this user",
        "2",
        f"the answer was not stored: {Path(names[1]).parent} may not be written by this user",
        "2",
        f"the answer was not stored: {names[0]} may not be written by this user",
    ], said.stderr
