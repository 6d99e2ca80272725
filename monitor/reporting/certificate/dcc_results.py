"""The results inside a Digital Calibration Certificate: quantities in D-SI 2.1 with their joint uncertainty."""

from __future__ import annotations

import math
import re
from xml.etree import ElementTree as ET

import numpy as np

from monitor.exceptions import InputError
from monitor.reporting.certificate.behind import behind_sentences
from monitor.reporting.certificate.record import CertificateRecord
from monitor.reporting.certificate.results import ResultSet
from monitor.reporting.certificate.volumetric import printed_map
from monitor.reporting.certificate.volumetric_result import VolumetricResult
from monitor.reporting.refused import why_refused
from monitor.reporting.texts import Texts

DCC = "https://ptb.de/dcc"
SI = "https://ptb.de/si"

#: Display unit: the same in the notation of D-SI (PTB, SmartCom D-SI metadata model, 2.1).
_UNITS = {
    "µm": r"\micro\metre",
    "µrad": r"\micro\radian",
    "mm": r"\milli\metre",
    "m": r"\metre",
    "rad": r"\radian",
    "°": r"\degree",
    "K": r"\kelvin",
    "°C": r"\degreecelsius",
    "s": r"\second",
    "min": r"\minute",
    "h": r"\hour",
    "hPa": r"\hecto\pascal",
    "%": r"\percent",
    "1": r"\one",
}
_POWERS = {"²": "2", "³": "3", "⁴": "4", "⁵": "5", "⁶": "6", "⁷": "7", "⁸": "8", "⁹": "9"}


def unit_of(name: str) -> str:
    """A display unit such as ``µm/m²`` in the notation of D-SI. Raises InputError for one that has none here."""
    return r"\per".join(_power_of(factor, name) for factor in name.split("/"))


def _power_of(factor: str, name: str) -> str:
    stem, power = re.fullmatch(rf"(.*?)([{''.join(_POWERS)}]|\^[0-9])?", factor).groups()  # type: ignore[union-attr]
    if stem not in _UNITS:
        raise InputError(
            f"unit {name} has no D-SI notation here; there are {', '.join(_UNITS)}, their powers and quotients"
        )
    return _UNITS[stem] + ("" if power is None else rf"\tothe{{{_POWERS.get(power, power[-1])}}}")


def add(parent: ET.Element, tag: str, text: str | None = None, space: str = DCC) -> ET.Element:
    """A new last child with its text."""
    child = ET.SubElement(parent, f"{{{space}}}{tag}")
    child.text = text
    return child


def say(parent: ET.Element, tag: str, text: str, language: str) -> ET.Element:
    """An element whose text says in which language it is."""
    child = add(parent, tag)
    add(child, "content", text).set("lang", language)
    return child


def geometric_errors(parent: ET.Element, record: CertificateRecord, result: ResultSet, texts: Texts) -> None:
    """The parameters twice, with the ellipsoidal and with the rectangular region, each with the full covariance."""
    say(parent, "name", texts("dcc.result", state=result.state), texts.language)
    sentences = () if result.budget is None else behind_sentences(result, result.budget, texts)
    results = _results(parent, record, ". ".join([result.evaluation, *sentences]), texts)
    regions = (
        ("ellipsoidal", result.k_p, result.k_p_error > 0.0),
        ("rectangular", result.k_q, result.k_q_error > 0.0),
    )
    for region, factor, sampled in regions if result.has_ellipsoid else regions[1:]:
        element = add(results, "result")
        say(element, "name", texts(f"dcc.{region}"), texts.language)
        say(element, "description", texts(f"dcc.{region}_words", rank=result.rank), texts.language)
        quantity = add(add(element, "data"), "quantity")
        say(quantity, "name", "; ".join(result.descriptions), texts.language)
        _values(quantity, result, region, factor, sampled)
    for refusal in result.refused:
        element = add(results, "result")
        say(element, "name", texts("dcc.refused", parameters=", ".join(refusal.parameters)), texts.language)
        say(add(element, "data"), "text", why_refused(refusal, texts), texts.language)


def volumetric_error(
    parent: ET.Element, record: CertificateRecord, volumetric: VolumetricResult, texts: Texts
) -> None:
    """The largest, mean and RMS volumetric error of the region, each with its own expanded uncertainty."""
    say(parent, "name", texts("dcc.map", state=volumetric.state), texts.language)
    printed = printed_map(volumetric, texts)
    results = _results(parent, record, printed.explained, texts)
    for length, (name, where, _) in zip(
        (volumetric.largest, volumetric.rms, volumetric.mean), printed.rows, strict=True
    ):
        element = add(results, "result")
        say(element, "name", name, texts.language)
        say(element, "description", where, texts.language)
        quantity = add(add(element, "data"), "quantity")
        real = add(quantity, "real", space=SI)
        add(real, "value", _number(length.value_um), SI)
        add(real, "unit", unit_of("µm"), SI)
        around = add(real, "expandedUnc", space=SI)
        add(around, "uncertainty", _number(length.expanded_um), SI)
        add(around, "coverageFactor", _number(volumetric.k), SI)
        add(around, "coverageProbability", _number(volumetric.p), SI)


def _results(parent: ET.Element, record: CertificateRecord, evaluation: str, texts: Texts) -> ET.Element:
    """Method and conditions of a measurement result, and the element that its results go into."""
    assert record.method is not None  # complete: dcc_xml has checked it
    method = add(add(parent, "usedMethods"), "usedMethod")
    say(method, "name", str(record.method.name), texts.language)
    explanation = texts(
        "dcc.method", document=record.method.document, model=record.method.model, evaluation=evaluation
    )
    say(method, "description", explanation, texts.language)
    conditions = add(parent, "influenceConditions")
    for condition in record.conditions or ():
        element = add(conditions, "influenceCondition")
        say(element, "name", condition.name, texts.language)
        say(add(element, "data"), "text", str(condition.value), texts.language)
    return add(parent, "results")


def _values(parent: ET.Element, result: ResultSet, region: str, factor: float, sampled: bool) -> None:
    units = [unit_of(unit) for unit in result.units]
    values = add(parent, "realListXMLList", space=SI)
    add(values, "labelXMLList", " ".join(result.names), SI)
    add(values, "valueXMLList", " ".join(_number(float(value)) for value in result.estimate), SI)
    add(values, "unitXMLList", " ".join(units), SI)
    around = add(values, f"{region}RegionXMLList", space=SI)
    matrix = add(around, "covarianceMatrix", space=SI)
    for index, unit in enumerate(units):
        column = add(matrix, "column", space=SI)
        for other, second in enumerate(units):
            element = add(column, "covariance", space=SI)
            add(element, "value", _number(float(result.covariance[other, index])), SI)
            add(element, "unit", second + unit, SI)
    add(around, "coverageFactor", _number(factor), SI)
    add(around, "coverageProbability", _number(result.p), SI)
    add(around, "distribution", "numerical" if sampled else _distribution(result), SI)


def _distribution(result: ResultSet) -> str:
    """The law that the coverage factor is of: the t distribution where the covariance is known from few runs."""
    if math.isfinite(result.dof):
        return "t"
    return "normal" if result.trials is None else "numerical"


def _number(value: float) -> str:
    """The shortest decimal that means this double, as the schema writes exponents."""
    text = repr(float(np.float64(value)))
    return text.replace("e", "E").replace("E+", "E")
