"""The life of certificates: made again byte for byte, conformity by a named rule, data inside the PDF."""

from __future__ import annotations

import csv
import hashlib
import io
import itertools
import json
import math
import re
import shutil
from collections.abc import Iterator
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pypdf
import pytest
from scipy import stats

from monitor.cli import main
from monitor.documents import from_document, to_document
from monitor.exceptions import DataError, InputError
from monitor.readers import read_campaign
from monitor.reporting.certificate.dcc import dcc_xml
from monitor.reporting.certificate.page import _printed
from monitor.reporting.certificate.record import CertificateRecord, ConformityStatement
from monitor.reporting.certificate.results import ResultSet
from monitor.reporting.certificate.tables import conformity_rows
from monitor.reporting.certificate.volumetric_result import Length, VolumetricResult
from monitor.reporting.certificate.words import answer
from monitor.reporting.pdf.layout_engine import engine_versions
from monitor.reporting.pdf.render import certificate_html
from monitor.reporting.texts import texts_of
from monitor.store import Database, import_campaign, load_campaign, load_certificate
from monitor.workflow.campaign_parts import without_runs
from monitor.workflow.certificate.conformity import statement_of
from monitor.workflow.certificate.digital import write_digital
from monitor.workflow.certificate.issue import issue
from monitor.workflow.certificate.remaking import remake
from monitor.workflow.certificate.request import (
    RULES,
    CertificateFileRequest,
    CertificateRequest,
    RemakeRequest,
)
from monitor.workflow.certificate.results import results_of
from monitor.workflow.uncertainty.evaluation import evaluate
from monitor.workflow.uncertainty.request import UncertaintyRequest
from monitor.workflow.uncertainty.result import RunUncertainty
from monitor.workflow.uncertainty.stating import answer_of
from monitor.workflow.uncertainty.stored import StatedUncertainty

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
LABORATORY = EXAMPLES / "laboratory.toml"
#: Run 20 of the example: EX0C is far outside, EXX inside by less than U, EA0B inside by more.
LIMITS = {"EX0C": 20.0, "EXX": 60.0, "EA0B": 60.0}
#: Limit of the volumetric error of that run, µm: beyond its largest by less than 1.645 u.
LONGEST = 190.0
DAY = date(2026, 3, 12)


def as_stated(found: RunUncertainty) -> StatedUncertainty:
    return StatedUncertainty(found.campaign, found.model, answer_of(found))


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    folder = tmp_path_factory.mktemp("campaign")
    limited = folder / "limited"
    shutil.copytree(EXAMPLES / "five-days", limited)
    text = (limited / "campaign.toml").read_text(encoding="utf-8")
    # Of the same machine: a copy of the readings of another has no certificate.
    text = re.sub('campaign = ".*?"', 'campaign = "limited"', text, count=1)
    limits = "".join(f"{name} = {limit}\n" for name, limit in {**LIMITS, "volumetric": LONGEST}.items())
    text = text.replace("[machine.axes]", f"[machine.tolerances]\n{limits}\n[machine.axes]", 1)
    (limited / "campaign.toml").write_text(text, encoding="utf-8")
    with Database(folder / "c.duckdb", threads=1) as opened:
        import_campaign(opened, read_campaign(limited))
        import_campaign(opened, read_campaign(EXAMPLES / "five-days"))
        yield opened


@pytest.fixture(scope="module")
def found(db: Database) -> RunUncertainty:
    return evaluate(db, UncertaintyRequest("limited", 20, method="guf"))


