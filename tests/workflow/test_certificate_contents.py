"""What a certificate states besides the parameters: a Monte Carlo result, the volumetric error, all in German."""

from __future__ import annotations

import csv
import hashlib
import io
import re
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
from monitor.reporting.resources import font_bytes
from monitor.reporting.texts import texts_of
from monitor.store import Database, import_campaign, load_certificate
from monitor.workflow.certificate.issue import issue
from monitor.workflow.certificate.remaking import remake
from monitor.workflow.certificate.request import CertificateRequest, RemakeRequest
from monitor.workflow.certificate.results import results_of, stored_monte_carlo
from monitor.workflow.uncertainty.evaluation import evaluate, uncertainty
from monitor.workflow.uncertainty.request import UncertaintyRequest
from monitor.workflow.uncertainty.result import RunUncertainty
from monitor.workflow.uncertainty.stating import answer_of
from monitor.workflow.uncertainty.stored import StatedUncertainty
from monitor.workflow.volumetric.request import VolumetricRequest
from monitor.workflow.volumetric.volumetric import volumetric_map

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
LABORATORY = EXAMPLES / "laboratory.toml"
DAY = date(2026, 3, 12)


def stated(found: RunUncertainty) -> StatedUncertainty:
    return StatedUncertainty(found.campaign, found.model, answer_of(found))


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    with Database(tmp_path_factory.mktemp("contents") / "c.duckdb", threads=1) as opened:
        for name in ("five-days", "cold-cold"):
            import_campaign(opened, read_campaign(EXAMPLES / name))
        yield opened


def text_of(file: str) -> str:
    return " ".join(" ".join(page.extract_text().split()) for page in pypdf.PdfReader(file).pages)


def record_of(db: Database, number: str) -> CertificateRecord:
    return from_document(CertificateRecord, load_certificate(db, number).record)


@pytest.mark.slow
def test_jcgm_102_7_a_monte_carlo_result_is_certified_only_from_what_is_stored(
    db: Database, tmp_path: Path
) -> None:
    with pytest.raises(
        NotFoundError, match=r"no stored Monte Carlo .*monitor uncertainty five-days --run 20 --method"
    ):
        issue(
            db,
            CertificateRequest(
                "five-days", 20, laboratory=LABORATORY, out=tmp_path, issued_on=DAY, method="mcm"
            ),
        )
    with pytest.raises(InputError, match="--method both: a certificate states guf or mcm"):
        issue(
            db,
            CertificateRequest(
                "five-days", 20, laboratory=LABORATORY, out=tmp_path, issued_on=DAY, method="both"
            ),
        )
    # Another probability is another result: it is not taken.
    uncertainty(db, UncertaintyRequest("five-days", 20, method="mcm", seed=3, digits=1, p=0.9))
    found = evaluate(db, UncertaintyRequest("five-days", 20, method="guf"))
    assert stored_monte_carlo(db, stated(found)) is None
    kept = uncertainty(db, UncertaintyRequest("five-days", 20, method="both", seed=4, digits=1))
    stored = stored_monte_carlo(db, stated(found))
    assert stored is not None
    assert (stored.trials, stored.seed) == (kept.mcm.trials, 4)
    made = issue(
        db,
        CertificateRequest(
            "five-days", 20, laboratory=LABORATORY, out=tmp_path, number="M-1", issued_on=DAY, method="mcm"
        ),
    )
    (result,) = record_of(db, "M-1").results or ()
    assert [float(one) for one in result.estimate] == pytest.approx(
        list(kept.mcm.estimate.values()), rel=1e-12
    )
    assert [float(one) for one in result.u] == pytest.approx(list(kept.mcm.u.values()), rel=1e-12)
    assert (result.trials, result.validation is None) == (kept.mcm.trials, False)
    # Fifteen degrees of freedom: factors of a known covariance would cover less than they claim.
    assert (result.k_q, result.k_p) == (found.framework.k_q, found.framework.k_p)
    text = text_of(made.file)
    assert f"adaptive Monte Carlo, JCGM 102:2011 clause 7, {kept.mcm.trials} trials, seed 4" in text
    assert re.search(f"for a known covariance it gives k ?q = {kept.mcm.k_q:.2f}", text)
    assert load_certificate(db, "M-1").record["inputs"]["seed"] == 4
    assert remake(db, RemakeRequest("M-1")).identical is True


def test_jcgm_102_8_the_verdict_of_the_validation_is_printed_beside_the_framework(db: Database) -> None:
    found = evaluate(db, UncertaintyRequest("five-days", 20, method="guf"))
    kept = uncertainty(db, UncertaintyRequest("five-days", 20, method="both", seed=5, digits=1))
    stored = stored_monte_carlo(db, stated(found))
    assert stored is not None
    result = results_of(stated(found), texts_of(), stored)
    assert (
        f"compared with a Monte Carlo of {stored.trials} trials, seed 5 (JCGM 102:2011, 8): "
        in result.evaluation
    )
    assert str(result.validation).startswith("validated: estimates, u") == kept.validation.passed
    assert result.trials is None  # the numbers are the framework's


