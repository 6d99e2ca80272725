"""Documents that version 0.1.0 stored: sources of covariances and reasons of refusals as sentences alone.

They certify in each language.
"""

from __future__ import annotations

import json
from datetime import date
from pathlib import Path
from typing import Any

import pypdf
import pytest

import monitor
from monitor.documents import to_document
from monitor.exceptions import StoreError
from monitor.refusal import AdviceKind, Refusal
from monitor.reporting.covariance_source import CovarianceKind, covariance_sentence
from monitor.reporting.pdf.render import certificate_pdf
from monitor.reporting.refused import RefusedParameters, refusal_of, refusal_sentence, why_refused
from monitor.reporting.texts import texts_of
from monitor.store import Database, load_certificate, save_analysis
from monitor.workflow.certificate.issue import issue
from monitor.workflow.certificate.remaking import remake
from monitor.workflow.certificate.request import CertificateRequest, RemakeRequest
from monitor.workflow.certificate.stored import restored_record
from monitor.workflow.health.machine import MachineName, read_week
from monitor.workflow.health.request import ReportOptions
from monitor.workflow.health.weeks import week_named
from monitor.workflow.uncertainty import sentences_0_1_0
from monitor.workflow.uncertainty.evaluation import evaluate
from monitor.workflow.uncertainty.request import UncertaintyRequest
from monitor.workflow.uncertainty.sentences_0_1_0 import covariance_source_of, reason_of, with_reason
from monitor.workflow.uncertainty.stating import answer_of
from monitor.workflow.uncertainty.stored import restored

PACKAGE = Path(monitor.__file__).parent
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


@pytest.mark.parametrize(
    ("parameters", "advice", "sentence"),
    [
        (("EX0C1",), AdviceKind.SPINDLE_STILL, "EX0C1 cannot be told apart from tip x: C1 stands at one angle "
         "throughout; probe also with C1 at 90, 180 and 270 degrees"),
        (("EXX",), AdviceKind.NOT_PROBED, "EXX: run 2 did not probe S1 and S2 of the scale bar, the unit of length"),
        (("EXX", "EYY"), AdviceKind.MORE_INDEXATIONS, "EXX and EYY cannot be told apart; probe more indexations"),
        (("EA0B",), AdviceKind.AXIS_STILL, "EA0B cannot be told apart from tip x, 1 x: B stands at one angle "
         "throughout; index it too"),
        (("EA0A", "EB0C"), AdviceKind.MORE_FACES, "EA0A and EB0C cannot be told apart; touch more faces or other "
         "angles: the same points at opposite angles, and faces that look elsewhere"),
        (tuple(f"EXX({place})" for place in range(9)), AdviceKind.PIECE_PLANES, "EXX at 9 places cannot be told "
         "apart from lattice; lay the piece in the XY and the YZ plane too"),
        (("EXX:poly2",), AdviceKind.MORE_MODULES, "EXX:poly2; scan 4 or more modules along every arm, as a cubic "
         "needs"),
        (("EX0J1",), AdviceKind.STOOD_STILL, "EX0J1 cannot be told apart from tip z: J1, J2 stood still throughout; "
         "move them too"),
        (("EX0J1",), AdviceKind.STOOD_STILL, "EX0J1 cannot be told apart from tip z: J1 stood still throughout; move "
         "it too"),
        (("EX0J1",), AdviceKind.MORE_REFLECTORS, "EX0J1 cannot be told apart from tip z; add reflectors away from "
         "the last axis, or poses that turn the wrist more"),
        (("EX0J1",), AdviceKind.MORE_POSES, "EX0J1; add poses over the whole range of the joints"),
        (("EXX(-88)", "EYX(0)"), AdviceKind.BOUNDARY_CONDITION, "EXX(-88) and EYX(0) cannot be told apart: the "
         "boundary conditions EXX(-88) = 0 (where X counts its positioning error from); EYX(0) = 0 (the origin in Y: "
         "the axis of C at its first angle) are missing; add to the conditions of [artefact.self_calibration]"),
        (("EXX(-88)",), AdviceKind.NO_POINT, "EXX(-88): no point was probed where EXX(-88) acts; probe nearer to the "
         "ends, or leave the node out"),
        (("EXX(-88)", "EYX(0)"), AdviceKind.SWAPPED_TABLES, "EXX(-88) and EYX(0) cannot be told apart: the angles of "
         "C are multiples of 90 degrees apart, which swaps the tables of the linear axes; probe at another angle too"),
        (("EXX(-88)",), AdviceKind.MORE_ANGLES, "EXX(-88): 3 angles of C do not suffice for these points; probe at "
         "more angles, or more points"),
    ],
)  # fmt: skip
def test_the_reason_behind_a_stored_sentence_says_the_same(
    parameters: tuple[str, ...], advice: AdviceKind, sentence: str
) -> None:
    reason = reason_of(f"with this plan {sentence}")
    assert reason is not None
    assert reason.advice is not None
    assert reason.advice.kind is advice
    assert refusal_sentence(Refusal(parameters, reason)) == f"with this plan {sentence}"


@pytest.mark.parametrize("names", ["A, C", "A and C"])
def test_what_0_1_0_said_of_several_axes_that_stood_still_is_said_of_them(names: str) -> None:
    why = f"with this plan EB0C: {names} stands at one angle throughout; index it too"
    refused = with_reason(RefusedParameters(("EB0C",), why))
    refusal = refusal_of(refused)
    assert refusal is not None
    assert why_refused(refused, texts_of()) == why
    assert refusal_sentence(refusal).endswith("A and C stand at one angle throughout; index them too")


