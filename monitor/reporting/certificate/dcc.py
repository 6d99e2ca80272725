"""Digital Calibration Certificates: PTB DCC 3.3.0 with values in D-SI 2.2.1, or 3.2.1 with 2.1, from a record.

``dcc_xml`` needs nothing but a record. The parameters stand in lists twice, each with the full covariance matrix:
once with the ellipsoidal region (k_p), once with the rectangular region (k_q), both of JCGM 102:2011. What the
record says in words goes where the schema has a place for it; nothing is invented, so a record without the
laboratory's country (ISO 3166-1) is refused. A record that names no release was written before 3.3.0 was: it is
written in 3.2.1, byte for byte as then.

The writer stands alone: it loads neither the database nor what draws pages. ``results.result_set`` makes the results
from an estimate and a covariance; ``examples/write_dcc.py`` is a whole program.
"""

from __future__ import annotations

import re
from datetime import date
from xml.etree import ElementTree as ET

from monitor.exceptions import InputError
from monitor.reporting.certificate.completeness import check_complete
from monitor.reporting.certificate.dcc_elements import (
    DCC,
    SI,
    add,
    define_vocabulary,
    say,
    strip_vocabulary,
    version_of,
)
from monitor.reporting.certificate.dcc_results import geometric_errors, volumetric_error
from monitor.reporting.certificate.grounds import accepted_statements
from monitor.reporting.certificate.record import (
    CertificateRecord,
    ConformityStatement,
    Party,
    Replaced,
    Verdict,
)
from monitor.reporting.certificate.tables import guard_band, judged_name, tolerance_words
from monitor.reporting.certificate.words import amendment, answer, verdict_words
from monitor.reporting.numbers import decimal_of
from monitor.reporting.texts import Texts, texts_of

#: The schema's word for a verdict (stringConformityStatementStatusType).
_STATUS = {
    Verdict.PASS: "pass",
    Verdict.FAIL: "fail",
    Verdict.CONDITIONAL_PASS: "conditionalPass",
    Verdict.CONDITIONAL_FAIL: "conditionalFail",
    Verdict.UNDECIDED: "noPass",
}

#: The identifier of the statement that only a draft has: the schemas have no element for it.
DRAFT = "draft"
#: The refType of a statement, where the vocabulary has one.
_REFS = {"traceability": "basic_metrologicallyTraceableToSI", "amendment": "basic_revision"}


def dcc_xml(record: CertificateRecord) -> bytes:
    """The certificate as a DCC, UTF-8, in the language of the record.

    Raises IncompleteCertificateError where an item is missing, InputError without a country, without the release of
    the software (behind its name: "program 1.4") or for a unit that has no D-SI notation here.
    """
    check_complete(record)
    if not re.fullmatch("[A-Z]{2}", record.country or ""):
        raise InputError(
            "a digital certificate names the laboratory's country by two letters (ISO 3166-1): write "
            f'country = "DE" in the section [laboratory] of its file; it has {record.country!r}'
        )
    _check_software(record)
    version = version_of(record)
    ET.register_namespace("dcc", DCC)
    ET.register_namespace("si", SI)
    root = ET.Element(f"{{{DCC}}}digitalCalibrationCertificate", {"schemaVersion": version})
    texts = texts_of(record.language)
    _administrative(add(root, "administrativeData"), record, texts)
    results = add(root, "measurementResults")
    for result in record.results or ():
        geometric_errors(add(results, "measurementResult"), record, result, texts)
    for volumetric in record.volumetric:
        volumetric_error(add(results, "measurementResult"), record, volumetric, texts)
    if not version.by_vocabulary:
        strip_vocabulary(root)
    ET.indent(root, " ")
    # An element of a covariance is a line: of 149 parameters there are 44 402, two matrices as D-SI asks for them.
    for covariance in root.iter(f"{{{SI}}}covarianceXMLList"):
        covariance.text, covariance.tail = None, "\n"
        for part in covariance:
            part.tail = None
    return bytes(ET.tostring(root, encoding="utf-8", xml_declaration=True)) + b"\n"


def _check_software(record: CertificateRecord) -> None:
    software = str(record.method.software) if record.method is not None else ""
    if not all(software.rpartition(" ")[::2]):
        raise InputError(
            f"a digital certificate names a program and its release; method.software is {software!r}, for example "
            "'program 1.4'"
        )


