"""Digital Calibration Certificates: PTB DCC 3.2.1 with values in D-SI 2.1, from a certificate's record.

``dcc_xml`` needs nothing but a record. The parameters stand in lists twice, each with the full covariance matrix:
once with the ellipsoidal region (k_p), once with the rectangular region (k_q), both of JCGM 102:2011. What the
record says in words goes where the schema has a place for it; nothing is invented, so a record without the
laboratory's country (ISO 3166-1) is refused.
"""

from __future__ import annotations

import re
from datetime import date
from xml.etree import ElementTree as ET

import numpy as np

from monitor.exceptions import InputError
from monitor.reporting.certificate import (
    CertificateRecord,
    ConformityStatement,
    NotApplicable,
    Party,
    check_complete,
)
from monitor.reporting.results import ResultSet

DCC = "https://ptb.de/dcc"
SI = "https://ptb.de/si"
SCHEMA_VERSION = "3.2.1"
_XSI = "http://www.w3.org/2001/XMLSchema-instance"

#: A unit of a quotient: the same in the notation of D-SI (PTB, SmartCom D-SI metadata model, 2.1).
_UNITS = {
    "µm": r"\micro\metre",
    "µrad": r"\micro\radian",
    "mm": r"\milli\metre",
    "m": r"\metre",
    "rad": r"\radian",
    "K": r"\kelvin",
    "°C": r"\degreecelsius",
    "s": r"\second",
    "min": r"\minute",
    "h": r"\hour",
    "1": r"\one",
}
_POWERS = {"²": "2", "³": "3"}
#: The schema's word for a verdict (stringConformityStatementStatusType).
_STATUS = {
    "pass": "pass",
    "fail": "fail",
    "conditional pass": "conditionalPass",
    "conditional fail": "conditionalFail",
    "undecided": "noPass",
}


def dcc_xml(record: CertificateRecord, language: str = "en") -> bytes:
    """The certificate as a DCC, UTF-8; ``language`` (ISO 639-1) is that of the record's texts.

    Raises IncompleteCertificateError where an item is missing, InputError without a country or for a unit that
    has no D-SI notation here.
    """
    check_complete(record)
    if not re.fullmatch("[A-Z]{2}", record.country or ""):
        raise InputError(
            "a digital certificate names the laboratory's country by two letters (ISO 3166-1): write "
            f'country = "DE" in the section [laboratory] of its file; it has {record.country!r}'
        )
    ET.register_namespace("dcc", DCC)
    ET.register_namespace("si", SI)
    root = ET.Element(f"{{{DCC}}}digitalCalibrationCertificate", {"schemaVersion": SCHEMA_VERSION})
    _administrative(_add(root, "administrativeData"), record, language)
    results = _add(root, "measurementResults")
    for result in record.results or ():
        _result(_add(results, "measurementResult"), record, result, language)
    ET.indent(root, " ")
    return bytes(ET.tostring(root, encoding="utf-8", xml_declaration=True)) + b"\n"


def unit_of(name: str) -> str:
    """A display unit in the notation of D-SI. Raises InputError for one that has none here."""
    written = []
    for place, factor in enumerate(name.split("/")):
        stem, power = re.fullmatch(r"(.*?)(²|³|\^[0-9])?", factor).groups()  # type: ignore[union-attr]
        if stem not in _UNITS:
            raise InputError(
                f"unit {name} has no D-SI notation here; there are {', '.join(_UNITS)}, their powers and quotients"
            )
        raised = "" if power is None else rf"\tothe{{{_POWERS.get(power, power.lstrip('^'))}}}"
        written.append((r"\per" if place else "") + _UNITS[stem] + raised)
    return "".join(written)


def _add(parent: ET.Element, tag: str, text: str | None = None, space: str = DCC) -> ET.Element:
    child = ET.SubElement(parent, f"{{{space}}}{tag}")
    child.text = text
    return child


def _text(parent: ET.Element, tag: str, text: str, language: str) -> ET.Element:
    """An element whose text says in which language it is."""
    child = _add(parent, tag)
    _add(child, "content", text).set("lang", language)
    return child


def _administrative(parent: ET.Element, record: CertificateRecord, language: str) -> None:
    assert record.method is not None  # complete: dcc_xml has checked it
    assert record.item is not None
    assert record.laboratory is not None
    assert record.customer is not None
    assert record.performed_on is not None
    software = _add(_add(parent, "dccSoftware"), "software")
    name, _, release = str(record.method.software).rpartition(" ")
    _text(software, "name", name, "en")
    _add(software, "release", release)
    core = _add(parent, "coreData")
    _add(core, "countryCodeISO3166_1", record.country)
    _add(core, "usedLangCodeISO639_1", language)
    _add(core, "mandatoryLangCodeISO639_1", language)
    _add(core, "uniqueIdentifier", record.number)
    if isinstance(record.received_on, date):
        _add(core, "receiptDate", record.received_on.isoformat())
    _add(core, "beginPerformanceDate", record.performed_on[0].isoformat())
    _add(core, "endPerformanceDate", record.performed_on[1].isoformat())
    _add(core, "performanceLocation", "other")
    _add(core, "issueDate", str(record.issued_on))
    item = _add(_add(parent, "items"), "item")
    _text(item, "name", str(record.item.description), language)
    _text(item, "description", str(record.item.condition), language)
    identification = _add(_add(item, "identifications"), "identification")
    _add(identification, "issuer", "other")
    _add(identification, "value", record.item.identification)
    _contact(_add(_add(parent, "calibrationLaboratory"), "contact"), record.laboratory, language)
    people = _add(parent, "respPersons")
    for place, person in enumerate(record.authorised_by or ()):
        one = _add(people, "respPerson")
        _text(_add(one, "person"), "name", str(person.name), language)
        _add(one, "role", person.function)
        _add(one, "mainSigner", "true" if place == 0 else "false")
    _contact(_add(parent, "customer"), record.customer, language)
    _statements(_add(parent, "statements"), record, language)


