"""The release of the digital certificate is stored with its record: asked for, of the laboratory's file, the newest."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from monitor.cli import main
from monitor.exceptions import InputError
from monitor.readers import read_campaign
from monitor.store import Database, import_campaign, load_certificate
from monitor.workflow.certificate.issue import issue
from monitor.workflow.certificate.remaking import remake
from monitor.workflow.certificate.request import CertificateFileRequest, CertificateRequest, RemakeRequest
from monitor.workflow.certificate.digital import write_digital

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
LABORATORY = EXAMPLES / "laboratory.toml"


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    with Database(tmp_path_factory.mktemp("release") / "r.duckdb", threads=1) as opened:
        import_campaign(opened, read_campaign(EXAMPLES / "five-days"))
        yield opened


@pytest.mark.parametrize(
    ("asked", "stated", "written"),
    [(None, None, "3.3.0"), (None, "3.2.1", "3.2.1"), ("3.3.0", "3.2.1", "3.3.0"), ("3.2.1", None, "3.2.1")],
)
def test_the_release_is_kept_and_made_again(
    db: Database,
    tmp_path: Path,
    pdf_unread: Callable[[], AbstractContextManager[None]],
    asked: str | None,
    stated: str | None,
    written: str,
) -> None:
    file = tmp_path / "laboratory.toml"
    line = "" if stated is None else f'dcc_version = "{stated}"\n'
    text = LABORATORY.read_text(encoding="utf-8")
    file.write_text(text.replace('country = "XX"', f'{line}country = "XX"', 1), encoding="utf-8")
    with pdf_unread():
        answer = issue(
            db, CertificateRequest("five-days", 20, laboratory=file, out=tmp_path, dcc_version=asked)
        )
        number = answer.certificate.number
        assert remake(db, RemakeRequest(number, None)).identical
    assert load_certificate(db, number).record["dcc_version"] == written
    path = write_digital(db, CertificateFileRequest(number, tmp_path)).file
    assert ET.parse(path).getroot().get("schemaVersion") == written


def test_a_release_that_there_is_not_and_an_address_that_is_none_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no digital certificate after DCC 2\.4\.0 here; there are 3\.2\.1"):
        CertificateRequest("c", 1, laboratory=LABORATORY, dcc_version="2.4.0")
    with pytest.raises(InputError, match=r"--timestamp-url tsa\.example\.org: write the address"):
        CertificateRequest("c", 1, laboratory=LABORATORY, timestamp_url="tsa.example.org")


def test_a_time_stamp_needs_a_signature(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    typed = [
        "certificate",
        "issue",
        "c",
        "--laboratory",
        str(LABORATORY),
        "--timestamp-url",
        "http://127.0.0.1:9",
    ]
    path = tmp_path / "t.duckdb"
    Database(path).close()
    assert main(["--db", str(path), *typed]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "--timestamp-url needs --sign or --token" in said


def test_the_page_is_written_beside_the_file(
    db: Database, tmp_path: Path, pdf_unread: Callable[[], AbstractContextManager[None]]
) -> None:
    with pdf_unread():
        number = issue(
            db, CertificateRequest("five-days", 20, laboratory=LABORATORY, out=tmp_path)
        ).certificate.number
    db.close()
    out = tmp_path / "page.html"
    assert main(["--db", str(db.path), "certificate", "show", number, "--dcc-html", str(out)]) == 0
    html = out.read_text(encoding="utf-8")
    assert f"Digital calibration certificate {number}" in html
    assert "<td>EX0C</td>" in html
