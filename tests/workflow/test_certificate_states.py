"""ISO/IEC 17025:2017, 7.8.4.1 d: the results before and after an adjustment or repair, on one certificate."""

from __future__ import annotations

import json
from collections.abc import Iterator
from datetime import date
from pathlib import Path

import numpy as np
import pypdf
import pytest

from monitor.documents import from_document
from monitor.exceptions import InputError, NotFoundError
from monitor.readers import read_campaign
from monitor.reporting.certificate.record import CertificateRecord
from monitor.store import Database, import_campaign, load_certificate
from monitor.workflow.certificate.issue import amend, issue
from monitor.workflow.certificate.remaking import remake
from monitor.workflow.certificate.request import (
    AmendmentRequest,
    CertificateRequest,
    RemakeRequest,
    VerificationRequest,
)
from monitor.workflow.certificate.verification import verify_file
from monitor.workflow.uncertainty.evaluation import uncertainty
from monitor.workflow.uncertainty.request import UncertaintyRequest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
LABORATORY = EXAMPLES / "laboratory.toml"
DAY = date(2026, 3, 12)
DONE = "The offset of C was entered into the control after run 10."


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    with Database(tmp_path_factory.mktemp("states") / "c.duckdb", threads=1) as opened:
        import_campaign(opened, read_campaign(EXAMPLES / "five-days"))
        # Evaluated once: every certificate below states these results.
        for run in (10, 20):
            uncertainty(opened, UncertaintyRequest("five-days", run, method="guf"))
        yield opened


@pytest.fixture(scope="module", params=["en", pytest.param("de", marks=pytest.mark.slow)])
def adjusted(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A laboratory that adjusted the machine, in both languages."""
    name = "laboratory.toml" if request.param == "en" else "laboratory-de.toml"
    lines = (EXAMPLES / name).read_text(encoding="utf-8").splitlines()
    lines = [f'adjustment = "{DONE}"' if line.startswith("adjustment =") else line for line in lines]
    place = tmp_path_factory.mktemp("adjusted") / name
    place.write_text("\n".join(lines), encoding="utf-8")
    return place


def test_17025_7_8_4_1_d_results_as_found_and_as_left(
    db: Database, adjusted: Path, tmp_path: Path, pdf_unread
) -> None:
    german = adjusted.name == "laboratory-de.toml"
    made = issue(
        db, CertificateRequest("five-days", 10, laboratory=adjusted, out=tmp_path, issued_on=DAY, as_left=20)
    )
    assert made.certificate.runs == (10, 20)
    stored = load_certificate(db, made.certificate.number)
    record = from_document(CertificateRecord, stored.record)
    assert record.results is not None
    found, left = record.results
    assert (found.state, left.state) == (
        ("wie vorgefunden", "wie hinterlassen") if german else ("as found", "as left")
    )
    assert record.performed_on == (date(2026, 3, 4), date(2026, 3, 9))
    # Each state has its own numbers, those of a certificate of its run alone.
    for run, part in ((10, found), (20, left)):
        with pdf_unread():
            alone = issue(
                db, CertificateRequest("five-days", run, laboratory=adjusted, out=tmp_path, issued_on=DAY)
            )
        single = from_document(
            CertificateRecord, load_certificate(db, alone.certificate.number).record
        ).results
        assert single is not None
        assert np.array_equal(single[0].estimate, part.estimate)
        assert np.array_equal(single[0].covariance, part.covariance)
    inputs = json.loads(json.dumps(stored.record["inputs"]))
    assert (inputs["run"], inputs["as_left"]["run"]) == (10, 20)
    pages = pypdf.PdfReader(made.file)
    text = " ".join(" ".join(page.extract_text().split()) for page in pages.pages)
    assert f"{'Ergebnisse' if german else 'Results'}, {found.state}" in text
    assert f"{'Ergebnisse' if german else 'Results'}, {left.state}" in text
    assert DONE in text
    assert sorted(pages.attachments) == [
        "certificate.dcc.xml", "certificate.json", "covariance-1.csv", "covariance-2.csv",
        "machine-frame-1.csv", "machine-frame-2.csv", "results-1.csv", "results-2.csv",
    ]  # fmt: skip
    assert remake(db, RemakeRequest(made.certificate.number)).identical is True
    # An amendment is of the same runs in the same states unless it says otherwise.
    with pdf_unread():
        again = amend(
            db,
            AmendmentRequest(
                made.certificate.number, "wrong customer", laboratory=adjusted, out=tmp_path, issued_on=DAY
            ),
        )
    assert again.certificate.runs == (10, 20)
    assert verify_file(db, VerificationRequest(Path(again.file))).ok is True


def test_results_as_left_may_stand_alone(db: Database, adjusted: Path, tmp_path: Path, pdf_unread) -> None:
    with pdf_unread():
        made = issue(
            db,
            CertificateRequest(
                "five-days", None, laboratory=adjusted, out=tmp_path, issued_on=DAY, as_left=20
            ),
        )
        again = amend(
            db,
            AmendmentRequest(
                made.certificate.number, "wrong customer", laboratory=adjusted, out=tmp_path, issued_on=DAY
            ),
        )
    record = from_document(CertificateRecord, load_certificate(db, made.certificate.number).record)
    assert record.results is not None
    assert [one.state for one in record.results] in (["as left"], ["wie hinterlassen"])
    record = from_document(CertificateRecord, load_certificate(db, again.certificate.number).record)
    assert record.results is not None
    assert [one.state for one in record.results] in (["as left"], ["wie hinterlassen"])


def test_what_cannot_be_as_left_is_refused(db: Database, tmp_path: Path) -> None:
    silent = tmp_path / "laboratory.toml"
    silent.write_text(
        "\n".join(
            'adjustment = { not_applicable = "none" }' if line.startswith("adjustment") else line
            for line in LABORATORY.read_text(encoding="utf-8").splitlines()
        ),
        encoding="utf-8",
    )
    with pytest.raises(InputError, match="say in words what was adjusted or repaired between"):
        issue(
            db,
            CertificateRequest("five-days", 10, laboratory=silent, out=tmp_path, issued_on=DAY, as_left=20),
        )
    with pytest.raises(InputError, match="results as left are measured after those as found"):
        issue(
            db,
            CertificateRequest(
                "five-days", 20, laboratory=LABORATORY, out=tmp_path, issued_on=DAY, as_left=10
            ),
        )
    with pytest.raises(InputError, match="results as left are measured after those as found"):
        issue(
            db,
            CertificateRequest(
                "five-days", 20, laboratory=LABORATORY, out=tmp_path, issued_on=DAY, as_left=20
            ),
        )
    with pytest.raises(NotFoundError, match="campaign five-days has no run 99; it has 1, 2, 3"):
        issue(
            db,
            CertificateRequest(
                "five-days", 10, laboratory=LABORATORY, out=tmp_path, issued_on=DAY, as_left=99
            ),
        )
    with pytest.raises(
        InputError, match="run 20 was measured on 2026-03-09; no certificate was issued of it on"
    ):
        issue(
            db,
            CertificateRequest(
                "five-days", 10, laboratory=LABORATORY, out=tmp_path, issued_on=date(2026, 3, 8), as_left=20
            ),
        )
    assert list(tmp_path.glob("*.pdf*")) == []
