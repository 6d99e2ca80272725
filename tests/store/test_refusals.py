"""Refused imports: recorded once a day, settled by a later import, hashed into the audit chain."""

from __future__ import annotations

import shutil
from datetime import datetime
from pathlib import Path

import pytest

from monitor.exceptions import CampaignError, InputError
from monitor.store import Database, record_refusal, refusals, verify_audit
from monitor.workflow.intake.importing import ImportRequest, import_folders

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
MONDAY = datetime.fromisoformat("2026-03-02T23:30:00-05:00")


@pytest.fixture
def spoilt(tmp_path: Path) -> Path:
    folder = tmp_path / "cold-cold"
    shutil.copytree(EXAMPLES / "cold-cold", folder)
    probings = (folder / "probings.csv").read_text(encoding="utf-8").splitlines(keepends=True)
    probings[3] = probings[3].replace(probings[3].split(",")[4], "ninety", 1)
    (folder / "probings.csv").write_text("".join(probings), encoding="utf-8")
    return folder


def test_a_refused_folder_is_recorded_and_settled_when_it_is_imported_well(
    db: Database, spoilt: Path
) -> None:
    with pytest.raises(CampaignError, match="ninety"):
        import_folders(db, ImportRequest([spoilt]))
    (one,) = refusals(db)
    assert (one.folder, one.campaign, one.machine) == (str(spoilt), "cold-cold", "HU40-T")
    assert one.fault_count == 1
    assert "probings.csv, line 4, column x_mm" in one.faults[0]
    assert one.cleared_at is None
    assert db.rows("SELECT count(*) FROM campaign") == [(0,)]
    assert verify_audit(db).ok
    shutil.copyfile(EXAMPLES / "cold-cold" / "probings.csv", spoilt / "probings.csv")
    import_folders(db, ImportRequest([spoilt]))
    (one,) = refusals(db)
    assert one.imported_as == "cold-cold"
    assert one.cleared_at is not None
    assert verify_audit(db).ok
    db.execute("DELETE FROM refused_import")
    assert any("refused import 1" in fault for fault in verify_audit(db).faults)


def test_a_campaign_that_comes_from_another_folder_settles_it_too(db: Database, spoilt: Path) -> None:
    with pytest.raises(InputError, match="was refused, nothing of it was kept"):
        import_folders(db, ImportRequest([spoilt]))
    import_folders(db, ImportRequest([EXAMPLES / "five-days"]))
    assert refusals(db)[0].cleared_at is None
    import_folders(db, ImportRequest([EXAMPLES / "cold-cold"]))
    assert refusals(db)[0].imported_as == "cold-cold"


def test_folders_that_tell_no_names_are_recorded_by_their_path(db: Database, tmp_path: Path) -> None:
    missing, empty, file = tmp_path / "nowhere", tmp_path / "empty", tmp_path / "a-file"
    empty.mkdir()
    file.write_text("x", encoding="utf-8")
    bytes_in_the_name = Path(str(tmp_path) + "/caf\udce9")
    for folder in (missing, empty, file, bytes_in_the_name):
        with pytest.raises(CampaignError, match="was refused"):
            import_folders(db, ImportRequest([folder]))
    found = refusals(db)
    assert [one.folder for one in found[:3]] == [str(missing), str(empty), str(file)]
    assert found[3].folder.endswith("caf\\udce9")
    assert {(one.campaign, one.machine) for one in found} == {(None, None)}


def test_a_refused_folder_does_not_hinder_the_others(db: Database, spoilt: Path) -> None:
    answer = import_folders(db, ImportRequest([spoilt, EXAMPLES / "five-days"]))
    assert [refused.folder for refused in answer.refused] == [str(spoilt)]
    assert "was refused, nothing of it was kept" in answer.refused[0].why
    assert db.rows("SELECT campaign FROM campaign") == [("five-days",)]
    assert len(refusals(db)) == 1


def test_the_same_refusal_on_the_same_day_is_told_once(db: Database) -> None:
    first = record_refusal(db, "/data/in", ["a fault"], at=MONDAY)
    assert record_refusal(db, "/data/in", ["a fault"], at=MONDAY.replace(minute=45)) == first
    assert record_refusal(db, "/data/in", ["another fault"], at=MONDAY) == first + 1
    assert record_refusal(db, "/data/in", ["a fault"], at=MONDAY.replace(day=3)) == first + 2
    # 23:30 on Monday by the shop's clock is Tuesday in UTC: the day is the shop's.
    assert [one.number for one in refusals(db, datetime(2026, 3, 2), datetime(2026, 3, 3))] == [1, 2]


def test_many_faults_are_counted_and_the_first_kept(db: Database) -> None:
    record_refusal(db, "/data/in", [f"fault {place}" for place in range(1000)])
    (one,) = refusals(db)
    assert one.fault_count == 1000
    assert len(one.faults) == 20
