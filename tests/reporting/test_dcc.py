"""The digital certificate: valid by PTB's schemas, the record's numbers to the last bit."""

from __future__ import annotations

import dataclasses
import io
import subprocess
import sys
from collections.abc import Callable
from datetime import date
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pypdf
import pytest
from by_path import load
from scipy.stats import chi2, norm

from monitor.exceptions import InputError
from monitor.reporting.certificate.completeness import IncompleteCertificateError
from monitor.reporting.certificate.dcc import dcc_xml
from monitor.reporting.certificate.dcc_elements import DCC, SI, DccVersion
from monitor.reporting.certificate.dsi import unit_of
from monitor.reporting.certificate.model_effect import ModelEffect
from monitor.reporting.certificate.record import (
    Accreditation,
    CertificateRecord,
    ConformityStatement,
    ConformityVerdict,
    NotApplicable,
    Replaced,
    Standard,
    Verdict,
)
from monitor.reporting.pdf.render import certificate_pdf
from monitor.reporting.refused import RefusedParameters

Make = Callable[..., CertificateRecord]
SPACES = {"dcc": DCC, "si": SI}
schema_of = load("dcc_schemas", Path(__file__).with_name("dcc_schemas.py")).schema_of
#: The writer as somebody uses it who has nothing but numbers of his own.
EXAMPLE = load("write_dcc", Path(__file__).resolve().parents[2] / "examples" / "write_dcc.py")


@pytest.fixture(scope="module")
def record(make_record: Make) -> CertificateRecord:
    """A record with everything that a digital certificate can hold."""
    made = make_record(13, (RefusedParameters(("EX0C1", "EY0C1"), "C1 stands at one angle"),))
    verdicts = tuple(
        ConformityVerdict(f"EA0{place}", "µrad", 40.0, verdict, 0.5) for place, verdict in enumerate(Verdict)
    )
    return dataclasses.replace(
        made,
        country="DE",
        conformity=ConformityStatement(
            "a rule", "a risk", verdicts, "as found", "a basis", joint_probability=0.5
        ),
        accreditation="none",
    )


@pytest.fixture(scope="module")
def tree(record: CertificateRecord) -> ET.Element:
    return ET.fromstring(dcc_xml(record))


@pytest.mark.parametrize("release", list(DccVersion))
def test_a_statement_on_the_volumetric_error_alone_is_valid(make_record: Make, release: DccVersion) -> None:
    pytest.importorskip("lxml.etree", reason="lxml validates XML schemas")
    from lxml import etree

    judged = ConformityVerdict("volumetric", "µm", 190.0, Verdict.CONDITIONAL_PASS, 0.76, 2.3)
    record = dataclasses.replace(
        make_record(13, maps=1),
        country="DE",
        dcc_version=release,
        conformity=ConformityStatement("a rule", "a risk", (judged,), "as found", "a basis", together=True),
    )
    xml = dcc_xml(record)
    schema = schema_of(release)
    schema.assertValid(etree.fromstring(xml))
    assert xml.count(b"<dcc:conformity>") == 1
    assert b"conformity of volumetric error, as found" in xml
    assert "≤ 190.0 µm, w = 2.3 µm, probability of conformity 0.76".encode() in xml


@pytest.mark.parametrize("release", list(DccVersion))
def test_ptb_dcc_schema_validates_every_part(
    record: CertificateRecord, make_record: Make, release: DccVersion
) -> None:
    etree = pytest.importorskip("lxml.etree", reason="lxml validates XML schemas")
    schema = schema_of(release)
    old = Replaced("K-2026-0041", record.issued_on, "wrong customer", "0" * 64)
    standard = Standard(
        "scale bar", "SB-1", "2026-77", "Institute", date(2026, 1, 7), NotApplicable("recalled")
    )
    for certificate in (
        record,
        dataclasses.replace(make_record(13, language="de", maps=1), country="DE", replaces=old),
        dataclasses.replace(make_record(30), country="FR", standards=(standard,)),
        dataclasses.replace(make_record(1), country="US", accredited=Accreditation("DAkkS", "D-K-0")),
        EXAMPLE.RECORD,
    ):
        schema.assertValid(etree.fromstring(dcc_xml(dataclasses.replace(certificate, dcc_version=release))))
    broken = dcc_xml(dataclasses.replace(record, dcc_version=release)).replace(
        b"coverageFactor", b"coverFactor"
    )
    assert not schema.validate(etree.fromstring(broken))


