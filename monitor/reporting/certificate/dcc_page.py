"""A digital certificate for people: what its XML says, and nothing else, as the words of a page.

Read from the file and not from the record, so that the page shows what a program reads. Both releases are read.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import date
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from monitor.records import Array
from monitor.reporting.certificate.dcc_elements import DCC, SI
from monitor.reporting.certificate.dsi import written_unit
from monitor.reporting.numbers import decimal_of, round_result, written_correlation, written_factor
from monitor.reporting.texts import Texts, texts_of

_SPACES = {"dcc": DCC, "si": SI}


@dataclass(frozen=True)
class ValueRow:
    """One value as printed; ``uncertainty`` is empty where the file states none."""

    label: str
    value: str
    uncertainty: str
    unit: str


@dataclass(frozen=True)
class CorrelationRow:
    """A row of the correlation matrix up to its diagonal."""

    label: str
    coefficients: tuple[str, ...]


@dataclass(frozen=True)
class ShownResult:
    """A result: its words, its values, what the coverage factor is, and the correlations where it is a vector.

    ``symbol`` of the uncertainty: u beside an ellipsoid, whose factor is of no single parameter, else U = k u.
    """

    name: str
    description: str
    text: str
    rows: tuple[ValueRow, ...]
    symbol: str
    coverage: str
    correlations: tuple[CorrelationRow, ...]


@dataclass(frozen=True)
class ShownMeasurement:
    """What belongs to one state of the machine: methods, standards and conditions by name, and the results."""

    name: str
    methods: tuple[tuple[str, str], ...]
    standards: tuple[tuple[str, str], ...]
    conditions: tuple[tuple[str, str], ...]
    results: tuple[ShownResult, ...]


def dcc_context(xml: bytes) -> dict[str, Any]:
    """Everything that ``dcc.html`` prints of a digital certificate of ours."""
    root = ET.fromstring(xml)
    core = _element(root, "dcc:administrativeData/dcc:coreData")
    texts = texts_of(_text(core, "dcc:usedLangCodeISO639_1"))
    administrative = _element(root, "dcc:administrativeData")
    return {
        "texts": texts,
        "release": root.get("schemaVersion"),
        "number": _text(core, "dcc:uniqueIdentifier"),
        "core": tuple(_core(core, texts)),
        "parties": tuple(_parties(administrative, texts)),
        "statements": tuple(
            (_said(statement, "dcc:name"), _said(statement, "dcc:declaration"))
            for statement in administrative.iterfind("dcc:statements/dcc:statement", _SPACES)
        ),
        "measurements": tuple(
            _measurement(part, texts)
            for part in root.iterfind("dcc:measurementResults/dcc:measurementResult", _SPACES)
        ),
    }


def _core(core: ET.Element, texts: Texts) -> Iterator[tuple[str, str]]:
    for tag in ("issueDate", "beginPerformanceDate", "endPerformanceDate", "receiptDate"):
        day = _text(core, f"dcc:{tag}")
        if day:
            yield texts(f"dcc_page.{tag}"), texts.day(date.fromisoformat(day))
    replaced = _text(core, "dcc:previousReport/dcc:referralID")
    if replaced:
        digest = _text(core, "dcc:previousReport/dcc:value")
        yield texts("dcc.replaced"), f"{replaced} (SHA-256 {digest})"


def _parties(administrative: ET.Element, texts: Texts) -> Iterator[tuple[str, tuple[str, ...]]]:
    for tag, path in (("laboratory", "dcc:calibrationLaboratory/dcc:contact"), ("customer", "dcc:customer")):
        contact = _element(administrative, path)
        lines = [_said(contact, "dcc:name"), *_contents(contact, "dcc:location/dcc:further")]
        lines += [_text(contact, "dcc:eMail"), _text(contact, "dcc:phone")]
        yield texts(f"dcc_page.{tag}"), tuple(filter(None, lines))
    for machine in administrative.iterfind("dcc:items/dcc:item", _SPACES):
        marks = [str(mark.text) for mark in machine.iterfind(".//dcc:identification/dcc:value", _SPACES)]
        yield texts("dcc_page.item"), (_said(machine, "dcc:name"), *marks, _said(machine, "dcc:description"))
    people = tuple(
        ", ".join(filter(None, (_said(person, "dcc:person/dcc:name"), _text(person, "dcc:role"))))
        for person in administrative.iterfind("dcc:respPersons/dcc:respPerson", _SPACES)
    )
    yield texts("dcc_page.persons"), people
    software = tuple(
        f"{_said(program, 'dcc:name')} {_text(program, 'dcc:release')}"
        for program in administrative.iterfind("dcc:dccSoftware/dcc:software", _SPACES)
    )
    yield texts("dcc_page.software"), software


def _measurement(part: ET.Element, texts: Texts) -> ShownMeasurement:
    def named(path: str) -> tuple[tuple[str, str], ...]:
        return tuple(
            (_said(element, "dcc:name"), _said(element, "dcc:description"))
            for element in part.iterfind(path, _SPACES)
        )

    return ShownMeasurement(
        name=_said(part, "dcc:name"),
        methods=named("dcc:usedMethods/dcc:usedMethod"),
        standards=named("dcc:measuringEquipments/dcc:measuringEquipment"),
        conditions=tuple(
            (_said(condition, "dcc:name"), _condition(condition, texts))
            for condition in part.iterfind("dcc:influenceConditions/dcc:influenceCondition", _SPACES)
        ),
        results=tuple(_result(result, texts) for result in part.iterfind("dcc:results/dcc:result", _SPACES)),
    )


def _condition(condition: ET.Element, texts: Texts) -> str:
    quantity = condition.find("dcc:data/dcc:quantity/si:real", _SPACES)
    if quantity is None:
        return _said(condition, "dcc:data/dcc:text")
    value = texts.number(decimal_of(float(_text(quantity, "si:value"))))
    measured = f"{value}\N{NO-BREAK SPACE}{written_unit(_text(quantity, 'si:unit'))}"
    u = quantity.findtext(".//si:valueStandardMU", None, _SPACES)
    if u is None:
        return measured
    return f"{measured} (u\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}{texts.number(decimal_of(float(u)))})"


def _result(result: ET.Element, texts: Texts) -> ShownResult:
    quantity = result.find("dcc:data/dcc:quantity", _SPACES)
    rows: tuple[ValueRow, ...] = ()
    symbol, coverage = "u" if _ellipsoidal(result) else "U", ""
    correlations: tuple[CorrelationRow, ...] = ()
    if quantity is not None:
        vector, single = quantity.find("si:realListXMLList", _SPACES), quantity.find("si:real", _SPACES)
        if vector is not None:
            rows, coverage, correlations = _vector(vector, texts)
        elif single is not None:
            rows, symbol, coverage = _single(single, _said(result, "dcc:name"), texts)
    return ShownResult(
        name=_said(result, "dcc:name"),
        description=_said(result, "dcc:description"),
        text=_said(result, "dcc:data/dcc:text"),
        rows=rows,
        symbol=symbol,
        coverage=coverage,
        correlations=correlations,
    )


def _single(quantity: ET.Element, label: str, texts: Texts) -> tuple[tuple[ValueRow, ...], str, str]:
    """One value with its uncertainty, the symbol and the coverage of that: expanded, which D-SI 2.1 and 2.2.1 name
    otherwise, or standard."""
    standard = _text(quantity, ".//si:valueStandardMU")
    uncertainty = float(standard or _any(quantity, "valueExpandedMU", "uncertainty"))
    unit = written_unit(_text(quantity, "si:unit"))
    rounded = round_result(float(_text(quantity, "si:value")), uncertainty)
    row = ValueRow(label, texts.number(rounded.estimate), texts.number(rounded.uncertainty), unit)
    return ((row,), "u", "") if standard else ((row,), "U", _coverage(quantity, "", texts))


def _vector(vector: ET.Element, texts: Texts) -> tuple[tuple[ValueRow, ...], str, tuple[CorrelationRow, ...]]:
    labels = _text(vector, "si:labelXMLList").split()
    values = [float(value) for value in _text(vector, "si:valueXMLList").split()]
    units = [written_unit(unit) for unit in _text(vector, "si:unitXMLList").split()]
    covariance = _covariance(vector)
    u = np.sqrt(np.diag(covariance))
    factor = 1.0 if _ellipsoidal(vector) else float(_any(vector, "coverageFactorXMLList", "coverageFactor"))
    rows = []
    for label, value, uncertainty, unit in zip(labels, values, factor * u, units, strict=True):
        rounded = round_result(value, float(uncertainty))
        rows.append(ValueRow(label, texts.number(rounded.estimate), texts.number(rounded.uncertainty), unit))
    correlation = covariance / np.outer(u, u)
    correlations = tuple(
        CorrelationRow(
            label,
            tuple(
                "1"
                if column == row
                else written_correlation(float(correlation[row, column]), texts.decimal_sign)
                for column in range(row + 1)
            ),
        )
        for row, label in enumerate(labels)
    )
    return tuple(rows), _coverage(vector, "XMLList", texts), correlations


def _ellipsoidal(parent: ET.Element) -> bool:
    tags = ("ellipsoidalRegionMUXMLList", "ellipsoidalRegionXMLList")
    return any(parent.find(f".//si:{tag}", _SPACES) is not None for tag in tags)


def _covariance(vector: ET.Element) -> Array:
    """The covariance matrix: columns of elements, in both releases."""
    columns = vector.findall(".//si:columnXMLList", _SPACES) or vector.findall(".//si:column", _SPACES)
    return np.array(
        [[float(_any(element, "valueXMLList", "value")) for element in column] for column in columns]
    ).T


def _coverage(quantity: ET.Element, suffix: str, texts: Texts) -> str:
    sign = texts.decimal_sign
    factor = float(_any(quantity, f"coverageFactor{suffix}", "coverageFactor"))
    p = float(_any(quantity, f"coverageProbability{suffix}", "coverageProbability"))
    return texts("dcc_page.coverage", k=written_factor(factor, sign), p=texts.number(decimal_of(p)))


def _element(parent: ET.Element, path: str) -> ET.Element:
    element = parent.find(path, _SPACES)
    assert element is not None  # both schemas ask for it
    return element


def _text(parent: ET.Element, path: str) -> str:
    return (parent.findtext(path, "", _SPACES) or "").strip()


def _any(parent: ET.Element, *tags: str) -> str:
    """The text of the first of these elements of D-SI that is there, at any depth."""
    return next(text for tag in tags if (text := _text(parent, f".//si:{tag}")))


def _contents(parent: ET.Element, path: str) -> list[str]:
    return [str(content.text) for content in parent.iterfind(f"{path}/dcc:content", _SPACES)]


def _said(parent: ET.Element, path: str) -> str:
    return " ".join(_contents(parent, path))
