"""The life of certificates as a user types it: drafts, numbers, files, amended, withdrawn."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pypdf
import pytest

from monitor.store import Database
from monitor.workflow.certificate.issue import _in_force
from monitor.workflow.certificate.orders import Measured
from monitor.workflow.certificate.request import CertificateRequest


def text_of(file: Path) -> str:
    return "\n".join(page.extract_text() for page in pypdf.PdfReader(file).pages)


@pytest.mark.slow
def test_withdrawn_is_no_longer_valid_and_says_why(typed: Any, issued: Any) -> None:
    answer = typed(
        "certificate", "withdraw", "2026-0001", "--reason", 'the bar\'s "damage"', "--json", db=issued.db
    )
    assert (answer.document["state"], answer.document["reason"]) == ("withdrawn", 'the bar\'s "damage"')
    found = typed("certificate", "verify", issued.file("2026-0001"), "--json", db=issued.db)
    assert found.status == 1
    assert found.document["checks"]["hash"] is True
    assert found.document["checks"]["database"] is False
    assert found.document["faults"] == [
        'certificate 2026-0001 is withdrawn, no longer valid: the bar\'s "damage"'
    ]
    assert typed("certificate", "verify", issued.file("2026-0002"), db=issued.db).status == 0
    again = typed("certificate", "withdraw", "2026-0001", "--reason", "once more", db=issued.db)
    assert again.status == 2
    assert "certificate 2026-0001 is withdrawn; that is final" in again.err


@pytest.mark.slow
def test_17025_7_8_8_amending_issues_a_new_certificate_that_names_the_old(
    typed: Any, issued: Any, laboratory: Path
) -> None:
    amend = ["certificate", "amend", "2026-0001", "--laboratory", laboratory, "--out", "new.pdf"]
    refused = typed(*amend, "--reason", " ", db=issued.db)
    assert refused.status == 2
    assert "say why certificate 2026-0001 is replaced: --reason TEXT" in refused.err
    made = typed(
        *amend, "--reason", "wrong customer", "--date", "2026-03-11", "--json", db=issued.db
    ).document
    assert (made["number"], made["campaign"], made["runs"]) == ("2026-0004", "five-days", [20])
    assert "replaces certificate 2026-0001 of 2026-03-10. Reason: wrong customer" in text_of(Path("new.pdf"))
    found = typed("certificate", "verify", issued.file("2026-0001"), "--json", db=issued.db)
    assert (found.status, found.document["state"]) == (1, "amended")
    assert (
        "certificate 2026-0001 is amended, no longer valid, replaced by 2026-0004: wrong customer"
        in found.document["faults"]
    )
    assert typed("certificate", "verify", "new.pdf", db=issued.db).status == 0
    again = typed(*amend, "--reason", "x", db=issued.db)
    assert again.status == 2
    assert "certificate 2026-0001 is amended; only an issued one can be replaced" in again.err


@pytest.mark.slow
def test_a_draft_says_so_on_paper_and_when_verified(
    typed: Any, db: Path, laboratory: Path, pdf_unread: Any
) -> None:
    issue = [
        "certificate",
        "issue",
        "cold-cold",
        "--run",
        3,
        "--laboratory",
        laboratory,
        "--draft",
        "--number",
        "D-1",
    ]
    made = typed(*issue, "--out", "draft.pdf", "--json", db=db).document
    assert (made["state"], made["file"]) == ("draft", "draft.pdf")
    assert "DRAFT, not valid" in text_of(Path("draft.pdf"))
    # On every page: in the running head, and across it.
    pages = [page.extract_text() for page in pypdf.PdfReader("draft.pdf").pages]
    assert len(pages) > 1
    assert all("DRAFT · Certificate D-1" in page and page.count("DRAFT") >= 2 for page in pages)
    assert typed("certificate", "show", "D-1", "--dcc", "draft.xml", db=db).status == 0
    assert '<dcc:statement id="draft">' in Path("draft.xml").read_text(encoding="utf-8")
    assert typed("certificate", "show", "D-1", "--json", db=db).document["record"]["draft"] is True
    found = typed("certificate", "verify", "draft.pdf", "--json", db=db)
    assert (found.status, found.document["state"]) == (1, "draft")
    assert "it is a draft" in found.document["faults"]
    # A draft is written anew as often as one likes, then issued under its number.
    with pdf_unread():
        assert typed(*issue, "--out", "draft.pdf", db=db).status == 0
    issue.remove("--draft")
    assert typed(*issue, "--out", "draft.pdf", "--json", db=db).document["state"] == "issued"
    assert "DRAFT" not in text_of(Path("draft.pdf"))


@pytest.mark.slow
def test_numbers_follow_one_another_within_the_year(
    typed: Any, issued: Any, laboratory: Path, pdf_unread: Any
) -> None:
    issue = ["certificate", "issue", "cold-cold", "--run", 3, "--laboratory", laboratory, "--json"]
    with pdf_unread():
        assert typed(*issue, "--date", "2026-12-31", db=issued.db).document["number"] == "2026-0004"
        assert typed(*issue, "--date", "2027-01-01", db=issued.db).document["number"] == "2027-0001"
        # On the day of the clock.
        assert typed(*issue, db=issued.db).document["number"] == "2027-0002"


def test_no_certificate_before_its_measurement(typed: Any, db: Path, laboratory: Path) -> None:
    answer = typed(
        "certificate",
        "issue",
        "five-days",
        "--run",
        20,
        "--laboratory",
        laboratory,
        "--date",
        "2026-03-08",
        db=db,
    )
    assert (answer.status, list(Path().iterdir())) == (2, [])
    assert "run 20 was measured on 2026-03-09; no certificate was issued of it on 2026-03-08" in answer.err


def test_the_file_of_an_issued_certificate_is_not_written_over(
    typed: Any, issued: Any, laboratory: Path
) -> None:
    shutil.copyfile(issued.file("2026-0001"), "mine.pdf")
    answer = typed(
        "certificate",
        "issue",
        "cold-cold",
        "--run",
        3,
        "--laboratory",
        laboratory,
        "--out",
        "mine.pdf",
        db=issued.db,
    )
    assert answer.status == 2
    assert "mine.pdf is certificate 2026-0001; name another file" in answer.err
    assert Path("mine.pdf").read_bytes() == issued.file("2026-0001").read_bytes()


def test_a_file_that_nobody_knows_is_not_written_over(
    typed: Any, issued: Any, db: Path, laboratory: Path, pdf_unread: Any
) -> None:
    """Two databases in one folder both count from 0001: the second may not take the place of the first's."""
    shutil.copyfile(issued.file("2026-0001"), "certificate-2026-0001.pdf")
    issue = [
        "certificate",
        "issue",
        "cold-cold",
        "--run",
        3,
        "--laboratory",
        laboratory,
        "--date",
        "2026-03-10",
    ]
    answer = typed(*issue, db=db)
    assert answer.status == 2
    assert "certificate-2026-0001.pdf is there already, and no draft of this database" in answer.err
    assert Path("certificate-2026-0001.pdf").read_bytes() == issued.file("2026-0001").read_bytes()
    assert typed("certificate", "show", db=db).out == "no certificate was made yet\n"
    Path("empty.pdf").touch()  # as mktemp makes it
    with pdf_unread():
        assert typed(*issue, "--out", "empty.pdf", db=db).status == 0