def _contact(parent: ET.Element, party: Party, language: str) -> None:
    _text(parent, "name", str(party.name), language)
    contact = str(party.contact)
    mail, phone = "@" in contact, re.fullmatch(r"[+()/\d \-.]+", contact) is not None
    if mail or phone:
        _add(parent, "eMail" if mail else "phone", contact)
    further = _add(_add(parent, "location"), "further")
    for line in party.address if mail or phone else (*party.address, contact):
        _add(further, "content", line).set("lang", language)


def _statements(parent: ET.Element, record: CertificateRecord, language: str) -> None:
    conformity = record.conformity
    if isinstance(conformity, ConformityStatement):
        for verdict in conformity.verdicts:
            one = _add(parent, "statement")
            _text(one, "name", f"conformity of {verdict.name}", language)
            _text(
                one,
                "declaration",
                f"{verdict.verdict}: tolerance ± {verdict.tolerance!r} {verdict.unit}, probability of conformity "
                f"{verdict.probability!r}; rule: {conformity.rule}; risk: {conformity.risk}",
                language,
            )
            _add(one, "conformity", _STATUS[verdict.verdict])
    for name, value in (
        ("title", record.title),
        ("place of calibration", record.place),
        ("metrological traceability", record.traceability),
        *((f"standard: {one.name}", one.certificate) for one in record.references or ()),
        ("date of receipt", record.received_on),
        ("sampling", record.sampling),
        ("deviations from the method", record.deviations),
        ("external results", record.external_results),
        ("before and after adjustment", record.adjustment),
        ("conformity", conformity),
        ("opinions and interpretations", record.opinions),
        ("validity", record.relates_only),
        ("reproduction", record.reproduction),
        ("accreditation", record.accreditation),
        ("amendment", record.replaces),
    ):
        if isinstance(value, NotApplicable):
            value = f"Not applicable: {value.statement}"
        if isinstance(value, str):
            one = _add(parent, "statement")
            _text(one, "name", name, language)
            _text(one, "declaration", value, language)


def _result(parent: ET.Element, record: CertificateRecord, result: ResultSet, language: str) -> None:
    assert record.method is not None  # complete: dcc_xml has checked it
    _text(parent, "name", f"geometric errors, {result.state}", language)
    method = _add(_add(parent, "usedMethods"), "usedMethod")
    _text(method, "name", str(record.method.name), language)
    words = f"{record.method.document}; model {record.method.model}; {result.evaluation}"
    _text(method, "description", words, language)
    conditions = _add(parent, "influenceConditions")
    for condition in record.conditions or ():
        one = _add(conditions, "influenceCondition")
        _text(one, "name", condition.name, language)
        _text(_add(one, "data"), "text", str(condition.value), language)
    results = _add(parent, "results")
    for region, factor, words in (
        ("ellipsoidal", result.k_p, f"hyper-ellipsoid of {result.rank} dimensions (JCGM 102:2011, 6.5.2)"),
        ("rectangular", result.k_q, "hyper-rectangle: all intervals at once (JCGM 102:2011, 6.5.4)"),
    ):
        one = _add(results, "result")
        _text(one, "name", f"parameters with their {region} coverage region", language)
        _text(one, "description", words, language)
        quantity = _add(_add(one, "data"), "quantity")
        _text(quantity, "name", "; ".join(result.descriptions), language)
        _values(quantity, result, region, factor)
    for refusal in result.refused:
        one = _add(results, "result")
        _text(one, "name", f"no result for {', '.join(refusal.parameters)}", language)
        _text(_add(one, "data"), "text", refusal.why, language)


def _values(parent: ET.Element, result: ResultSet, region: str, factor: float) -> None:
    units = [unit_of(unit) for unit in result.units]
    values = _add(parent, "realListXMLList", space=SI)
    _add(values, "labelXMLList", " ".join(result.names), SI)
    _add(values, "valueXMLList", " ".join(_number(float(value)) for value in result.estimate), SI)
    _add(values, "unitXMLList", " ".join(units), SI)
    around = _add(values, f"{region}RegionXMLList", space=SI)
    matrix = _add(around, "covarianceMatrix", space=SI)
    for place, unit in enumerate(units):
        column = _add(matrix, "column", space=SI)
        for other, second in enumerate(units):
            element = _add(column, "covariance", space=SI)
            _add(element, "value", _number(float(result.covariance[other, place])), SI)
            _add(element, "unit", second + unit, SI)
    _add(around, "coverageFactor", _number(factor), SI)
    _add(around, "coverageProbability", _number(result.p), SI)
    _add(around, "distribution", "normal" if result.trials is None else "numerical", SI)


def _number(value: float) -> str:
    """The shortest decimal that means this double, as the schema writes exponents."""
    text = repr(float(np.float64(value)))
    return text.replace("e", "E").replace("E+", "E")
