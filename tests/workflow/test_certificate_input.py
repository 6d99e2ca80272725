"""What people type wrongly when they issue a certificate is answered in words, and leaves nothing behind."""

from __future__ import annotations

import errno
import os
from datetime import date
from pathlib import Path

import pytest

from monitor.exceptions import InputError
from monitor.reporting.certificate.grounds import GroundKind
from monitor.store import Database
from monitor.workflow.certificate.files import prepared, why_not
from monitor.workflow.certificate.issue import issue
from monitor.workflow.certificate.request import CertificateRequest
from monitor.workflow.intake.importing import ImportRequest, import_folders

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
LABORATORY = EXAMPLES / "laboratory.toml"
DAY = date(2026, 3, 12)


def test_the_run_may_be_left_out_where_there_is_one_only(tmp_path: Path, pdf_unread) -> None:
    with Database(tmp_path / "c.duckdb") as db, pdf_unread():
        import_folders(db, ImportRequest([EXAMPLES / "tilting-table-compensated", EXAMPLES / "five-days"]))
        made = issue(
            db,
            CertificateRequest(
                "tilting-table-compensated",
                None,
                laboratory=LABORATORY,
                out=tmp_path,
                issued_on=DAY,
                accept={GroundKind.UNITS: "simulated without noise"},
            ),
        )
        assert made.certificate.runs == (1,)
        with pytest.raises(InputError, match=r"five-days has 20 runs \(1 to 20\): --run N says which one"):
            issue(
                db, CertificateRequest("five-days", None, laboratory=LABORATORY, out=tmp_path, issued_on=DAY)
            )
        with pytest.raises(
            InputError, match=f"the number {made.certificate.number} is taken, by the issued certificate"
        ):
            issue(
                db,
                CertificateRequest(
                    "five-days",
                    20,
                    laboratory=LABORATORY,
                    out=tmp_path,
                    number=made.certificate.number,
                    issued_on=DAY,
                ),
            )
        in_the_way = tmp_path / "file"
        in_the_way.write_text("x")
        with pytest.raises(InputError, match="file is a file, not a folder"):
            issue(
                db,
                CertificateRequest(
                    "tilting-table-compensated",
                    1,
                    laboratory=LABORATORY,
                    out=in_the_way,
                    issued_on=DAY,
                    accept={GroundKind.UNITS: "simulated without noise"},
                ),
            )


def test_why_not_says_what_stands_in_the_way(tmp_path: Path) -> None:
    full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert why_not(tmp_path / "new" / "folder", full) == "No space left on device"
    (tmp_path / "file").write_text("x")
    assert why_not(tmp_path / "file" / "folder", full).endswith("file is a file, not a folder")


def test_of_a_file_that_does_not_fit_on_the_disk_nothing_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InputError, match="No space left on device"):
        prepared(tmp_path / "c.pdf", b"content")
    assert list(tmp_path.iterdir()) == []