def _administrative(parent: ET.Element, record: CertificateRecord, texts: Texts) -> None:
    language = texts.language
    assert record.method is not None  # complete: dcc_xml has checked it
    assert record.item is not None
    assert record.laboratory is not None
    assert record.customer is not None
    assert record.performed_on is not None
    software = add(add(parent, "dccSoftware"), "software")
    name, _, release = str(record.method.software).rpartition(" ")
    say(software, "name", name, language if version_of(record).by_vocabulary else "en")
    add(software, "release", release)
    if version_of(record).by_vocabulary:
        define_vocabulary(parent, texts)
    core = add(parent, "coreData")
    add(core, "countryCodeISO3166_1", record.country)
    add(core, "usedLangCodeISO639_1", language)
    add(core, "mandatoryLangCodeISO639_1", language)
    add(core, "uniqueIdentifier", record.number)
    if isinstance(record.received_on, date):
        add(core, "receiptDate", record.received_on.isoformat())
    add(core, "beginPerformanceDate", record.performed_on[0].isoformat())
    add(core, "endPerformanceDate", record.performed_on[1].isoformat())
    add(core, "performanceLocation", "other")
    add(core, "issueDate", str(record.issued_on))
    if record.replaces is not None:
        _replaced(core, record.replaces, texts)
    item_element = add(add(parent, "items"), "item")
    say(item_element, "name", str(record.item.description), language)
    say(item_element, "description", str(record.item.condition), language)
    identification = add(add(item_element, "identifications"), "identification")
    add(identification, "issuer", "other")
    add(identification, "value", record.item.identification)
    _contact(add(add(parent, "calibrationLaboratory"), "contact"), record.laboratory, language)
    people = add(parent, "respPersons")
    for index, person in enumerate(record.authorised_by or ()):
        responsible = add(people, "respPerson")
        say(add(responsible, "person"), "name", str(person.name), language)
        add(responsible, "role", person.function)
        add(responsible, "mainSigner", "true" if index == 0 else "false")
    _contact(add(parent, "customer"), record.customer, language)
    _statements(add(parent, "statements"), record, texts)


def _replaced(core: ET.Element, old: Replaced, texts: Texts) -> None:
    """The certificate that this one replaces, and the hash of its document."""
    change = add(core, "reportAmendedSubstituted")
    add(change, "typeOfChange", "substituted")
    add(change, "replacedUniqueIdentifier", old.number)
    previous = add(core, "previousReport")
    say(previous, "referral", texts("dcc.replaced"), texts.language)
    add(previous, "referralID", old.number)
    add(previous, "procedure", "SHA-256")
    add(previous, "value", old.sha256)


def _contact(parent: ET.Element, party: Party, language: str) -> None:
    say(parent, "name", str(party.name), language)
    contact = str(party.contact)
    mail, phone = "@" in contact, re.fullmatch(r"[+()/\d \-.]+", contact) is not None
    if mail or phone:
        add(parent, "eMail" if mail else "phone", contact)
    further = add(add(parent, "location"), "further")
    for line in party.address if mail or phone else (*party.address, contact):
        add(further, "content", line).set("lang", language)


def _conformity(parent: ET.Element, conformity: ConformityStatement, texts: Texts) -> None:
    """A statement for each verdict, with the rule and the numbers that it rests on."""
    for verdict in conformity.verdicts:
        statement = add(parent, "statement", ref="basic_conformity")
        say(
            statement,
            "name",
            texts("dcc.conformity_of", name=judged_name(verdict, texts), state=conformity.state),
            texts.language,
        )
        banded = verdict.guard_band is not None
        declaration = texts(
            "dcc.verdict_band" if banded else "dcc.verdict",
            band=guard_band(verdict, texts) if banded else "",
            verdict=verdict_words(verdict.verdict, texts),
            tolerance=tolerance_words(verdict, texts),
            unit=verdict.unit,
            probability=texts.number(decimal_of(verdict.probability)),
            rule=conformity.rule,
            risk=conformity.risk,
            basis=" ".join(filter(None, [conformity.basis, conformity.process])),
        )
        say(statement, "declaration", declaration, texts.language)
        add(statement, "conformity", _STATUS[verdict.verdict])


def _statements(parent: ET.Element, record: CertificateRecord, texts: Texts) -> None:
    conformity = record.conformity
    if isinstance(conformity, ConformityStatement):
        _conformity(parent, conformity, texts)
    statements = [
        ("title", record.title),
        ("place", record.place),
        ("traceability", record.traceability),
        ("received", answer(record.received_on, texts)),
        ("sampling", answer(record.sampling, texts)),
        ("deviations", answer(record.deviations, texts)),
        ("external_results", answer(record.external_results, texts)),
        ("adjustment", answer(record.adjustment, texts)),
        ("conformity", "" if isinstance(conformity, ConformityStatement) else answer(conformity, texts)),
        ("opinions", answer(record.opinions, texts)),
        ("validity", record.relates_only),
        ("reproduction", record.reproduction),
        ("accreditation", record.accreditation),
        ("amendment", amendment(record.replaces, texts)),
    ]
    if version_of(record).by_vocabulary and record.accredited is not None:
        statements += [("accreditation", f"{record.accredited.body}, {record.accredited.number}")]
    statements += [("accepted", accepted) for accepted in accepted_statements(record.accepted or (), texts)]
    if record.draft:
        statement = add(parent, "statement")
        statement.set("id", DRAFT)
        say(statement, "name", texts("dcc.draft"), texts.language)
        say(statement, "declaration", texts("dcc.draft_statement"), texts.language)
    named = [(texts(f"dcc.{key}"), value, _REFS.get(key)) for key, value in statements]
    if not version_of(record).by_vocabulary:  # later releases have them among the measuring equipment
        named[3:3] = [
            (texts("dcc.standard", name=statement.name), answer(statement.certificate, texts), None)
            for statement in record.references or ()
        ]
    for name, value, ref in named:
        if value:
            statement = add(parent, "statement", ref=ref)
            say(statement, "name", name, texts.language)
            say(statement, "declaration", value, texts.language)