@pytest.mark.parametrize("release", list(DccVersion))
@pytest.mark.parametrize(("language", "word"), [("en", "DRAFT"), ("de", "ENTWURF")])
def test_ptb_dcc_schema_validates_a_draft_that_says_what_it_is(
    make_record: Make, release: DccVersion, language: str, word: str
) -> None:
    etree = pytest.importorskip("lxml.etree", reason="lxml validates XML schemas")
    record = dataclasses.replace(
        make_record(13, language=language, maps=1), country="DE", dcc_version=release, draft=True
    )
    draft = etree.fromstring(dcc_xml(record))
    schema_of(release).assertValid(draft)
    texts = [text for text in draft.xpath("//*[@id='draft']//text()") if text.strip()]
    assert any(word.lower() in text.lower() for text in texts)
    issued = etree.fromstring(dcc_xml(dataclasses.replace(record, draft=False)))
    assert not issued.xpath("//*[@id='draft']")


def test_d_si_2_2_1_an_element_of_the_covariance_is_a_line(make_record: Make) -> None:
    """Of 149 parameters the file has 7.0 MB instead of 9.4 MB; an XML reader sees the same."""
    record = dataclasses.replace(make_record(13), country="DE", dcc_version="3.3.0")
    lines = dcc_xml(record).decode().splitlines()
    elements = [line for line in lines if "<si:covarianceXMLList>" in line]
    assert len(elements) == 2 * 13 * 13
    assert all(line.strip().endswith("</si:covarianceXMLList>") for line in elements)


@pytest.mark.parametrize(("region", "factor"), [("ellipsoidal", "k_p"), ("rectangular", "k_q")])
def test_d_si_2_1_both_regions_hold_the_covariance_to_the_last_bit(
    tree: ET.Element, record: CertificateRecord, region: str, factor: str
) -> None:
    assert record.results is not None
    (result,) = record.results
    (around,) = tree.iterfind(f".//si:{region}RegionXMLList", SPACES)
    columns = around.findall("si:covarianceMatrix/si:column", SPACES)
    values = [
        [float(str(one.text)) for one in column.iterfind("si:covariance/si:value", SPACES)]
        for column in columns
    ]
    assert np.array_equal(np.array(values).T, result.covariance)
    assert float(str(around.findtext("si:coverageFactor", None, SPACES))) == getattr(result, factor)
    assert float(str(around.findtext("si:coverageProbability", None, SPACES))) == result.p
    units = [one.text for one in columns[0].iterfind("si:covariance/si:unit", SPACES)]
    assert units[:3] == [r"\micro\radian\micro\radian"] * 2 + [r"\micro\metre\micro\radian"]


def test_d_si_2_1_lists_hold_names_values_and_units(tree: ET.Element, record: CertificateRecord) -> None:
    assert record.results is not None
    (result,) = record.results
    lists = tree.findall(".//si:realListXMLList", SPACES)
    assert len(lists) == 2
    for one in lists:
        assert str(one.findtext("si:labelXMLList", None, SPACES)).split() == list(result.names)
        found = [float(number) for number in str(one.findtext("si:valueXMLList", None, SPACES)).split()]
        assert found == result.estimate.tolist()
        assert str(one.findtext("si:unitXMLList", None, SPACES)).split() == [
            unit_of(unit) for unit in result.units
        ]


def test_every_statement_of_the_record_is_in_it(tree: ET.Element, record: CertificateRecord) -> None:
    text = " ".join("".join(tree.itertext()).split())
    assert record.method is not None
    assert record.customer is not None
    for words in (
        record.title, record.number, record.place, record.traceability, record.relates_only, record.reproduction,
        record.method.document, record.customer.name, "C1 stands at one angle", "bar certificate 2016-04", "a rule",
    ):  # fmt: skip
        assert " ".join(str(words).split()) in text
    status = [one.text for one in tree.iterfind(".//dcc:conformity", SPACES)]
    assert status == ["pass", "fail", "conditionalPass", "conditionalFail", "noPass"]


