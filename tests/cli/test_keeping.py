"""Verification, audit, backup, restore and export, as typed; a database that was altered is found."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import pytest

from monitor.store import Database


@pytest.mark.parametrize(
    "sql",
    [
        "UPDATE probing SET sequence = sequence + 1000 WHERE run = 1",
        "UPDATE imported_campaign SET campaign = 'other' WHERE campaign = 'cold-cold'",
        "DELETE FROM audit WHERE entry = 2",
        "UPDATE audit SET actor = 'nobody' WHERE entry = 1",
        "UPDATE source_file SET content = 'x'::BLOB",
    ],
)
def test_verify_finds_what_was_altered(typed: Any, db: Path, sql: str) -> None:
    assert typed("verify", db=db).status == 0
    with Database(db) as opened:
        opened.execute(sql)
    answer = typed("verify", "--json", db=db)
    assert (answer.status, answer.document["ok"]) == (1, False)
    assert answer.document["faults"] != []
    said = typed("verify", db=db)
    assert said.status == 1
    assert f"{db} is NOT as it was written" in said.out


def test_a_backup_is_restored_to_the_same_answers(typed: Any, db: Path, tmp_path: Path) -> None:
    copy, back = tmp_path / "a copy ü.duckdb", tmp_path / "back.duckdb"
    assert "checked; its manifest lies beside it" in typed("backup", copy, db=db).out
    assert (tmp_path / "a copy ü.duckdb.manifest.json").is_file()
    assert typed("restore", copy, db=back).status == 0
    for arguments in (["campaigns"], ["runs", "five-days"], ["identify", "five-days"]):
        assert typed(*arguments, "--json", db=back).out == typed(*arguments, "--json", db=db).out
    assert typed("verify", db=back).status == 0


def test_an_incremental_backup_and_a_moment_as_typed(typed: Any, db: Path, tmp_path: Path) -> None:
    folder = tmp_path / "backups"
    folder.mkdir()
    refused = typed("backup", folder / "first.duckdb", "--incremental", db=db)
    assert (refused.status, refused.out) == (2, "")
    assert "make a full one there first: `monitor backup FILE`" in refused.err
    assert typed("backup", folder / "first.duckdb", db=db).status == 0
    before = typed("audit", "--last", 1000, "--json", db=db).document["entries"]
    assert typed("event", "HU40-T", "a crash", "--at", "2026-03-05", db=db).status == 0
    said = typed("backup", folder / "second.duckdb", "--incremental", db=db).out
    assert f"entries {len(before) + 1} to {len(before) + 1} of the audit, 2 rows since first.duckdb" in said
    nothing = typed("backup", folder / "third.duckdb", "--incremental", db=db)
    assert nothing.status == 0
    assert (
        f"nothing is new since second.duckdb, the newest backup there; {folder / 'third.duckdb'} was not made"
        in (nothing.out)
    )
    document = typed("backup", folder / "third.duckdb", "--incremental", "--json", db=db).document
    assert (document["new_file"], Path(document["file"]).name) == (False, "second.duckdb")
    assert not (folder / "third.duckdb").exists()
    at = before[0]["made_at"]
    early = typed("restore", folder, "--at", at, "--json", db=tmp_path / "early.duckdb")
    assert (early.status, early.document["last_entry"], early.document["faults"]) == (0, len(before), [])
    again = typed("restore", folder / "second.duckdb", db=tmp_path / "again.duckdb")
    assert (
        f"up to entry {len(before) + 1} of the audit, from first.duckdb, second.duckdb; it was verified"
        in again.out
    )
    assert typed("event", "HU40-T", "--json", db=tmp_path / "again.duckdb").document["events"] != []
    for wrong in (["--at", "yesterday"], ["--at", "2999-01-01"], ["--at", "1999-01-01"]):
        answer = typed("restore", folder, *wrong, db=tmp_path / "wrong.duckdb")
        assert (answer.status, answer.out) == (2, "")
        assert answer.err.startswith("monitor: --at ")


def test_files_are_archived_and_the_room_is_given_back_as_typed(typed: Any, db: Path, tmp_path: Path) -> None:
    archive = tmp_path / "archive"
    assert "nothing was imported before" in typed("archive", archive, "--before", "1999-01-01", db=db).out
    before = typed("identify", "five-days", "--json", db=db).out
    moved = typed("archive", archive, "--before", "2999-01-01", "--json", db=db).document
    assert moved["files"] >= 3
    assert " archive " in typed("audit", "--last", 1, db=db).out
    assert f"{moved['files']} files were archived; each is there" in typed("archive", archive, db=db).out
    small = typed("compact", "--json", db=db).document
    assert small["bytes_after"] < small["bytes_before"]
    assert typed("verify", db=db).status == 0
    assert typed("identify", "five-days", "--json", db=db).out == before
    next(archive.rglob("probings.csv")).write_bytes(b"")
    told = typed("archive", archive, db=db)
    assert (told.status, "1 are not as they were" in told.out) == (1, True)
    answer = typed("archive", archive, "--machine", "HU40-T", db=db)
    assert (answer.status, answer.out) == (2, "")
    assert "--machine says whose files are moved: name --before as well" in answer.err
    unknown = typed("archive", archive, "--before", "2999-01-01", "--machine", "HU4O-T", db=db)
    assert (unknown.status, unknown.out) == (2, "")


def test_a_damaged_backup_is_not_restored(typed: Any, db: Path) -> None:
    assert typed("backup", "copy.duckdb", db=db).status == 0
    damaged = bytearray(Path("copy.duckdb").read_bytes())
    damaged[len(damaged) // 2] ^= 1
    Path("copy.duckdb").write_bytes(damaged)
    answer = typed("restore", "copy.duckdb", db=Path("back.duckdb"))
    assert (answer.status, answer.out) == (2, "")
    assert not Path("back.duckdb").exists()


def test_restore_writes_over_nothing(typed: Any, db: Path, filled: Path) -> None:
    assert typed("backup", "copy.duckdb", db=db).status == 0
    before = db.read_bytes()
    answer = typed("restore", "copy.duckdb", db=db)
    assert answer.status == 2
    assert "exists already" in answer.err
    assert db.read_bytes() == before


def test_export_gives_every_number_back(typed: Any, db: Path, examples: Path) -> None:
    identified = typed("identify", "five-days", "--json", db=db).document
    assert typed("export", "tables", db=db).status == 0
    with open("tables/v_parameters.csv", newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["campaign"] == "five-days"]
    exported = {(int(row["run"]), row["parameter"]): float(row["value"]) for row in rows}
    assert len(exported) == 20 * 13
    for run in identified["runs"]:
        for name, one in run["parameters"].items():
            assert exported[run["run"], name] == pytest.approx(one["value"], rel=1e-12)
    files = {path.read_bytes() for path in Path("tables/source_files").rglob("probings.csv")}
    assert (examples / "five-days" / "probings.csv").read_bytes() in files


def test_audit_says_who_did_what_newest_first(typed: Any, db: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LOGNAME", "ada")
    assert (
        typed("event", "HU40-T", "a crash", "--at", "2026-03-05T07:00:00Z", "--kind", "crash", db=db).status
        == 0
    )
    table = typed("audit", "--last", 1, db=db).out.splitlines()
    assert len(table) == 2
    assert " ada " in table[1]
    entries = typed("audit", "--last", 10**6, "--json", db=db).document["entries"]
    assert [one["entry"] for one in entries] == list(range(len(entries), 0, -1))


def test_events_of_one_machine_in_words_that_mean_nothing_else(typed: Any, db: Path) -> None:
    words = 'it\'s "ü" [red]x[/red]; DROP TABLE event; --'
    assert typed("event", "HU40-T", words, "--at", "2026-03-05T07:00:00-05:00", db=db).status == 0
    listed = typed("event", "HU40-T", db=db).out
    assert words in listed
    assert "2026-03-05 12:00:00Z" in listed
    assert len(typed("event", "HU40-T", "--json", db=db).document["events"]) == 1


def test_the_same_question_has_the_same_answer(typed: Any, db: Path) -> None:
    for arguments in (["identify", "five-days"], ["stats", "five-days"], ["compare", "five-days"],
                      ["uncertainty", "five-days", "--method", "guf"], ["effects"]):  # fmt: skip
        more = [] if arguments[0] == "effects" else ["--db", db]
        first = typed(*arguments, "--json", *more).out
        assert typed(*arguments, "--json", *more).out == first
        assert json.loads(first) != {}