@pytest.mark.slow
def test_the_volumetric_error_is_that_of_the_map_and_travels_as_csv(db: Database, tmp_path: Path) -> None:
    made = issue(
        db,
        CertificateRequest(
            "five-days", 20, laboratory=LABORATORY, out=tmp_path, number="V-1", issued_on=DAY, with_map=True
        ),
    )
    document = volumetric_map(db, VolumetricRequest("five-days", 20))
    (printed,) = record_of(db, "V-1").volumetric
    for length, name in ((printed.largest, "worst"), (printed.mean, "mean"), (printed.rms, "rms")):
        assert length.value_um == getattr(document, name).error_um
        assert length.expanded_um == getattr(document, name).expanded_um
    assert printed.k == document.k
    text = text_of(made.file)
    assert "Volumetric error, as found" in text
    assert re.search(rf"largest error X .* {printed.largest.value_um:.1f} 1\.\d 2\.\d µm", text)
    assert f"Region: {document.region.points} points, 7 along each linear axis" in text
    attached = pypdf.PdfReader(made.file).attachments
    rows = list(csv.DictReader(io.StringIO(attached["volumetric-error-1.csv"][0].decode())))
    assert len(rows) == 7**3
    lengths = [np.linalg.norm([float(row[f"error_{axis}_um"]) for axis in "xyz"]) for row in rows]
    assert max(lengths) == pytest.approx(document.by_pose[0].worst_um, rel=1e-12)
    assert b"volumetric error, as found" in attached["certificate.dcc.xml"][0]
    assert remake(db, RemakeRequest("V-1")).identical is True


@pytest.mark.slow
def test_a_german_laboratory_gets_a_german_certificate(db: Database, tmp_path: Path) -> None:
    german = EXAMPLES / "laboratory-de.toml"
    made = issue(
        db,
        CertificateRequest(
            "cold-cold", 3, laboratory=german, out=tmp_path, number="D-1", issued_on=DAY, with_map=True
        ),
    )
    text = text_of(made.file)
    for words in (
        "Nr. D-1, ausgestellt am 12.03.2026", "Auftraggeber", "Ergebnisse, wie vorgefunden", "k q = 2,91",
        "Kein Ergebnis für EX0C1: mit diesem Messplan nicht zu trennen: EX0C1 von Tasterspitze x",
        "Volumetrische Abweichung, wie vorgefunden", "Ende des Kalibrierscheins D-1",
    ):  # fmt: skip
        assert "".join(words.split()) in "".join(text.replace("\N{HYPHEN}", "").split()), words
    # No English sentence and no decimal point is left, but for the campaign's own names.
    own = (
        "four balls and a scale bar",
        "bar certificate 2016-04",
        "touch-trigger probe",
        "machine-health-monitor",
    )
    for words in own:
        text = text.replace(words, "")
    assert not re.search(r"\b(the|and|with|from|of|is|not|run)\b", text)
    assert not re.search(r"\d\.\d+ (µ|°|mm)", text)
    xml = pypdf.PdfReader(made.file).attachments["certificate.dcc.xml"][0].decode()
    assert "<dcc:usedLangCodeISO639_1>de</dcc:usedLangCodeISO639_1>" in xml
    assert 'lang="en"' not in xml.replace('<dcc:content lang="en">machine-health-monitor</dcc:content>', "")
    assert remake(db, RemakeRequest("D-1")).identical is True


def test_letters_of_other_scripts_come_from_a_font_whose_hash_is_kept(db: Database, tmp_path: Path) -> None:
    # Any font does to see what is kept: one of ours under another name.
    font = tmp_path / "another.ttf"
    font.write_bytes(font_bytes("DejaVuSans.ttf"))
    issue(
        db,
        CertificateRequest(
            "cold-cold", 3, laboratory=LABORATORY, out=tmp_path, number="F-1", issued_on=DAY, fonts=(font,)
        ),
    )
    sha256 = hashlib.sha256(font.read_bytes()).hexdigest()
    assert load_certificate(db, "F-1").record["inputs"]["fonts"] == [
        {"name": "another.ttf", "sha256": sha256}
    ]
    assert remake(db, RemakeRequest("F-1", fonts=(font,))).identical is True
    with pytest.raises(
        InputError, match=rf"F-1 was made with another\.ttf \(SHA-256 {sha256}\): give the same by"
    ):
        remake(db, RemakeRequest("F-1"))
    with pytest.raises(InputError, match=r"the font .*none\.ttf cannot be read: No such file"):
        issue(
            db,
            CertificateRequest(
                "cold-cold",
                3,
                laboratory=LABORATORY,
                out=tmp_path,
                issued_on=DAY,
                fonts=(tmp_path / "none.ttf",),
            ),
        )
