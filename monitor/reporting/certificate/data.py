"""The data of a certificate as files that travel inside its PDF: what is printed, at full precision, for machines."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from monitor.documents import to_document
from monitor.reporting.certificate.dcc import dcc_xml
from monitor.reporting.certificate.machine_frame_result import MachineFrameResult
from monitor.reporting.certificate.record import CertificateRecord
from monitor.reporting.certificate.results import ResultSet
from monitor.reporting.certificate.volumetric import POINTS_FILE
from monitor.reporting.certificate.volumetric_result import VolumetricResult
from monitor.reporting.frames import sum_words
from monitor.reporting.texts import texts_of


@dataclass(frozen=True)
class Attached:
    """A file inside a PDF; ``relationship`` to the page as ISO 32000-2:2020, 14.13 (table 43) names it."""

    name: str
    content: bytes
    description: str
    relationship: Literal["Data", "Source", "Alternative"]


def certificate_files(
    record: CertificateRecord,
    inputs: Mapping[str, Any] | None = None,
    document: Mapping[str, Any] | None = None,
) -> tuple[Attached, ...]:
    """The whole record as JSON; for every result set the estimates and the covariance as CSV, for every map its points.

    A record that names the laboratory's country has its digital calibration certificate beside them. ``inputs``
    say what the results were computed from (hashes of the raw files, model, software); ``document`` is the record as it
    was stored, where it is not to be written anew.
    """
    texts = texts_of(record.language)
    whole = {
        "certificate": to_document(record) if document is None else document,
        "inputs": dict(inputs or {}),
    }
    text = json.dumps(whole, ensure_ascii=False, allow_nan=False, indent=1)
    files = [Attached("certificate.json", text.encode(), texts("files.record"), "Source")]
    if record.country is not None:
        files.append(Attached("certificate.dcc.xml", dcc_xml(record), texts("files.dcc"), "Alternative"))
    for number, result in enumerate(record.results or (), start=1):
        description = texts("files.results", state=result.state)
        files.append(Attached(f"results-{number}.csv", _estimates(result), description, "Data"))
        description = texts("files.covariance", state=result.state)
        files.append(Attached(f"covariance-{number}.csv", _covariance(result), description, "Data"))
        if result.machine_frame is not None and result.machine_frame.names:
            description = texts("files.machine_frame", state=result.state)
            content = _machine_frame(result.machine_frame)
            files.append(Attached(f"machine-frame-{number}.csv", content, description, "Data"))
    for number, volumetric in enumerate(record.volumetric, start=1):
        description = texts("files.map", state=volumetric.state)
        files.append(Attached(POINTS_FILE.format(place=number), _points(volumetric), description, "Data"))
    return tuple(files)


def _points(volumetric: VolumetricResult) -> bytes:
    head = [f"{axis}_mm" for axis in volumetric.axes] + [
        "error_x_um",
        "error_y_um",
        "error_z_um",
        "expanded_um",
    ]
    numbers = np.column_stack([volumetric.readings_mm, volumetric.vectors_um, volumetric.expanded_um])
    return _table([head, *([repr(float(number)) for number in row] for row in numbers)])


def _estimates(result: ResultSet) -> bytes:
    limits = np.full(len(result.names), np.nan) if result.tolerances is None else result.tolerances
    rows = [
        [name, description, unit, *(repr(float(number)) for number in (value, u, expanded)), _limit(limit)]
        for name, description, unit, value, u, expanded, limit in zip(
            result.names, result.descriptions, result.units, result.estimate, result.u, result.expanded, limits,
            strict=True,
        )
    ]  # fmt: skip
    head = [
        "parameter",
        "description",
        "unit",
        "estimate",
        "standard_uncertainty",
        "expanded_uncertainty",
        "tolerance",
    ]
    return _table([head, *rows])


def _machine_frame(result: MachineFrameResult) -> bytes:
    """Location errors in the machine frame: estimate, standard uncertainty, covariance as in the covariance matrix."""
    head = ["parameter", "sum_of", "unit", "estimate", "standard_uncertainty"]
    rows = [
        [
            name,
            sum_words(result.sums[name]),
            unit,
            *(repr(float(number)) for number in (value, u, *covariance)),
        ]
        for name, unit, value, u, covariance in zip(
            result.names, result.units, result.estimate, result.u, result.covariance, strict=True
        )
    ]
    return _table([[*head, *(f"covariance_{name}" for name in result.names)], *rows])


def _limit(limit: float) -> str:
    return "" if np.isnan(limit) else repr(float(limit))


def _covariance(result: ResultSet) -> bytes:
    """The unit of an element is the product of the units of its row and its column."""
    head = ["parameter", "unit", *result.names]
    rows = [
        [name, unit, *(repr(float(element)) for element in row)]
        for name, unit, row in zip(result.names, result.units, result.covariance, strict=True)
    ]
    return _table([head, *rows])


def _table(rows: list[list[str]]) -> bytes:
    out = io.StringIO()
    csv.writer(out, lineterminator="\r\n").writerows(rows)  # RFC 4180
    return out.getvalue().encode("utf-8")
