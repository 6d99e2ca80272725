"""DCC 3.3.0 with D-SI 2.2.1: what lxml reads back by XPath, with no code of the writer, is what the record holds."""

from __future__ import annotations

import dataclasses
import hashlib
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from by_path import load

from monitor.exceptions import InputError
from monitor.reporting.certificate.dcc import dcc_xml
from monitor.reporting.certificate.dcc_page import dcc_context
from monitor.reporting.certificate.dsi import unit_of, written_unit
from monitor.reporting.certificate.model_effect import ModelEffect
from monitor.reporting.certificate.record import CertificateRecord, Condition, MeasuredCondition
from monitor.reporting.certificate.tables import result_rows
from monitor.reporting.pdf.render import pieces_of
from monitor.reporting.texts import texts_of

etree = pytest.importorskip("lxml.etree", reason="lxml reads the file by XPath")

Make = Callable[..., CertificateRecord]
SPACES = {"d": "https://ptb.de/dcc", "s": "https://ptb.de/si"}
EXAMPLE = load("write_dcc", Path(__file__).resolve().parents[2] / "examples" / "write_dcc.py")
#: Of the example's file as the release before 3.3.0 wrote it: certificates of that time are made again from records.
SHA256_OF_3_2_1 = "ff3af9c3d56be7841fd2444ead887214a53e1c1f5cb345ccb7cf46c801720b42"
AMBIENT = Condition("ambient temperature", "21.4 °C", MeasuredCondition("ambient_degC", 21.4, "°C"))
MACHINE = Condition("machine", "20.6 °C", MeasuredCondition("machine_degC", 20.6, "°C", 0.2), "as left")


@pytest.fixture(scope="module")
def record(make_record: Make) -> CertificateRecord:
    """As found and as left, two parameters' worth of conditions, one of them of one state alone."""
    made = make_record(13, maps=1)
    assert made.results is not None
    as_left = dataclasses.replace(made.results[0], state="as left", estimate=made.results[0].estimate / 2)
    return dataclasses.replace(
        made,
        country="DE",
        dcc_version="3.3.0",
        results=(made.results[0], as_left),
        conditions=(*(made.conditions or ()), AMBIENT, MACHINE),
    )


@pytest.fixture(scope="module")
def tree(record: CertificateRecord) -> Any:
    return etree.fromstring(dcc_xml(record))


def numbers(element: Any, path: str) -> list[float]:
    return [
        float(number)
        for text in element.xpath(f"{path}/text()", namespaces=SPACES)
        for number in text.split()
    ]


@pytest.mark.parametrize(
    ("position", "region", "factor"), [(1, "ellipsoidal", "k_p"), (2, "rectangular", "k_q")]
)
@pytest.mark.parametrize("state", [0, 1])
def test_d_si_2_2_1_values_and_joint_covariance_to_the_last_bit(
    tree: Any, record: CertificateRecord, state: int, position: int, region: str, factor: str
) -> None:
    assert record.results is not None
    result = record.results[state]
    path = f"//d:measurementResult[{state + 1}]/d:results/d:result[{position}]//s:realListXMLList"
    (vector,) = tree.xpath(path, namespaces=SPACES)
    assert numbers(vector, "s:valueXMLList") == result.estimate.tolist()
    standard = "s:measurementUncertaintyUnivariateXMLList/s:standardMUXMLList/s:valueStandardMUXMLList"
    assert numbers(vector, standard) == np.sqrt(np.diag(result.covariance)).tolist()
    around = f"s:measurementUncertaintyMultivariateXMLList/s:{region}RegionMUXMLList"
    columns = vector.xpath(f"{around}/s:covarianceMatrixXMLList/s:columnXMLList", namespaces=SPACES)
    covariance = np.array([numbers(column, "s:covarianceXMLList/s:valueXMLList") for column in columns]).T
    assert np.array_equal(covariance, result.covariance)
    assert numbers(vector, f"{around}/s:coverageFactorXMLList") == [getattr(result, factor)]
    assert numbers(vector, f"{around}/s:coverageProbabilityXMLList") == [result.p]
    assert vector.xpath("s:labelXMLList/text()", namespaces=SPACES)[0].split() == list(result.names)
    deprecated = "//s:expandedUnc | //s:ellipsoidalRegionXMLList | //s:rectangularRegionXMLList"
    assert tree.xpath(deprecated, namespaces=SPACES) == []


