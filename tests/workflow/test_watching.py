"""A watched folder: complete campaigns are taken in once, whatever is killed; half and bad ones stay where they are."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from datetime import UTC, datetime
from email.message import EmailMessage
from pathlib import Path
from typing import Any

import pytest

from monitor.exceptions import InputError
from monitor.store import Database, SharedDatabase
from monitor.workflow.health import report as reporting
from monitor.workflow.health.report import report
from monitor.workflow.health.request import ReportRequest
from monitor.workflow.health.task import Task, computed
from monitor.workflow.intake.importing import ImportRequest, import_folders
from monitor.workflow.watching import letter, watch as watching
from monitor.workflow.watching.request import WatchAnswer, WatchRequest
from monitor.workflow.watching.watch import watch

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
#: The week of the runs of the campaign.
WEEK, MADE = "2012-W10", datetime(2012, 3, 12, tzinfo=UTC)
MAIL = '[mail]\nserver = "localhost"\nsecurity = "none"\nfrom = "m@example.org"\nto = ["you@example.org"]\n'


@pytest.fixture
def arrived(tmp_path: Path) -> Path:
    """A watched folder with one campaign of four runs."""
    shutil.copytree(EXAMPLES / "tilting-table", tmp_path / "in" / "tilting-table")
    return tmp_path / "in"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "shop.duckdb"


def counts(path: Path) -> tuple[int, int, int]:
    """Imported campaigns, identifications and marks."""
    with Database(path, read_only=True) as db:
        ((imported,),) = db.rows("SELECT count(*) FROM imported_campaign")
        ((identified,),) = db.rows("SELECT count(*) FROM identification")
        ((marks,),) = db.rows("SELECT count(*) FROM analysis WHERE kind = 'watched arrival'")
    return imported, identified, marks


def look(path: Path, folder: Path, **settings: Any) -> WatchAnswer:
    with SharedDatabase(path, threads=1) as db:
        return watch(db, WatchRequest(folder, **{"rest_s": 0.0, **settings}))


def test_what_came_is_imported_and_identified_once(path: Path, arrived: Path) -> None:
    before = {file: file.stat().st_mtime_ns for file in arrived.rglob("*")}
    first = look(path, arrived)
    assert [(campaign.campaign, campaign.state, campaign.identified) for campaign in first.arrived] == [
        ("tilting-table", "imported", True)
    ]
    assert not look(path, arrived).news
    assert counts(path) == (1, 1, 1)
    assert {file: file.stat().st_mtime_ns for file in arrived.rglob("*")} == before


def test_a_bad_one_is_named_once_with_its_faults_and_again_when_it_changed(path: Path, arrived: Path) -> None:
    table = arrived / "tilting-table" / "probings.csv"
    whole = table.read_bytes()
    table.write_bytes(whole + b"x\n")
    (refused,) = look(path, arrived).refused
    assert "probings.csv, line" in refused.why
    assert not look(path, arrived).news
    table.write_bytes(whole)
    assert [campaign.state for campaign in look(path, arrived).arrived] == ["imported"]


def test_a_half_copied_folder_waits(path: Path, arrived: Path) -> None:
    """Copying programs keep the time of the original (``cp -p``): it is the copy's own that counts."""
    shutil.copy2(arrived / "tilting-table" / "runs.csv", arrived / "tilting-table" / "late.csv")
    os.utime(arrived / "tilting-table" / "late.csv", (0, 0))
    (waiting,) = look(path, arrived, rest_s=600.0).waiting
    assert "may still be copied" in waiting.why
    (arrived / "tilting-table" / "campaign.toml").rename(arrived / "campaign.toml.part")
    (waiting,) = look(path, arrived).waiting
    assert waiting.why == "it has no campaign.toml"
    assert counts(path) == (0, 0, 0)


def test_zips_and_lone_workbooks(path: Path, tmp_path: Path) -> None:
    folder = tmp_path / "zips"
    folder.mkdir()
    shutil.make_archive(str(folder / "cell"), "zip", EXAMPLES, "load-cell")
    (folder / "cut.zip").write_bytes((folder / "cell.zip").read_bytes()[:500])
    (folder / "alone.xlsx").write_bytes(b"")
    (folder / "loose.csv").write_bytes(b"")
    (folder / "truth.csv").write_bytes(b"")
    answer = look(path, folder)
    assert [(campaign.campaign, campaign.rows, campaign.identified) for campaign in answer.arrived] == [
        ("load-cell", 44, True)
    ]
    assert [
        "a workbook alone is no campaign" in answer.refused[0].why,
        "was cut off" in answer.refused[1].why,
        "a table alone is no campaign" in answer.refused[2].why,
    ] == [True] * 3
    # What a rehearsal writes beside its folders is nobody's campaign.
    assert len(answer.refused) == 3
    assert not look(path, folder).news