def test_it_travels_inside_the_pdf_where_the_country_is_known(
    record: CertificateRecord, make_record: Make
) -> None:
    attached = pypdf.PdfReader(
        io.BytesIO(certificate_pdf(dataclasses.replace(make_record(), country="DE")))
    ).attachments
    assert attached["certificate.dcc.xml"][0] == dcc_xml(dataclasses.replace(make_record(), country="DE"))
    assert (
        "certificate.dcc.xml" not in pypdf.PdfReader(io.BytesIO(certificate_pdf(make_record()))).attachments
    )


def test_what_is_missing_is_refused_and_not_invented(make_record: Make) -> None:
    with pytest.raises(InputError, match=r"country by two letters \(ISO 3166-1\).*it has None"):
        dcc_xml(make_record())
    with pytest.raises(IncompleteCertificateError, match="place where the calibration was performed"):
        dcc_xml(dataclasses.replace(make_record(), country="DE", place=None))
    with pytest.raises(InputError, match="unit furlong has no D-SI notation"):
        unit_of("furlong")


def test_iso_17025_7_8_8_3_the_replaced_certificate_is_named_with_its_hash(make_record: Make) -> None:
    made = make_record()
    old = Replaced("K-2026-0041", made.issued_on, "wrong customer", "ab" * 32)
    core = ET.fromstring(dcc_xml(dataclasses.replace(made, country="DE", replaces=old))).find(
        ".//dcc:coreData", SPACES
    )
    assert core is not None
    change = core.find("dcc:reportAmendedSubstituted", SPACES)
    assert change is not None
    assert [one.text for one in change] == ["substituted", "K-2026-0041"]
    assert core.findtext("dcc:previousReport/dcc:procedure", None, SPACES) == "SHA-256"
    assert core.findtext("dcc:previousReport/dcc:value", None, SPACES) == "ab" * 32


@pytest.mark.parametrize("language", ["en", "de"])
def test_every_text_says_its_language(make_record: Make, language: str) -> None:
    tree = ET.fromstring(
        dcc_xml(dataclasses.replace(make_record(13, language=language, maps=1), country="DE"))
    )
    for name in ("usedLangCodeISO639_1", "mandatoryLangCodeISO639_1"):
        assert tree.findtext(f".//dcc:{name}", None, SPACES) == language
    said = [(one.get("lang"), one.text) for one in tree.iterfind(".//dcc:content", SPACES)]
    assert len(said) > 40
    assert {text for lang, text in said if lang != language} <= {"machine-health-monitor"}


def test_d_si_2_1_the_volumetric_error_has_its_expanded_uncertainty(make_record: Make) -> None:
    made = make_record(13, maps=1)
    tree = ET.fromstring(dcc_xml(dataclasses.replace(made, country="DE")))
    found = [
        (float(str(one.findtext("si:value", None, SPACES))),
         float(str(one.findtext("si:expandedUnc/si:uncertainty", None, SPACES))),
         float(str(one.findtext("si:expandedUnc/si:coverageFactor", None, SPACES))))
        for one in tree.iterfind(".//si:real", SPACES)
    ]  # fmt: skip
    (printed,) = made.volumetric
    lengths = (printed.largest, printed.rms, printed.mean)
    assert found == [(one.value_um, one.expanded_um, printed.k) for one in lengths]


@pytest.mark.parametrize(
    ("name", "notation"),
    [
        ("µm", r"\micro\metre"),
        ("µrad/m", r"\micro\radian\per\metre"),
        ("µm/m²", r"\micro\metre\per\metre\tothe{2}"),
        ("µm/m/K", r"\micro\metre\per\metre\per\kelvin"),
    ],
)
def test_d_si_2_1_units(name: str, notation: str) -> None:
    assert unit_of(name) == notation