@pytest.fixture(scope="module")
def guarded(db: Database, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("out")
    made = issue(
        db,
        CertificateRequest(
            "limited", 20, laboratory=LABORATORY, out=out, number="G-1", issued_on=DAY, conformity="guard"
        ),
    )
    return Path(made.file)


@pytest.mark.parametrize(
    ("stated", "note"),
    [
        ('"Konformität nach vereinbarter Regel"', 'is not printed: "Konformität nach vereinbarter Regel"'),
        ('{ not_applicable = "keine verlangt" }', 'does not apply: "keine verlangt"'),
    ],
)
def test_what_the_laboratory_says_of_conformity_is_not_left_out_in_silence(
    db: Database, tmp_path: Path, pdf_unread, stated: str, note: str
) -> None:
    text = LABORATORY.read_text(encoding="utf-8")
    line = next(line for line in text.splitlines() if line.startswith("conformity = "))
    own = tmp_path / "laboratory.toml"
    own.write_text(text.replace(line, f"conformity = {stated}"), encoding="utf-8")
    asked = {"laboratory": own, "out": tmp_path, "issued_on": DAY, "draft": True}
    with pdf_unread():
        (said,) = issue(db, CertificateRequest("limited", 20, **asked, conformity="guard")).notes
        assert note in said
        assert issue(db, CertificateRequest("limited", 20, **asked)).notes is None


@pytest.mark.usefixtures("laid_out_anew")
def test_an_issued_certificate_is_made_again_byte_for_byte(
    db: Database, guarded: Path, tmp_path: Path
) -> None:
    again = remake(db, RemakeRequest("G-1", tmp_path))
    assert again.identical is True
    assert Path(again.file).read_bytes() == guarded.read_bytes()


def test_a_record_comes_back_from_its_json_to_the_last_bit(db: Database, guarded: Path) -> None:
    stored = load_certificate(db, "G-1").record
    record = from_document(CertificateRecord, json.loads(json.dumps(dict(stored))))
    document = to_document(record)
    assert document == {key: value for key, value in stored.items() if key != "inputs"}
    assert isinstance(record.conformity, ConformityStatement)
    assert record.issued_on == DAY


def test_the_inputs_are_stored_with_it_and_travel_inside_it(
    db: Database, guarded: Path, found: RunUncertainty
) -> None:
    reader = pypdf.PdfReader(guarded)
    files = {name: content[0] for name, content in reader.attachments.items()}
    assert sorted(files) == [
        "certificate.dcc.xml", "certificate.json", "covariance-1.csv", "machine-frame-1.csv", "results-1.csv"
    ]  # fmt: skip
    whole = json.loads(files["certificate.json"])
    stored = load_certificate(db, "G-1").record
    assert whole["inputs"] == stored["inputs"]
    imported = {
        file.name: hashlib.sha256(file.content).hexdigest()
        for file in load_campaign(db, found.campaign.name).files
    }
    assert len(imported) == 3
    assert {one["name"]: one["sha256"] for one in whole["inputs"]["files"]} == imported
    assert whole["certificate"]["number"] == "G-1"


def test_iso_19005_3_6_8_every_attached_file_stands_once_in_af_with_its_relationship(guarded: Path) -> None:
    listed = pypdf.PdfReader(guarded).root_object["/AF"]
    names = [str(one.get_object()["/UF"]) for one in listed]
    assert sorted(names) == [
        "certificate.dcc.xml", "certificate.json", "covariance-1.csv", "machine-frame-1.csv", "results-1.csv"
    ]  # fmt: skip
    relations = {str(one.get_object()["/UF"]): one.get_object()["/AFRelationship"] for one in listed}
    assert relations["certificate.json"] == "/Source"
    assert relations["certificate.dcc.xml"] == "/Alternative"
    assert relations["results-1.csv"] == relations["covariance-1.csv"] == "/Data"


def test_iso_230_1_3_7_location_errors_stand_in_the_machine_frame_with_their_covariance(
    guarded: Path, found: RunUncertainty
) -> None:
    attached = pypdf.PdfReader(guarded).attachments
    rows = {
        row["parameter"]: row
        for row in csv.DictReader(io.StringIO(attached["machine-frame-1.csv"][0].decode()))
    }
    result = results_of(as_stated(found), texts_of())
    first, second = result.names.index("EA0B"), result.names.index("EA0C")
    weights = np.zeros(len(result.names))
    weights[[first, second]] = 1.0
    tilt = rows["EA0C"]
    assert tilt["sum_of"] == "EA0B + EA0C"
    assert float(tilt["estimate"]) == pytest.approx(weights @ result.estimate)
    assert float(tilt["standard_uncertainty"]) ** 2 == pytest.approx(weights @ result.covariance @ weights)
    assert float(tilt["covariance_EA0B"]) == pytest.approx((weights @ result.covariance)[first])
    text = " ".join(page.extract_text() for page in pypdf.PdfReader(guarded).pages)
    assert "orientation about X of axis C, relative to axis B" in " ".join(text.split())
    assert "In the frame of the machine: sum of" in " ".join(text.split())


def test_a_result_stored_before_the_machine_frame_is_printed_as_it_was(found: RunUncertainty) -> None:
    result = replace(results_of(as_stated(found), texts_of()), machine_frame=None)
    document = to_document(result)
    assert "machine_frame" not in document
    printed = _printed(from_document(ResultSet, document), texts_of())
    assert printed.parameter == "Parameter (ISO 230-1)"
    assert printed.machine_frame is None


def test_german_results_say_what_they_refer_to(found: RunUncertainty) -> None:
    printed = _printed(results_of(as_stated(found), texts_of("de")), texts_of("de"))
    rows = {row.name: row.description for row in printed.rows}
    assert rows["EA0C"] == "Ausrichtung um X von Achse C, bezogen auf Achse B"
    assert rows["EB0Z"].endswith(", im Koordinatensystem der Maschine")
    assert printed.machine_frame is not None
    assert [row[:2] for row in printed.machine_frame.rows] == [("EA0C", "EA0B + EA0C")]
    assert "Im Koordinatensystem der Maschine (ISO 230-1:2012, 3.7" in printed.machine_frame.explained


def test_the_attached_csv_holds_the_results_at_full_precision(guarded: Path, found: RunUncertainty) -> None:
    attached = pypdf.PdfReader(guarded).attachments
    rows = list(csv.DictReader(io.StringIO(attached["results-1.csv"][0].decode())))
    result = results_of(as_stated(found), texts_of())
    assert [row["parameter"] for row in rows] == list(result.names)
    assert [float(row["estimate"]) for row in rows] == result.estimate.tolist()
    assert [float(row["standard_uncertainty"]) for row in rows] == result.u.tolist()
    assert {row["parameter"]: float(row["tolerance"]) for row in rows if row["tolerance"]} == LIMITS
    matrix = list(csv.reader(io.StringIO(attached["covariance-1.csv"][0].decode())))
    assert matrix[0][2:] == list(result.names)
    assert np.array_equal(np.array([row[2:] for row in matrix[1:]], dtype=float), result.covariance)


def test_the_digital_certificate_of_a_stored_record_is_the_attached_one(
    db: Database, guarded: Path, tmp_path: Path
) -> None:
    made = write_digital(db, CertificateFileRequest("G-1", tmp_path))
    assert Path(made.file).name == "certificate-G-1.dcc.xml"
    attached = pypdf.PdfReader(guarded).attachments["certificate.dcc.xml"][0]
    assert Path(made.file).read_bytes() == attached


def test_ilac_g8_and_jcgm_106_decide_by_their_rules(found: RunUncertainty) -> None:
    guf = found.framework
    places = [guf.names.index(name) for name in LIMITS]
    units = [found.units[place] for place in places]
    y = [abs(unit.to_display(float(guf.estimate[place]))) for unit, place in zip(units, places, strict=True)]
    expanded = [
        unit.to_display(float(guf.expanded[place])) for unit, place in zip(units, places, strict=True)
    ]
    result, english = results_of(as_stated(found), texts_of()), texts_of()

    def stated(rule: str) -> ConformityStatement:
        freedoms = dict(zip(guf.names, map(float, guf.dof_by_output), strict=True))
        return statement_of(result, rule, english, campaign="limited", freedoms=freedoms)

    verdicts = {
        rule: {one.name: one.verdict for one in stated(rule).verdicts}
        for rule in ("simple", "guard", "probability", "iso14253", "ilac")
    }
    for name, value, width in zip(LIMITS, y, expanded, strict=True):
        limit = LIMITS[name]
        assert verdicts["simple"][name] == ("pass" if value <= limit else "fail")
        guard = verdicts["guard"][name]
        assert (guard == "pass") == (value <= limit - width)
        assert (guard == "fail") == (value > limit + width)
        assert guard.endswith("pass") == (value <= limit)
    assert verdicts["guard"]["EX0C"] == "fail"
    assert verdicts["guard"]["EXX"] == "conditional pass"
    assert verdicts["guard"]["EA0B"] == "pass"
    assert verdicts["probability"]["EX0C"] == "fail"
    assert verdicts["iso14253"] == verdicts["probability"]
    u = {name: width / guf.k_q for name, width in zip(LIMITS, expanded, strict=True)}
    freedoms = dict(zip(guf.names, map(float, guf.dof_by_output), strict=True))
    # ILAC-G8 4.2.3 with U at 95.45 %, ISO 14253-1 with the one-sided 95 %: Student's t of each parameter.
    for rule, quantile in (("ilac", 0.97725), ("iso14253", 0.95)):
        for judged in stated(rule).verdicts:
            w = float(stats.t(freedoms[judged.name]).ppf(quantile)) * u[judged.name]
            assert judged.guard_band == pytest.approx(w, rel=1e-6)
            if rule == "ilac":
                value = dict(zip(LIMITS, y, strict=True))[judged.name]
                assert (judged.verdict == "pass") == (value <= LIMITS[judged.name] - w)
                assert judged.verdict != "pass" or judged.probability >= 0.977
    # The printed risk is the largest of a verdict at the edges of acceptance and rejection: both limits count.
    for rule, quantile in (("simple", 0.5), ("ilac", 0.97725)):
        largest = 0.0
        for name, limit in LIMITS.items():
            law = stats.t(freedoms[name], scale=u[name])
            w = float(law.ppf(quantile))
            within = [
                float(law.cdf(limit - edge) - law.cdf(-limit - edge)) for edge in (limit - w, limit + w)
            ]
            largest = max(largest, within[1], 1.0 - within[0] if w <= limit else 0.0)
        (printed,) = re.findall(r"probability of (?:up to|at most) ([\d.]+)\s%", stated(rule).risk)
        assert float(printed) == pytest.approx(100.0 * largest, rel=0.01)
    for one in stated("probability").verdicts:
        assert (one.verdict == "pass") == (one.probability >= 0.95)
    joint = stated("simple").joint_probability
    assert joint <= min(one.probability for one in stated("simple").verdicts)


@pytest.mark.parametrize("language", ["en", "de"])
@pytest.mark.parametrize("rule", RULES)
def test_17025_7_8_6_where_no_error_could_have_passed_the_statement_says_so(
    found: RunUncertainty, rule: str, language: str
) -> None:
    """The tolerance lies between u and every guard band: only simple acceptance can pass."""
    texts, freedoms = texts_of(language), dict.fromkeys(found.framework.names, math.inf)
    result = results_of(as_stated(found), texts)
    place = list(result.names).index("EA0B")
    limits = np.where(np.arange(len(result.names)) == place, 1.2 * result.u, result.tolerances)
    asked = {"campaign": "limited", "freedoms": freedoms}
    usual = statement_of(result, rule, texts, **asked).basis
    narrow = statement_of(replace(result, tolerances=limits), rule, texts, **asked)
    said = {"en": "no error, not even zero, could have passed", "de": "auch nicht null, "}[language]
    assert said not in usual
    assert (said in narrow.basis) == (rule != "simple")
    assert "EXX" not in narrow.basis
    if rule != "simple":
        assert re.search(r"(Of|Bei) EA0B (w|is|ist|the|die)", narrow.basis)
        # Whatever the estimate: that of an error of zero does not pass either.
        at_zero = replace(result, estimate=0.0 * result.estimate, tolerances=limits)
        (verdict,) = (
            one.verdict for one in statement_of(at_zero, rule, texts, **asked).verdicts if one.name == "EA0B"
        )
        assert verdict != "pass"


def test_17025_7_8_6_the_rule_the_risk_and_the_joint_probability_are_printed(guarded: Path) -> None:
    text = " ".join(" ".join(page.extract_text().split()) for page in pypdf.PdfReader(guarded).pages)
    assert re.search("Simultaneous guard band of all 13 parameters together, w = U = k ?q u", text)
    assert "Risk: all statements 'pass' hold at once with at least the coverage probability 95 %" in text
    assert re.search(
        r"With a joint probability of [<>]? ?[\d.]+.% all 3 parameters lie within their tolerances", text
    )
    assert re.search(r"EXX ± 60\.0 \d+ µm/m", text)
    assert "conditional pass" in text


def test_17025_7_8_6_a_limit_without_a_result_is_named_as_not_decided(
    guarded: Path, found: RunUncertainty
) -> None:
    text = " ".join(" ".join(page.extract_text().split()) for page in pypdf.PdfReader(guarded).pages)
    assert (
        "also limits the volumetric error, to 190.0 µm. This certificate has no volumetric error: whether"
        in text
    )
    freedoms = dict.fromkeys(found.framework.names, math.inf)
    asked = {"campaign": "limited", "freedoms": freedoms, "stated": {**LIMITS, "EXX:reversal": 5.0}}
    statement = statement_of(results_of(as_stated(found), texts_of()), "ilac", texts_of(), **asked)
    assert "states limits of EXX:reversal too, of which this certificate has no result" in statement.basis
    bare = replace(results_of(as_stated(found), texts_of()), tolerances=None)
    asked["stated"] = {"volumetric": LONGEST}
    with pytest.raises(InputError, match="its limit of the volumetric error is decided with --map"):
        statement_of(bare, "ilac", texts_of(), **asked)


@pytest.mark.parametrize("language", ["en", pytest.param("de", marks=pytest.mark.slow)])
def test_the_limit_of_the_volumetric_error_is_decided_as_the_others_where_it_is_stated(
    db: Database, tmp_path: Path, found: RunUncertainty, pdf_unread, language: str
) -> None:
    laboratory = LABORATORY if language == "en" else EXAMPLES / "laboratory-de.toml"
    with pdf_unread():
        issue(
            db,
            CertificateRequest(
                "limited", 20, laboratory=laboratory, out=tmp_path, number=f"V-{language}", issued_on=DAY,
                conformity="iso14253", with_map=True,
            ),
        )  # fmt: skip
    record = from_document(
        CertificateRecord,
        {
            key: value
            for key, value in load_certificate(db, f"V-{language}").record.items()
            if key != "inputs"
        },
    )
    assert isinstance(record.conformity, ConformityStatement)
    *parameters, judged = record.conformity.verdicts
    assert {one.name for one in parameters} == set(LIMITS)
    largest, law = record.volumetric[0].largest, stats.t(as_stated(found).fewest_dof)
    assert judged.probability == pytest.approx(
        float(law.cdf((LONGEST - largest.value_um) / largest.u_um)), abs=1e-9
    )
    assert judged.guard_band == pytest.approx(float(law.ppf(0.95)) * largest.u_um, rel=1e-6)
    assert judged.verdict == "undecided"
    assert 0.5 < judged.probability < 0.95
    name, words = {
        "en": ("volumetric error", "is decided by the same rule for its largest error"),
        "de": ("volumetrische Abweichung", "wird nach derselben Regel für die größte Abweichung"),
    }[language]
    printed = conformity_rows(record.conformity, texts_of(language))
    assert printed.count == 3
    assert printed.rows[-1][:3] == (name, "≤ 190,0" if language == "de" else "≤ 190.0", "µm")
    assert words in record.conformity.basis
    xml = dcc_xml(record).decode()
    assert f"{name}, {record.conformity.state}<" in xml
    assert xml.count("<dcc:conformity>noPass</dcc:conformity>") >= 1


def test_by_the_guard_band_of_all_parameters_a_length_has_the_u_of_its_map(found: RunUncertainty) -> None:
    result = results_of(as_stated(found), texts_of())
    largest = Length(25.0, 0.4, 0.9)
    mapped = VolumetricResult(
        state="as found", p=0.95, k=2.25, ranges=(), from_strokes=True, each=2, poses=1, points=8, datum=(),
        largest=largest, mean=largest, rms=largest, left_out=(), axes=(), readings_mm=np.empty((0, 3)),
        vectors_um=np.empty((0, 3)), expanded_um=np.empty(0),
    )  # fmt: skip
    alone = replace(result, tolerances=None)
    for limit, verdict in ((25.95, "pass"), (25.5, "conditional pass"), (24.0, "fail")):
        statement = statement_of(
            alone, "guard", texts_of(), campaign="limited", freedoms={"volumetric": math.inf},
            stated={"volumetric": limit}, volumetric=mapped,
        )  # fmt: skip
        (judged,) = statement.verdicts
        assert judged.verdict == verdict
        assert judged.guard_band == pytest.approx(0.9)
        assert conformity_rows(statement, texts_of()).count == 0
        for not_decided_here in ("joint", "hold at once", "parameters"):
            assert not_decided_here not in f"{statement.basis} {statement.rule} {statement.risk}"
    assert statement.joint_probability is None
    assert "joint_probability" not in to_document(statement)
    for language, rule in itertools.product(("en", "de"), RULES):
        texts = texts_of(language)
        statement = statement_of(
            alone, rule, texts, campaign="limited", freedoms={"volumetric": math.inf},
            stated={"volumetric": 25.95}, volumetric=mapped,
        )  # fmt: skip
        words = f"{statement.basis} {answer(statement, texts)}"
        for of_several in ("arameter", "single", "einzeln", "verdicts", "Aussagen"):
            assert of_several not in words
        before = replace(statement, together=None)
        assert ("The verdicts stand" in answer(before, texts)) == (language == "en")


def test_a_statement_begins_with_its_probability_and_stands_on_one_page_as_one_of_before_does_not(
    db: Database, tmp_path: Path, pdf_unread
) -> None:
    """In German it began with "Gemein-" on a line of its own: the line ended with a bold number."""
    asked = {"laboratory": EXAMPLES / "laboratory-de.toml", "out": tmp_path, "issued_on": DAY, "draft": True}
    with pdf_unread():
        issue(db, CertificateRequest("limited", 20, number="D-1", conformity="guard", **asked))
    stored = load_certificate(db, "D-1").record
    record = from_document(CertificateRecord, {key: stored[key] for key in stored if key != "inputs"})
    assert isinstance(record.conformity, ConformityStatement)
    before = replace(record, conformity=replace(record.conformity, together=None))
    for each, begins in (
        (record, "Mit einer gemeinsamen Wahrscheinlichkeit von"),
        (before, "Gemeinsame Wahr"),
    ):
        head, statement = certificate_html(each).split('<h2 id="break-conformity">')
        assert f'<p class="explained">{begins}' in statement
        assert head.rstrip().endswith('<section class="whole">') == (each is record)


def test_jcgm106_9_5_the_global_risks_of_a_rule_are_those_of_drawn_machines(found: RunUncertainty) -> None:
    result = results_of(as_stated(found), texts_of())
    freedoms = dict.fromkeys(result.names, math.inf)
    u, limit, spread = float(result.u[result.names.index("EXX")]), LIMITS["EXX"], 40.0
    rng = np.random.default_rng(106)
    true = rng.normal(0.0, spread, 2_000_000)
    seen = np.abs(rng.normal(true, u))
    outside = np.abs(true) > limit
    for rule, w in (("simple", 0.0), ("ilac", 2.0 * u), ("guard", result.k_q * u), ("iso14253", 1.6449 * u)):
        statement = statement_of(
            result, rule, texts_of(), campaign="limited", freedoms=freedoms, process={"EXX": spread}
        )
        judged = next(verdict for verdict in statement.verdicts if verdict.name == "EXX")
        passed = seen <= limit - w
        assert judged.consumers_risk == pytest.approx(float(np.mean(passed & outside)), abs=4e-4)
        assert judged.producers_risk == pytest.approx(float(np.mean(~passed & ~outside)), abs=8e-4)
        assert "EXX 40" in str(statement.process)
    with pytest.raises(InputError, match="--process EYY: only EA0B, EX0C, EXX have a result and a tolerance"):
        statement_of(result, "ilac", texts_of(), campaign="limited", freedoms=freedoms, process={"EYY": 3.0})


def test_no_tolerance_no_statement(db: Database, tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"campaign five-days states no tolerance of EA0B.*\[machine\.tolerances\]"
    ):
        issue(
            db,
            CertificateRequest(
                "five-days", 20, laboratory=LABORATORY, out=tmp_path, issued_on=DAY, conformity="simple"
            ),
        )
    assert list(tmp_path.iterdir()) == []


def test_remake_says_when_the_stored_document_is_another(
    db: Database,
    guarded: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(
        "monitor.workflow.certificate.remaking.certificate_pdf",
        lambda record, fonts, inputs, document: b"other",
    )
    again = remake(db, RemakeRequest("G-1"))
    assert again.identical is False
    assert "it was made with the same" in again.why
    made_with = {**engine_versions(), "pango": "1.0.0"}
    monkeypatch.setattr("monitor.workflow.certificate.remaking.engine_versions", lambda: made_with)
    assert (
        f"it was made with pango {engine_versions()['pango']} (here 1.0.0);"
        in remake(db, RemakeRequest("G-1")).why
    )
    with Database(tmp_path / "empty.duckdb"):
        pass
    assert main(["--db", str(tmp_path / "empty.duckdb"), "certificate", "show", "--remake", "x.pdf"]) == 2
    assert "--remake needs the number" in capsys.readouterr().err


@pytest.mark.slow
def test_a_certificate_without_a_region_names_the_times_that_have_one(db: Database, tmp_path: Path) -> None:
    """Was: only that more runs are needed, of 12 runs on three days."""
    whole = replace(load_campaign(db, "limited"), name="three-days")
    import_campaign(db, without_runs(whole, range(13, 21)))
    asked = {"laboratory": LABORATORY, "out": tmp_path, "issued_on": DAY, "draft": True}
    for time in (None, "day"):
        with pytest.raises(
            DataError,
            match=r"too few for a joint region of 13 parameters: .* there is a region with `--holds-for run` \(the run "
            r"itself\) or `--holds-for campaign` \(other days too\)$",
        ):
            issue(db, CertificateRequest("three-days", 12, holds_for=time, **asked))
    for time in ("run", "campaign"):
        assert issue(db, CertificateRequest("three-days", 12, holds_for=time, **asked)).file
