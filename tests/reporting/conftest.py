"""A made-up laboratory, machine and result, from which every certificate test makes what it needs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import date, datetime

import numpy as np
import pytest
from by_path import simulator

from monitor.records import Artefact, Ball, Campaign, Machine, Probe, Probings, Run, ScaleBar
from monitor.reporting.certificate.assembly import CertificateIdentity, certificate_record
from monitor.reporting.certificate.laboratory import LaboratoryFile
from monitor.reporting.certificate.record import CertificateRecord, NotApplicable, Party, Person
from monitor.reporting.certificate.results import (
    CoverageFactors,
    JointEstimate,
    ResidualSummary,
    ResultSet,
    ResultStatements,
    result_set,
)
from monitor.reporting.certificate.volumetric_result import Length, VolumetricResult
from monitor.reporting.refused import RefusedParameters
from monitor.reporting.texts import texts_of
from monitor.units import METRE, MICROMETRE, MICRORADIAN

NAMES = list(simulator().SAMBA_PARAMETERS)
UNITS = [MICRORADIAN] * 2 + [MICROMETRE] + [MICRORADIAN] * 5 + [MICROMETRE] * 2 + [MICROMETRE.per(METRE)] * 3
#: Standard uncertainties in display units, of the size that docs/conventions.md gives for SAMBA.
U = np.array([1.9, 1.7, 0.28, 2.0, 1.7, 2.3, 2.7, 2.2, 0.33, 0.36, 6.2, 5.7, 6.3])


@pytest.fixture(scope="session")
def make_result() -> Callable[..., ResultSet]:
    """A result of m parameters with a full-rank correlation; those in ``refused`` have no number."""

    def make(m: int = 13, refused: tuple[RefusedParameters, ...] = (), language: str = "en") -> ResultSet:
        rng = np.random.default_rng(7)
        names = [NAMES[i] if i < 13 else f"EYX:table{i}@spindle_temperature_degC" for i in range(m)]
        units = [UNITS[i % 13] for i in range(m)]
        factor = np.array([unit.factor for unit in units])
        u = np.resize(U, m) * factor
        root = rng.normal(size=(m, m + 4))
        spread = root @ root.T
        scale = np.sqrt(np.diag(spread))
        estimate = rng.normal(size=m) * u * 6.0
        covariance = spread / np.outer(scale, scale) * np.outer(u, u)
        without = {name for refusal in refused for name in refusal.parameters}
        for place, name in enumerate(names):
            if name in without:
                estimate[place] = np.nan
                covariance[place, :] = covariance[:, place] = np.nan
        return result_set(
            JointEstimate(names, units, estimate, covariance),
            CoverageFactors(p=0.95, k_p=4.73, k_q=2.95, rank=m - len(without)),
            ResultStatements(
                state=texts_of(language)("record.as_found"),
                evaluation="GUM uncertainty framework (JCGM 102:2011, clause 6)",
                refused=refused,
                residuals=ResidualSummary("target", ("1", "2", "S1"), (1.12, 0.93, 2.41), 1.0),
            ),
            texts_of(language),
        )

    return make


def _map(language: str) -> VolumetricResult:
    """A volumetric error that grows from the middle of the strokes, where the workpiece's zero was set."""
    steps = np.linspace(-1.0, 1.0, 5)
    cube = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    vectors = cube @ np.array([[9.0, -3.0, 0.5], [2.0, 12.0, 0.0], [1.0, 4.0, -7.0]])
    lengths = np.linalg.norm(vectors, axis=1)
    corner = (("X", -250.0, "mm"), ("B", -90.0, "°"), ("Y", 200.0, "mm"), ("Z", 180.0, "mm"))
    return VolumetricResult(
        state=texts_of(language)("record.as_found"),
        p=0.95,
        k=2.13,
        ranges=(("X", -250.0, 250.0), ("Y", -200.0, 200.0), ("Z", -180.0, 180.0)),
        from_strokes=True,
        each=5,
        poses=12,
        points=1500,
        datum=(("X", 0.0, "mm"), ("Y", 0.0, "mm"), ("Z", 0.0, "mm")),
        largest=Length(41.27, 1.06, 2.26, corner),
        mean=Length(12.4, 0.8, 1.7),
        rms=Length(15.1, 0.77, 1.64),
        left_out=(("EXX", "the plan does not determine it"),),
        axes=("X", "Y", "Z"),
        readings_mm=cube * np.array([250.0, 200.0, 180.0]),
        vectors_um=vectors,
        expanded_um=0.8 + 0.05 * lengths,
    )


@pytest.fixture(scope="session")
def laboratory() -> LaboratoryFile:
    """Answers to everything that a laboratory is asked."""
    return LaboratoryFile(
        laboratory=Party("Made-up Laboratory", ("1 Example Road", "Nowhere"), "lab@example.org"),
        customer=Party("Made-up Customer", ("2 Example Street",), "customer@example.org"),
        accreditation=None,
        item_description=None,
        item_identification=None,
        item_condition="in working order",
        place="hall 1",
        received_on=NotApplicable("calibrated where it stands"),
        method_document="procedure 1",
        traceability="The unit of length comes from the bar.",
        probe=NotApplicable("null indicator"),
        scale_bar=None,
        title="Calibration certificate",
        sampling=NotApplicable("no sampling"),
        relates_only="The results relate only to the item calibrated.",
        deviations="None.",
        external_results="None.",
        reproduction="Not to be reproduced except in full.",
        adjustment="No adjustment took place.",
        conformity=NotApplicable("not asked for"),
        opinions=NotApplicable("none"),
        authorised_by=(Person("A. Example", "head of laboratory"),),
    )


@pytest.fixture(scope="session")
def campaign() -> Campaign:
    """One run of 62 probings on a machine without a serial number; the probe has no certificate."""
    start = datetime.fromisoformat("2026-03-02T08:37:06.421766-05:00")
    count = 62
    return Campaign(
        "five-days",
        "samba",
        Machine("HU40-T", "w C B X b Z Y (C1) t", "Mitsui Seiki", "HU40-T"),
        Probe("probe-1", "touch-trigger probe", 1e-3),
        Artefact(
            "four balls and a scale bar",
            tuple(Ball(name, (0.0, 0.0, 0.0), 19.05) for name in ("1", "2", "3", "4", "S1", "S2")),
            ScaleBar(("S1", "S2"), 304.98923, 0.0012, "bar certificate 2016-04"),
        ),
        (Run(1, start, 1, False, {"ambient_degC": 22.08}),),
        Probings(
            np.ones(count, dtype=np.int64),
            np.arange(count, dtype=np.int64),
            np.zeros(count),
            np.full(count, "1"),
            {},
        ),
    )


@pytest.fixture(scope="session")
def make_record(
    make_result: Callable[..., ResultSet], laboratory: LaboratoryFile, campaign: Campaign
) -> Callable[..., CertificateRecord]:
    """A complete record over a result of m parameters, in a language, with so many maps of the volumetric error."""

    def make(
        m: int = 13, refused: tuple[RefusedParameters, ...] = (), language: str = "en", maps: int = 0
    ) -> CertificateRecord:
        return certificate_record(
            replace(laboratory, language=language),
            campaign,
            1,
            [make_result(m, refused, language)],
            CertificateIdentity("K-2026-0042", date(2026, 3, 3), "samba, version 1"),
            [_map(language)] * maps,
        )

    return make
