"""Stored records of certificates, restored with their types."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from monitor.documents import from_document
from monitor.reporting.certificate.record import CertificateRecord
from monitor.reporting.certificate.results import ResultSet
from monitor.reporting.certificate.volumetric_result import VolumetricResult
from monitor.reporting.refused import RefusedParameters, refusal_of
from monitor.workflow.uncertainty.sentences_0_1_0 import with_reason


def restored_record(document: Mapping[str, Any]) -> CertificateRecord:
    """Restore a stored record, the reasons of refusals that version 0.1.0 stored as sentences among it.

    Raises StoreError where it was written by another version or altered.
    """
    record = from_document(CertificateRecord, document)
    results = None if record.results is None else tuple(map(_with_reasons, record.results))
    groups = {refused.why: refused for result in results or () for refused in result.refused}
    volumetric = tuple(_with_refusals(error_map, groups) for error_map in record.volumetric)
    return replace(record, results=results, volumetric=volumetric)


def _with_reasons(result: ResultSet) -> ResultSet:
    return replace(result, refused=tuple(map(with_reason, result.refused)))


def _with_refusals(error_map: VolumetricResult, groups: Mapping[str, RefusedParameters]) -> VolumetricResult:
    """A map named only one parameter of a refusal; the others of its group are among those of the results."""
    if error_map.left_out_refusals:
        return error_map
    refused = [
        groups.get(why) or with_reason(RefusedParameters((name,), why)) for name, why in error_map.left_out
    ]
    return replace(error_map, left_out_refusals=tuple(map(refusal_of, refused)))
