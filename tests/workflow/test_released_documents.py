"""Documents that version 0.1.0 stored: a covariance's source as a sentence alone. They certify in each language."""

from __future__ import annotations

from datetime import date
from pathlib import Path

import pypdf
import pytest

from monitor.documents import to_document
from monitor.exceptions import StoreError
from monitor.reporting.covariance_source import covariance_sentence
from monitor.store import Database, load_certificate, save_analysis
from monitor.workflow.certificate.issue import issue
from monitor.workflow.certificate.request import CertificateRequest
from monitor.workflow.uncertainty.evaluation import evaluate
from monitor.workflow.uncertainty.released import covariance_source_of
from monitor.workflow.uncertainty.request import UncertaintyRequest
from monitor.workflow.uncertainty.stating import answer_of
from monitor.workflow.uncertainty.stored import restored

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.mark.parametrize(
    "sentence",
    [
        "repeated runs, pooled by day, 15 degrees of freedom",
        "selection warm: all 12 runs, 11 degrees of freedom",
        "selection a: b: repeated runs, pooled by day, 9 degrees of freedom",
        "the probe's stated standard uncertainty of 1.25 µm; too few repeated runs of one plan",
        "the repeatability of 1.8 µm, which exceeds the probe's statement; too few runs for more",
        "all 9 runs, 8 degrees of freedom; errors of the linear axes and the stylus tip are no part of u: the method "
        "takes them as known",
        "all 9 runs, 8 degrees of freedom; and the errors of the linear axes as stated; errors of the stylus tip are "
        "no part of u: the method takes them as known",
    ],
)
def test_the_source_behind_a_stored_sentence_says_the_same(sentence: str) -> None:
    assert covariance_sentence(covariance_source_of(sentence)) == sentence


def test_a_sentence_that_0_1_0_did_not_write_is_refused() -> None:
    with pytest.raises(
        StoreError, match="the stored result says 'somewhere' of its covariance: it was altered"
    ):
        covariance_source_of("somewhere")


def test_a_stored_document_without_the_source_is_certified_in_german(db: Database, tmp_path: Path) -> None:
    result = evaluate(db, UncertaintyRequest("five-days", 20, method="guf"))
    document = to_document(answer_of(result))
    del document["input_covariance_source"]
    number = save_analysis(
        db, "uncertainty", document, method="guf", campaign="five-days", run=20, model=result.model.name,
        model_version=result.model.version,
    )  # fmt: skip
    source = restored(document).input_covariance_source
    assert source is not None
    assert (source.kind, source.dof) == (result.covariance_source.kind, 15)
    made = issue(
        db,
        CertificateRequest(
            "five-days",
            20,
            laboratory=EXAMPLES / "laboratory-de.toml",
            out=tmp_path,
            number="R-1",
            issued_on=date(2026, 3, 12),
        ),
    )
    assert load_certificate(db, "R-1").record["inputs"]["stored_result"] == number
    text = " ".join(" ".join(page.extract_text() for page in pypdf.PdfReader(made.file).pages).split())
    assert "Wiederholungsläufe, tageweise zusammengefasst, 15 Freiheitsgrade" in text
