"""PyDCC (Siemens and PTB, MIT), which shares no code with ours, reads our digital certificates and returns our numbers.

`make dcc-reader` installs it in an environment of its own, .venv-dcc; without one these tests are skipped.
"""

from __future__ import annotations

import dataclasses
import json
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from monitor.reporting.certificate.dcc import dcc_xml
from monitor.reporting.certificate.record import CertificateRecord

ROOT = Path(__file__).resolve().parents[2]
READER = ROOT / ".venv-dcc" / "bin" / "python"

pytestmark = pytest.mark.skipif(not READER.exists(), reason="PyDCC is installed by `make dcc-reader`")


def read(record: CertificateRecord, folder: Path) -> dict[str, Any]:
    """What PyDCC reads of a certificate."""
    file = folder / "certificate.xml"
    file.write_bytes(dcc_xml(record))
    script = Path(__file__).with_name("read_by_pydcc.py")
    done = subprocess.run([READER, script, file], check=True, capture_output=True, text=True)
    return dict(json.loads(done.stdout))


def texts_under(node: object, name: str) -> Iterator[str]:
    """The texts of every element of a name in PyDCC's dictionaries, in their order."""
    if isinstance(node, dict):
        for key, value in node.items():
            if key == name:
                yield from (str(item) for item in (value if isinstance(value, list) else [value]))
            else:
                yield from texts_under(value, name)
    elif isinstance(node, list):
        for item in node:
            yield from texts_under(item, name)


@pytest.mark.parametrize("release", ["3.2.1", "3.3.0"])
@pytest.mark.parametrize("language", ["en", "de"])
def test_pydcc_reads_the_administrative_data_and_every_estimate(
    make_record: Callable[..., CertificateRecord], release: str, language: str, tmp_path: Path
) -> None:
    record = dataclasses.replace(make_record(13, language=language), country="DE", dcc_version=release)
    said = read(record, tmp_path)
    assert record.results is not None
    assert record.laboratory is not None
    assert record.performed_on is not None
    assert said["number"] == record.number
    assert said["version"] == release
    assert said["language"] == language
    assert said["laboratory"] == record.laboratory.name
    assert not said["replaces"]
    results = [result for _, result in said["results"]]
    vectors = [
        np.array(text.split(), float)
        for result in results
        for text in texts_under(result, "valueXMLList")
        if len(text.split()) == 13
    ]
    estimate = record.results[0].estimate
    assert any(np.array_equal(vector, estimate) for vector in vectors)


def test_pydcc_reads_every_covariance_to_the_last_bit(
    make_record: Callable[..., CertificateRecord], tmp_path: Path
) -> None:
    record = dataclasses.replace(make_record(13), country="DE")
    said = read(record, tmp_path)
    assert record.results is not None
    covariance = record.results[0].covariance.reshape(-1)
    numbers = [float(text) for _, result in said["results"] for text in texts_under(result, "value")]
    runs = [numbers[at : at + 169] for at in range(len(numbers) - 168) if numbers[at] == covariance[0]]
    assert any(np.array_equal(run, covariance) for run in runs)