@pytest.mark.parametrize("where", ["identify", "save_analysis"])
def test_what_was_killed_goes_on_without_doing_anything_twice(
    path: Path, arrived: Path, where: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def killed(*arguments: object, **more: object) -> None:
        raise KeyboardInterrupt("killed here")

    with monkeypatch.context() as patch:
        patch.setattr(watching, where, killed)
        with pytest.raises(KeyboardInterrupt, match="killed here"):
            look(path, arrived)
    (campaign,) = look(path, arrived).arrived
    assert (campaign.state, campaign.identified) == ("unchanged", True)
    assert counts(path) == (1, 1, 1)


@pytest.mark.slow
def test_two_watchers_at_one_folder_share_the_work(path: Path, arrived: Path) -> None:
    shutil.copytree(EXAMPLES / "load-cell", arrived / "load-cell")
    command = [
        sys.executable,
        "-m",
        "monitor",
        "--db",
        str(path),
        "watch",
        str(arrived),
        "--once",
        "--rest",
        "0",
    ]
    watchers = [
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) for _ in range(2)
    ]
    said = [watcher.communicate(timeout=240) for watcher in watchers]
    assert [watcher.returncode for watcher in watchers] == [0, 0], said
    lines = "".join(out for out, _ in said)
    assert (lines.count("tilting-table: imported"), lines.count("load-cell: imported")) == (1, 1), lines
    assert counts(path) == (2, 1, 2)


def test_the_letter_says_what_came_and_comes_again_where_it_was_not_sent(
    path: Path, arrived: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mail.toml").write_text(MAIL)
    (arrived / "bad.zip").write_bytes(b"PK")
    letters: list[EmailMessage] = []

    def unsent(settings: object, message: EmailMessage) -> tuple[str, ...]:
        letters.append(message)
        if len(letters) == 1:
            raise InputError("the mail server is away")
        return ("you@example.org",)

    monkeypatch.setattr(letter, "send", unsent)
    with pytest.raises(InputError, match="the mail server is away"):
        look(path, arrived, mail=tmp_path / "mail.toml")
    answer = look(path, arrived, mail=tmp_path / "mail.toml")
    assert answer.mailed_to == ("you@example.org",)
    assert letters[1]["Subject"] == "Campaigns: 1 imported, 1 refused"
    assert "bad.zip is no zip, or was cut off" in letters[1].get_content()
    assert not look(path, arrived, mail=tmp_path / "mail.toml").news
    assert len(letters) == 2


def test_the_report_is_of_the_week_of_the_last_run(
    path: Path, arrived: Path, tmp_path: Path, pdf_unread: Callable[[], Any]
) -> None:
    with pdf_unread():
        answer = look(path, arrived, reports=tmp_path / "reports")
    assert answer.report is not None
    last = max(
        run.split(",")[1] for run in (arrived / "tilting-table" / "runs.csv").read_text().splitlines()[1:]
    )
    assert answer.report.from_ <= last[:10] <= answer.report.to


def test_without_a_report_what_the_next_one_rests_on_is_stored(
    path: Path, arrived: Path, tmp_path: Path, pdf_unread: Callable[[], Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The report has nothing to compute, and says what one says that computes everything."""
    look(path, arrived)
    fresh = tmp_path / "fresh.duckdb"
    tasks: list[Task | None] = []
    monkeypatch.setattr(reporting, "computed", lambda task: tasks.append(task) or computed(task))
    pages = []
    for database in (path, fresh):
        with Database(database, threads=1) as db, pdf_unread():
            import_folders(db, ImportRequest([arrived / "tilting-table"]))
            answer = report(db, ReportRequest(WEEK, out=tmp_path / database.stem, made_at=MADE))
        pages.append(
            re.sub("number [0-9]+, has the SHA-256 [0-9a-f]+", "", Path(answer.files[0]).read_text())
        )
    assert tasks[0] is None
    assert tasks[1] is not None
    assert pages[0] == pages[1]


@pytest.mark.parametrize(
    ("settings", "message"), [({"rest_s": -1.0}, "--rest -1"), ({"rest_s": float("nan")}, "--rest nan")]
)
def test_nonsense_is_refused(tmp_path: Path, settings: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        WatchRequest(tmp_path, **settings)
    with pytest.raises(InputError, match="is no folder; name the one"):
        WatchRequest(tmp_path / "nowhere")