@pytest.mark.parametrize(
    "sentence",
    ["it has no number in this run", "it is no error of the machine", "the plan does not determine it"],
)
def test_the_reason_why_a_map_leaves_a_parameter_out_says_the_same(sentence: str) -> None:
    refusal = refusal_of(with_reason(RefusedParameters(("EXX",), sentence)))
    assert refusal is not None
    assert refusal_sentence(refusal) == sentence


def test_a_sentence_of_another_hand_stays_as_it_is() -> None:
    refused = RefusedParameters(("EXX",), "somebody said so")
    assert with_reason(refused) == refused


@pytest.mark.slow
def test_a_record_without_reasons_is_made_again_byte_for_byte_and_in_german(
    db: Database, tmp_path: Path
) -> None:
    """cold-cold never turned its spindle: two parameters are refused, and left out of the map."""
    request = CertificateRequest(
        "cold-cold",
        3,
        laboratory=EXAMPLES / "laboratory-de.toml",
        with_map=True,
        out=tmp_path,
        number="R-2",
        issued_on=date(2026, 3, 12),
    )
    text = printed(Path(issue(db, request).file))
    said = "mit diesem Messplan nicht zu trennen: EX0C1 von Tasterspitze x: C1 steht durchweg"
    assert text.count(said) == 2
    document = dict(load_certificate(db, "R-2").record)
    outside = {"not_shown", "outside_model", "turns_workpiece"}
    for error_map in document["volumetric"]:
        # Records without reasons are of versions that knew of no errors outside the model.
        pairs = zip(error_map["left_out"], error_map["left_out_refusals"], strict=True)
        known = [pair for pair in pairs if pair[1]["reason"]["kind"] not in outside]
        assert 0 < len(known) < len(error_map["left_out"])
        error_map["left_out"], error_map["left_out_refusals"] = map(list, zip(*known, strict=True))
    _, with_reasons = _made(document, tmp_path)
    assert with_reasons.count(said) == 2
    for result in document["results"]:
        for refused in result["refused"]:
            del refused["reason"]
    for error_map in document["volumetric"]:
        del error_map["left_out_refusals"]
    pdf, without = _made(document, tmp_path)
    assert without == with_reasons
    db.execute("UPDATE certificate SET record = ?, pdf = ?", [json.dumps(document), pdf])
    assert remake(db, RemakeRequest("R-2")).identical


def test_what_is_stored_now_has_kinds_and_no_sentence_is_read(db: Database, monkeypatch) -> None:
    """five-days has a covariance of repeated runs; cold-cold, which never turned its spindle, two refusals."""

    def refuse(*_: object) -> None:
        raise AssertionError("a sentence was read")

    monkeypatch.setattr(sentences_0_1_0, "reason_of", refuse)
    monkeypatch.setattr("monitor.workflow.uncertainty.stored.covariance_source_of", refuse)
    for campaign, run in (("five-days", 20), ("cold-cold", 3)):
        answer = answer_of(evaluate(db, UncertaintyRequest(campaign, run, method="guf")))
        document = json.loads(json.dumps(to_document(answer)))
        assert document["input_covariance_source"]["kind"] in {kind.value for kind in CovarianceKind}
        assert all(refused["reason"]["kind"] for refused in document["refused"])
        assert to_document(restored(document)) == document
    assert document["refused"]


def test_sentences_are_read_in_one_file_alone() -> None:
    readers = {
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob("*.py")
        if "sentences_0_1_0 import" in path.read_text(encoding="utf-8")
    }
    assert readers == {"workflow/uncertainty/stored.py", "workflow/certificate/stored.py"}


def _made(document: dict[str, Any], folder: Path) -> tuple[bytes, str]:
    """The certificate of a stored record, and what it says."""
    written = {key: value for key, value in document.items() if key != "inputs"}
    pdf = certificate_pdf(restored_record(document), (), document["inputs"], written)
    file = folder / "old.pdf"
    file.write_bytes(pdf)
    return pdf, printed(file)


def printed(file: Path) -> str:
    """What a PDF says."""
    return " ".join(" ".join(page.extract_text() for page in pypdf.PdfReader(file).pages).split())


@pytest.mark.slow
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
    text = printed(Path(made.file))
    # A word may be divided at the end of a line.
    assert "Wiederholungsläufe, tageweise zusammengefasst, 15 Freiheitsgrade" in text.replace("‐ ", "")


def test_a_health_report_reads_a_stored_document_and_computes_anew_what_lacks_keys(db: Database) -> None:
    result = evaluate(db, UncertaintyRequest("five-days", 20, method="guf"))
    model = result.model
    document = to_document(answer_of(result))
    del document["input_covariance_source"]
    save_analysis(
        db, "uncertainty", document, method="guf", campaign="five-days", run=20, model=model.name,
        model_version=model.version,
    )  # fmt: skip
    save_analysis(
        db, "explanation", {"campaign": "five-days", "answer": "Nothing is missing."}, method="samba",
        campaign="five-days", model=model.name, model_version=model.version,
    )  # fmt: skip
    options = ReportOptions(campaigns=("five-days",))
    week = read_week(db, MachineName("HU40-T", "", ""), week_named("2026-W11"), options)
    assert week.results is not None
    assert week.results.uncertainty is not None
    source = week.results.uncertainty.input_covariance_source
    assert source is not None
    assert (source.kind, source.dof) == (result.covariance_source.kind, 15)
    assert week.results.explanation is None
    assert week.task is not None
    assert (week.task.uncertainty, week.task.explanation) == (False, True)