def test_the_writer_alone_needs_no_database_and_draws_nothing(tmp_path: Path) -> None:
    place = tmp_path / "own.dcc.xml"
    code = (
        "import runpy, sys\n"
        f"sys.argv = ['write_dcc.py', {str(place)!r}]\n"
        f"runpy.run_path({EXAMPLE.__file__!r}, run_name='__main__')\n"
        "print([one for one in ('duckdb', 'weasyprint', 'matplotlib', 'scipy') if one in sys.modules])"
    )
    said = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    assert said.splitlines()[-1] == "[]"
    tree = ET.parse(place).getroot()
    assert tree.findtext(".//dcc:uniqueIdentifier", None, SPACES) == "K-2026-0042"
    values = str(tree.findtext(".//si:valueXMLList", None, SPACES)).split()
    np.testing.assert_allclose([float(one) for one in values], [12.4, -31.0], rtol=1e-14)
    # JCGM 102:2011, 6.5: what the example states as factors of two outputs.
    np.testing.assert_allclose(
        (EXAMPLE.RESULT.k_p, EXAMPLE.RESULT.k_q), (chi2.ppf(0.95, 2) ** 0.5, norm.isf(0.0125)), atol=5e-3
    )


def test_software_without_a_release_is_no_software_of_a_dcc(make_record: Make) -> None:
    made = dataclasses.replace(make_record(1), country="DE")
    assert made.method is not None
    with pytest.raises(InputError, match=r"names a program and its release; method\.software is 'own'"):
        dcc_xml(dataclasses.replace(made, method=dataclasses.replace(made.method, software="own")))


def test_factors_of_few_runs_are_told_as_those_of_the_t_distribution(make_record: Make) -> None:
    made = dataclasses.replace(make_record(3), country="DE")
    assert made.results is not None

    def told(**changes: object) -> set[str]:
        assert made.results is not None
        result = dataclasses.replace(made.results[0], **changes)  # type: ignore[arg-type]
        tree = ET.fromstring(dcc_xml(dataclasses.replace(made, results=(result,))))
        return {str(one.text) for one in tree.iterfind(".//si:distribution", SPACES)}

    assert told() == {"normal"}
    assert told(dof=15.0) == told(dof=15.0, trials=10**6) == {"t"}
    assert told(trials=10**6) == {"numerical"}
    assert told(dof=float("nan")) == {"normal"}  # as a stored record says that it is known


@pytest.mark.parametrize("release", list(DccVersion))
@pytest.mark.parametrize("language", ["en", "de"])
def test_effects_of_the_model_are_results_with_their_own_uncertainty(
    make_record: Make, release: DccVersion, language: str
) -> None:
    etree = pytest.importorskip("lxml.etree", reason="lxml validates XML schemas")
    made = make_record(13, language=language)
    assert made.results is not None
    effects = (
        ModelEffect("EXX:reversal", "µm", 5.85, 0.098, 6, 2, 11.7, 0.196),
        ModelEffect("EBZ:poly2"),
    )
    results = (dataclasses.replace(made.results[0], effects=effects),)
    record = dataclasses.replace(made, country="DE", dcc_version=release, results=results)
    tree = etree.fromstring(dcc_xml(record))
    schema_of(release).assertValid(tree)
    spaces = {"d": "https://ptb.de/dcc", "s": "https://ptb.de/si"}
    stated = [
        element
        for element in tree.xpath("//d:result", namespaces=spaces)
        if "EXX:reversal" in element.xpath("string(d:name)", namespaces=spaces)
    ]
    values, k = [], 2.0 if release is DccVersion.V3_2_1 else 1.0
    for element in stated:
        (value,) = element.xpath(".//s:real/s:value/text()", namespaces=spaces)
        (u,) = element.xpath(".//s:uncertainty/text() | .//s:valueStandardMU/text()", namespaces=spaces)
        assert element.xpath("string(.//s:real/s:unit)", namespaces=spaces) == r"\micro\metre"
        values.append((float(value), float(u) / k))
    assert values == [(5.85, 0.098), (11.7, 0.196)]
    (unknown,) = [
        element.xpath("string(.)", namespaces=spaces)
        for element in tree.xpath("//d:result", namespaces=spaces)
        if "EBZ:poly2" in element.xpath("string(d:name)", namespaces=spaces)
    ]
    assert "EBZ:poly2" in unknown
    assert len(tree.xpath("//d:result", namespaces=spaces)) == 5
