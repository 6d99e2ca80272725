"""A typed record becomes JSON and is restored from it, whatever its fields are."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, date, datetime
from enum import Enum

import numpy as np
import numpy.typing as npt
import pytest

from monitor.documents import IN_UTC, INLINED, OMITTED, from_document, named, to_document
from monitor.exceptions import StoreError


class _Verdict(Enum):
    PASSED = "passed"
    FAILED = "not passed"


@dataclass(frozen=True)
class _Slope:
    slope_per_year: float
    p_value: float | None


@dataclass(frozen=True)
class _Estimate:
    value: float
    unit: str
    searched: _Slope | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class _Answer:
    begin: date = field(metadata=named("from"))
    at: datetime
    verdict: _Verdict
    parameters: Mapping[str, _Estimate]
    matrix: npt.NDArray[np.float64]
    runs: tuple[int, ...]
    slope: _Slope = field(metadata=INLINED)
    why: str | None = None


def _answer() -> _Answer:
    return _Answer(
        date(2026, 3, 2), datetime(2026, 3, 2, 8, 37, 6, 421766, UTC), _Verdict.FAILED,
        {"EXX": _Estimate(1 / 3, "µm/m"), "EYY": _Estimate(math.nan, "µm/m", _Slope(0.1, None))},
        np.array([[1.0, 2 / 3], [0.1, 5e-324]]), (1, 2), _Slope(7.5, 0.03),
    )  # fmt: skip


def test_keys_marks_and_values_of_a_document() -> None:
    document = to_document(_answer())
    assert list(document) == [
        "from", "at", "verdict", "parameters", "matrix", "runs", "slope_per_year", "p_value", "why"
    ]  # fmt: skip
    assert document["from"] == "2026-03-02"
    assert document["verdict"] == "not passed"
    assert document["parameters"]["EXX"] == {"value": 1 / 3, "unit": "µm/m"}
    assert document["parameters"]["EYY"]["value"] is None
    assert document["runs"] == [1, 2]


def test_a_record_is_restored_from_its_json_to_the_last_bit() -> None:
    answer = _answer()
    again = from_document(_Answer, json.loads(json.dumps(to_document(answer), allow_nan=False)))
    assert to_document(again) == to_document(answer)
    assert again.at == answer.at
    assert again.verdict is _Verdict.FAILED
    assert again.slope == answer.slope
    assert again.parameters["EXX"] == answer.parameters["EXX"]
    assert math.isnan(again.parameters["EYY"].value)
    assert again.parameters["EYY"].searched == _Slope(0.1, None)
    assert np.array_equal(again.matrix, answer.matrix)


def test_a_document_that_lacks_a_field_is_refused_by_its_key() -> None:
    document = to_document(_answer())
    del document["from"], document["slope_per_year"]
    with pytest.raises(StoreError, match=r"the stored _Answer lacks slope_per_year"):
        from_document(_Answer, document)
    document["slope_per_year"] = 1.0
    with pytest.raises(StoreError, match=r"the stored _Answer lacks from: it was written by another version"):
        from_document(_Answer, document)


@dataclass(frozen=True)
class _Step:
    parameter: str
    size: float


@dataclass(frozen=True)
class _Move:
    target: str
    size: float


@dataclass(frozen=True)
class _Changes:
    changes: tuple[_Step | _Move, ...]


def test_an_alternative_is_recognised_by_its_keys() -> None:
    changes = _Changes((_Move("S1", 2.0), _Step("EB0C", 15.1)))
    assert from_document(_Changes, to_document(changes)) == changes
    with pytest.raises(StoreError, match=r"the stored _Changes.changes has colour, size"):
        from_document(_Changes, {"changes": [{"colour": "red", "size": 1.0}]})


@dataclass(frozen=True)
class _Moment:
    at: datetime | None = field(metadata=IN_UTC)
    local: datetime


def test_a_moment_in_utc_is_written_with_z_and_a_local_one_without() -> None:
    moment = _Moment(datetime(2026, 3, 2, 14, 0), datetime(2026, 3, 2, 9, 0))
    document = to_document(moment)
    assert document == {"at": "2026-03-02T14:00:00Z", "local": "2026-03-02T09:00:00"}
    assert from_document(_Moment, document) == moment
    assert to_document(_Moment(None, datetime(2026, 3, 2)))["at"] is None


@dataclass(frozen=True)
class _Length:
    rms: float


@dataclass(frozen=True)
class _Response:
    rms: float
    unit: str


@dataclass(frozen=True)
class _Angle:
    angle: Mapping[str, float] = field(metadata=INLINED)
    residual: _Response | _Length = field(metadata=INLINED)
    seconds: float


@pytest.mark.parametrize("residual", [_Length(0.5), _Response(0.5, "mm")])
def test_alternatives_and_mappings_are_inlined_and_restored(residual: _Length | _Response) -> None:
    answer = _Angle({"c_deg": 30.0}, residual, 12.0)
    document = to_document(answer)
    assert list(document) == [
        "c_deg",
        "rms",
        *(["unit"] if isinstance(residual, _Response) else []),
        "seconds",
    ]
    assert from_document(_Angle, document) == answer
