"""The results inside a Digital Calibration Certificate: method, standards, conditions, and the values with them."""

from __future__ import annotations

from datetime import date
from xml.etree import ElementTree as ET

from monitor.reporting.certificate.behind import behind_sentences
from monitor.reporting.certificate.dcc_elements import DccVersion, add, say, version_of
from monitor.reporting.certificate.dsi import expanded_uncertainty, joint_values, real, standard_uncertainty
from monitor.reporting.certificate.model_effect import ModelEffect
from monitor.reporting.certificate.model_effects import place_in_words
from monitor.reporting.certificate.record import CertificateRecord, Condition, NotApplicable
from monitor.reporting.certificate.results import ResultSet
from monitor.reporting.certificate.volumetric import printed_map
from monitor.reporting.certificate.volumetric_result import VolumetricResult
from monitor.reporting.certificate.words import answer
from monitor.reporting.refused import why_refused
from monitor.reporting.symbols import describe
from monitor.reporting.texts import Texts

#: Coverage factor of the expanded uncertainty that a laboratory states of a temperature (docs of its file).
_STATED_K = 2.0
#: Probability of a normal law within two standard deviations.
_P_OF_STATED_K = 0.9545


def geometric_errors(parent: ET.Element, record: CertificateRecord, result: ResultSet, texts: Texts) -> None:
    """The parameters twice, with the ellipsoidal and with the rectangular region, each with the full covariance."""
    version = version_of(record)
    say(parent, "name", texts("dcc.result", state=result.state), texts.language)
    sentences = () if result.budget is None else behind_sentences(result, result.budget, texts)
    said = [result.evaluation, *sentences]
    # Sentences bring their full stops; 3.2.1 was released here with two behind some.
    evaluation = (
        " ".join(f"{sentence.rstrip('.')}." for sentence in said)
        if version.by_vocabulary
        else ". ".join(said)
    )
    results = _results(parent, record, evaluation, texts, result.state)
    regions = (
        ("ellipsoidal", result.k_p, result.k_p_error > 0.0),
        ("rectangular", result.k_q, result.k_q_error > 0.0),
    )
    for region, factor, sampled in regions if result.has_ellipsoid else regions[1:]:
        element = add(results, "result")
        say(element, "name", texts(f"dcc.{region}"), texts.language)
        say(element, "description", texts(f"dcc.{region}_words", rank=result.rank), texts.language)
        quantity = add(add(element, "data"), "quantity", ref="basic_measuredValue")
        say(quantity, "name", "; ".join(result.descriptions), texts.language)
        joint_values(quantity, result, region, factor, sampled, version)
    for refusal in result.refused:
        element = add(results, "result")
        say(element, "name", texts("dcc.refused", parameters=", ".join(refusal.parameters)), texts.language)
        say(add(element, "data"), "text", why_refused(refusal, texts), texts.language)
    for effect in result.effects or ():
        _model_effect(results, effect, version, texts)


def _kind(effect: ModelEffect) -> str:
    """The text of what an effect with a value is: among the results or beside them, of all runs or of one."""
    if effect.joint:
        return "page.effects_joint_of_run" if effect.of_one_run else "page.effects_joint"
    return "page.effects_of_run" if effect.of_one_run else "page.effects_explained"


def _model_effect(parent: ET.Element, effect: ModelEffect, version: DccVersion, texts: Texts) -> None:
    """An effect that was added to the model, with its own standard uncertainty; a play with its reversal value too."""
    description = describe(effect.name, texts)
    if effect.value is None or effect.u is None:
        element = add(parent, "result")
        say(element, "name", texts("dcc.effect", name=effect.name, words=description), texts.language)
        say(add(element, "data"), "text", texts("page.effects_unknown", effects=effect.name), texts.language)
        return
    explained = texts(
        _kind(effect),
        effects=effect.name,
        runs=effect.runs,
        days=effect.days,
    )
    if effect.outside is not None:
        explained += " " + texts(f"page.outside_{effect.outside.value}")
    if effect.lies is not None:
        explained += " " + place_in_words(effect.name, effect.lies, texts)
        if effect.joint:
            element = add(parent, "result")
            say(element, "name", texts("dcc.effect", name=effect.name, words=description), texts.language)
            say(add(element, "data"), "text", explained, texts.language)
    # One that is among the results is there with its value and the covariance.
    values = [] if effect.joint else [(description, effect.value, effect.u)]
    if effect.reversal_value is not None and effect.u_reversal is not None:
        values.append((texts("page.effect_reversal"), effect.reversal_value, effect.u_reversal))
    for meaning, value, u in values:
        element = add(parent, "result")
        say(element, "name", texts("dcc.effect", name=effect.name, words=meaning), texts.language)
        say(element, "description", explained, texts.language)
        quantity = real(add(add(element, "data"), "quantity", ref="basic_measuredValue"), value, effect.unit)
        if version is DccVersion.V3_2_1:
            # D-SI 2.1 has no place for a standard uncertainty.
            expanded_uncertainty(quantity, _STATED_K * u, _STATED_K, _P_OF_STATED_K, version)
        else:
            standard_uncertainty(quantity, u)


