"""PTB's dccQuantities and dcc-json-toolkit, which share no code with ours, validate our certificates and return our
numbers.

`make dcc-reader` installs them in an environment of its own, .venv-dcc-ptb, with Mono; without one these are skipped.
"""

from __future__ import annotations

import dataclasses
import json
import math
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from monitor.reporting.certificate.dcc import dcc_xml
from monitor.reporting.certificate.record import CertificateRecord

ROOT = Path(__file__).resolve().parents[2]
READER = ROOT / ".venv-dcc-ptb" / "bin" / "python"

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not READER.exists(), reason="dccQuantities is installed by `make dcc-reader`"),
]


def read(content: bytes, folder: Path) -> dict[str, Any]:
    """What PTB's readers say of a certificate."""
    file = folder / "certificate.xml"
    file.write_bytes(content)
    script = Path(__file__).with_name("read_by_dcc_quantities.py")
    schemas = ROOT / "tests" / "references" / "dcc"
    done = subprocess.run([READER, script, file, schemas], check=True, capture_output=True, text=True)
    return dict(json.loads(done.stdout))


def record_of(make_record: Callable[..., CertificateRecord], language: str) -> CertificateRecord:
    record = make_record(13, language=language, maps=1)
    return dataclasses.replace(record, country="DE", dcc_version="3.3.0")


@pytest.mark.parametrize("language", ["en", "de"])
def test_dcc_quantities_returns_every_number(
    make_record: Callable[..., CertificateRecord], language: str, tmp_path: Path
) -> None:
    record = record_of(make_record, language)
    said = read(dcc_xml(record), tmp_path)
    assert said["faults"] == []
    assert record.results is not None
    (result,) = record.results
    vectors = [quantity for quantity in said["quantities"] if len(quantity["values"]) == 13]
    assert len(vectors) == 2
    for vector, region in zip(vectors, ("ellipsoidal", "rectangular"), strict=True):
        assert vector["values"] == result.estimate.tolist()
        stated = vector["stated"]
        univariate = stated["si:measurementUncertaintyUnivariateXMLList"]["si:standardMUXMLList"]
        assert univariate["si:valueStandardMUXMLList"] == np.sqrt(np.diag(result.covariance)).tolist()
        around = stated["si:measurementUncertaintyMultivariateXMLList"][f"si:{region}RegionMUXMLList"]
        columns = around["si:covarianceMatrixXMLList"]["si:columnXMLList"]
        covariance = [
            [float(np.ravel(element["si:valueXMLList"])[0]) for element in column["si:covarianceXMLList"]]
            for column in columns
        ]
        assert np.array_equal(np.array(covariance).T, result.covariance)
    # The expanded uncertainties of the volumetric error, as standard ones, which .NET divided by k.
    (volumetric,) = record.volumetric
    lengths = [quantity for quantity in said["quantities"] if not math.isnan(quantity["u"][0])]
    expected = [volumetric.largest, volumetric.rms, volumetric.mean]
    assert [quantity["values"] for quantity in lengths] == [[length.value_um] for length in expected]
    assert [quantity["u"] for quantity in lengths] == [
        [pytest.approx(length.expanded_um / volumetric.k, rel=1e-15)] for length in expected
    ]


def test_its_schema_finds_an_element_that_is_none(
    make_record: Callable[..., CertificateRecord], tmp_path: Path
) -> None:
    broken = dcc_xml(record_of(make_record, "en")).replace(b"standardMUXMLList>", b"standartMUXMLList>")
    assert len(read(broken, tmp_path)["faults"]) >= 2