def test_conditions_are_numbers_and_belong_to_their_state(tree: Any) -> None:
    status = "//d:measurementResult[{}]/d:influenceConditions/d:influenceCondition[d:status]/d:{}//text()"

    def said(place: int, what: str) -> list[str]:
        texts = tree.xpath(status.format(place, what), namespaces=SPACES)
        return [text.strip() for text in texts if text.strip()]

    assert said(1, "status") == ["beforeAdjustment"]
    assert said(2, "status") == ["afterAdjustment"] * 2
    assert said(1, "data") == ["as found"]
    measured = "//d:measurementResult[{}]//d:influenceCondition[@refType='basic_temperature']//s:real"
    (*_, ambient) = tree.xpath(measured.format(1), namespaces=SPACES)
    assert numbers(ambient, "s:value") == [21.4]
    assert ambient.xpath("s:unit/text()", namespaces=SPACES) == [r"\degreecelsius"]
    *_, machine = tree.xpath(measured.format(2), namespaces=SPACES)
    # The laboratory states U for k = 2.
    assert numbers(machine, "s:measurementUncertaintyUnivariate/s:standardMU/s:valueStandardMU") == [0.1]


def test_ref_types_are_of_the_vocabulary_that_the_file_names(tree: Any) -> None:
    used = {word for text in tree.xpath("//@refType") for word in text.split()}
    assert used == {
        "basic_calibrationMethod",
        "basic_methodMeasurementUncertainty",
        "basic_measurementStandard",
        "basic_measuredValue",
        "basic_metrologicallyTraceableToSI",
        "basic_temperature",
    }
    assert tree.xpath("//d:refTypeDefinition/d:namespace/text()", namespaces=SPACES) == ["basic"]


def test_a_record_without_a_release_is_written_as_before(record: CertificateRecord) -> None:
    old = dcc_xml(dataclasses.replace(EXAMPLE.RECORD, dcc_version=None))
    assert hashlib.sha256(old).hexdigest() == SHA256_OF_3_2_1
    assert old == dcc_xml(dataclasses.replace(EXAMPLE.RECORD, dcc_version="3.2.1"))
    with pytest.raises(InputError, match=r"no digital certificate after DCC 3\.4\.0.*3\.2\.1, 3\.3\.0"):
        dcc_xml(dataclasses.replace(record, dcc_version="3.4.0"))


@pytest.mark.parametrize("unit", ["µm", "µrad/m", "µm/m²", "µm/m/K", "°C", "%"])
def test_units_are_read_as_they_were_written(unit: str) -> None:
    assert written_unit(unit_of(unit)) == unit


@pytest.mark.parametrize("language", ["en", "de"])
@pytest.mark.parametrize("release", ["3.2.1", "3.3.0"])
def test_the_page_says_what_either_release_says(make_record: Make, language: str, release: str) -> None:
    made = dataclasses.replace(make_record(13, language=language, maps=1), country="DE", dcc_version=release)
    context = dcc_context(dcc_xml(made))
    assert made.results is not None
    (result,) = made.results
    ellipsoid, rectangle = context["measurements"][0].results[:2]
    assert [row.label for row in rectangle.rows] == list(result.names)
    assert [row.unit for row in rectangle.rows] == list(result.units)
    assert (ellipsoid.symbol, rectangle.symbol) == ("u", "U")
    # What the certificate prints, to the digit: the page said 1.4 where the PDF says 1.3.
    printed = result_rows(result, texts_of(language))
    for row, u_row, on_paper in zip(rectangle.rows, ellipsoid.rows, printed, strict=True):
        estimate, u, expanded = (number.text for number in on_paper.numbers)
        assert (row.value, row.uncertainty, u_row.uncertainty) == (estimate, expanded, u)
    html = "".join(pieces_of("dcc.html", context))
    assert f"(PTB DCC {release})" in html
    assert str(made.relates_only) in html


@pytest.mark.parametrize("release", ["3.2.1", "3.3.0"])
def test_the_page_states_the_reversal_value_of_an_effect(make_record: Make, release: str) -> None:
    """A standard uncertainty alone, which release 3.3.0 has of effects of the model, ended the page."""
    made = dataclasses.replace(make_record(13), country="DE", dcc_version=release)
    assert made.results is not None
    effects = (ModelEffect("EXX:reversal", "µm", 5.85, 0.098, 6, 2, 11.7, 0.196),)
    made = dataclasses.replace(made, results=(dataclasses.replace(made.results[0], effects=effects),))
    results = dcc_context(dcc_xml(made))["measurements"][0].results
    stated = [result for result in results if "EXX:reversal" in result.name]
    (amplitude,), (reversal,) = (result.rows for result in stated)
    shown = [(row.value, row.uncertainty, row.unit) for row in (amplitude, reversal)]
    if release == "3.3.0":
        assert [result.symbol for result in stated] == ["u", "u"]
        assert shown == [("5.850", "0.098", "µm"), ("11.70", "0.20", "µm")]
        assert not any(result.coverage for result in stated)
    else:
        assert [result.symbol for result in stated] == ["U", "U"]
        assert shown == [("5.85", "0.20", "µm"), ("11.70", "0.39", "µm")]
        assert all(re.search(r"\b2(\.0+)?\b", result.coverage) for result in stated)