def volumetric_error(
    parent: ET.Element, record: CertificateRecord, volumetric: VolumetricResult, texts: Texts
) -> None:
    """The largest, mean and RMS volumetric error of the region, each with its own expanded uncertainty."""
    say(parent, "name", texts("dcc.map", state=volumetric.state), texts.language)
    printed = printed_map(volumetric, texts)
    results = _results(parent, record, printed.explained, texts, volumetric.state)
    for length, (name, where, *_) in zip(
        (volumetric.largest, volumetric.rms, volumetric.mean), printed.rows, strict=True
    ):
        element = add(results, "result")
        say(element, "name", name, texts.language)
        say(element, "description", where, texts.language)
        quantity = add(add(element, "data"), "quantity", ref="basic_measuredValue")
        value = real(quantity, length.value_um, "µm")
        expanded_uncertainty(value, length.expanded_um, volumetric.k, volumetric.p, version_of(record))


def _results(
    parent: ET.Element, record: CertificateRecord, evaluation: str, texts: Texts, state: str
) -> ET.Element:
    """Method, standards and conditions of a measurement result, and the element that its results go into."""
    assert record.method is not None  # complete: dcc_xml has checked it
    version = version_of(record)
    methods = add(parent, "usedMethods")
    method = add(methods, "usedMethod", ref="basic_calibrationMethod")
    say(method, "name", str(record.method.name), texts.language)
    # Before the vocabulary there was one place for both, how it was calibrated and how the uncertainty was evaluated.
    parts = [str(record.method.document), texts("dcc.model", model=record.method.model)]
    if version.by_vocabulary:
        say(method, "description", "; ".join(parts), texts.language)
        uncertainty = add(methods, "usedMethod", ref="basic_methodMeasurementUncertainty")
        say(uncertainty, "name", texts("dcc.uncertainty"), texts.language)
        say(uncertainty, "description", evaluation, texts.language)
        _standards(parent, record, texts)
    else:
        say(method, "description", "; ".join([*parts, evaluation]), texts.language)
    _conditions(parent, record, texts, state)
    return add(parent, "results")


def _standards(parent: ET.Element, record: CertificateRecord, texts: Texts) -> None:
    """The standards that carry the traceability, with their certificates in words."""
    language = texts.language
    equipments = add(parent, "measuringEquipments")
    for reference in record.references or ():
        equipment = add(equipments, "measuringEquipment", ref="basic_measurementStandard")
        say(equipment, "name", reference.name, language)
        say(equipment, "description", answer(reference.certificate, texts), language)
    for standard in record.standards or ():
        equipment = add(equipments, "measuringEquipment", ref="basic_measurementStandard")
        say(equipment, "name", str(standard.name), language)
        certificate = texts(
            "dcc.certificate",
            certificate=standard.certificate,
            issuer=standard.issuer,
            day="" if standard.issued_on is None else texts.day(standard.issued_on),
            valid=_valid_until(standard.valid_until, texts),
        )
        say(equipment, "description", certificate, language)
        identification = add(add(equipment, "identifications"), "identification")
        add(identification, "issuer", "other")
        add(identification, "value", standard.identification)


def _valid_until(day: date | NotApplicable | None, texts: Texts) -> str:
    return texts.day(day) if isinstance(day, date) else answer(day, texts)


def _conditions(parent: ET.Element, record: CertificateRecord, texts: Texts, state: str) -> None:
    """The conditions under which the results of a state hold; by number where they were measured."""
    version = version_of(record)
    conditions = add(parent, "influenceConditions")
    if not version.by_vocabulary:
        for condition in record.conditions or ():
            element = add(conditions, "influenceCondition")
            say(element, "name", condition.name, texts.language)
            say(add(element, "data"), "text", str(condition.value), texts.language)
        return
    status = _status(record, texts, state)
    element = add(conditions, "influenceCondition")
    say(element, "name", texts("dcc.state"), texts.language)
    _add_status(element, status)
    say(add(element, "data"), "text", state, texts.language)
    for condition in record.conditions or ():
        if condition.state in (None, state):
            _condition(conditions, condition, texts, status if condition.state == state else None)


def _condition(parent: ET.Element, condition: Condition, texts: Texts, status: str | None) -> None:
    measured = condition.measured
    element = add(parent, "influenceCondition", ref=None if measured is None else _ref(measured.column))
    say(element, "name", condition.name, texts.language)
    _add_status(element, status)
    content = add(element, "data")
    if measured is None:
        say(content, "text", str(condition.value), texts.language)
        return
    quantity = add(content, "quantity", ref="basic_measuredValue")
    say(quantity, "name", condition.name, texts.language)
    value = real(quantity, measured.value, measured.unit)
    if measured.expanded is not None:
        standard_uncertainty(value, measured.expanded / _STATED_K)


def _add_status(element: ET.Element, status: str | None) -> None:
    if status is not None:
        add(element, "status", status)


def _status(record: CertificateRecord, texts: Texts, state: str) -> str | None:
    """The schema's word for a state of the machine; None where nothing was adjusted between two states."""
    as_left = texts("record.as_left")
    if all(result.state != as_left for result in record.results or ()):
        return None
    return "afterAdjustment" if state == as_left else "beforeAdjustment"


def _ref(column: str) -> str | None:
    """The refType of a condition by the name of its column; the vocabulary has none for a pressure."""
    if column.endswith("_degC"):
        return "basic_temperature"
    return "basic_humidityRelative" if column == "humidity_percent" else None