@pytest.mark.parametrize("out", ["text", "text/x.pdf"])
def test_a_file_that_cannot_be_written_leaves_no_certificate(
    typed: Any, db: Path, laboratory: Path, out: str, pdf_unread: Any
) -> None:
    Path("text").write_text("hello")
    issue = ["certificate", "issue", "cold-cold", "--run", 3, "--laboratory", laboratory, "--out", out]
    with pdf_unread():
        answer = typed(*issue, db=db)
    assert (answer.status, answer.out) == (2, "")
    assert "the certificate cannot be written to" in answer.err
    assert typed("certificate", "show", db=db).out == "no certificate was made yet\n"
    assert [path.name for path in Path().iterdir()] == ["text"]


def test_a_number_with_slashes_stays_in_its_folder(
    typed: Any, db: Path, laboratory: Path, pdf_unread: Any
) -> None:
    issue = ["certificate", "issue", "cold-cold", "--run", 3, "--laboratory", laboratory, "--out", "out"]
    with pdf_unread():
        answer = typed(*issue, "--number", "../../x/1", "--json", db=db)
    assert answer.document["number"] == "../../x/1"
    (file,) = Path("out").iterdir()
    assert str(file) == answer.document["file"]
    assert not list(Path("..").glob("*.pdf"))


def test_another_certificate_of_a_run_names_the_one_in_force(issued: Any, laboratory: Path) -> None:
    """Three certificates of one run were in force at once, without a word."""
    with Database(issued.db, read_only=True) as db:

        def said(run: int, **more: Any) -> tuple[str, ...]:
            request = CertificateRequest("five-days", run, laboratory=laboratory, **more)
            return _in_force(db, request, [Measured(run, "as found")])

        assert said(18) == said(20, replaces="2026-0001", reason="wrong customer") == ()
        assert said(20) == (
            "of the same runs of five-days certificate 2026-0001 is in force: withdraw it, or amend it instead of "
            "issuing another",
        )
