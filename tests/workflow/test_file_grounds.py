"""A certificate of nominal values in place of readings, or of rows that are late, is refused with the same ground that
`explain` names."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.exceptions import InputError
from monitor.reporting.certificate.completeness import RefusedGroundsError
from monitor.reporting.certificate.grounds import EARLY, LATE, Ground, GroundKind, ground_sentence
from monitor.reporting.texts import texts_of
from monitor.store import Database, import_campaign
from monitor.workflow.certificate.grounds import accepted_grounds, grounds_against
from monitor.workflow.models import resolve
from monitor.workflow.uncertainty.evaluation import uncertainty
from monitor.workflow.uncertainty.file_grounds import nominal_grounds
from monitor.workflow.uncertainty.request import UncertaintyRequest
from monitor.workflow.uncertainty.stored import stored_uncertainty
from tests.discovery.test_late_rows import _late, _table
from tests.readers.test_nominal_readings import _pasted, _read
from tests.simulator.ball_plate import plate_rows, write_plate

NOMINAL, LATE_ROWS = GroundKind.NOMINAL_READINGS, GroundKind.LATE_ROWS


def _of_file(campaign) -> list[Ground]:
    with Database(":memory:") as db:
        model = resolve(db, None, campaign.method)
    run = int(campaign.runs[-1].run)
    return [
        ground
        for ground in grounds_against(campaign, model, {run: None})
        if ground.kind in (NOMINAL, LATE_ROWS)
    ]


def test_nominal_values_in_place_of_readings_are_a_ground(tmp_path: Path) -> None:
    assert nominal_grounds(_read(write_plate(tmp_path / "right", plate_rows(1)))) == ()
    campaign = _read(write_plate(tmp_path / "plate", _pasted(plate_rows(1), 60, 80)))
    (ground,) = _of_file(campaign)
    assert ground == Ground(NOMINAL, 1, "61–80 (place2)", 20)
    said = ground_sentence(ground, texts_of())
    assert "20 readings are no readings but nominal values" in said
    assert "(sequence 61–80 (place2))" in said
    with pytest.raises(RefusedGroundsError, match="nominal-readings: run 1: 20 readings are no readings"):
        accepted_grounds([ground], {})
    (accepted,) = accepted_grounds([ground], {NOMINAL: "a master that was set, by its certificate"})
    assert accepted.grounds == (ground,)
    with pytest.raises(InputError, match="--accept nominal-readings: there is nothing to accept"):
        accepted_grounds([], {NOMINAL: "none"})


@pytest.mark.parametrize(
    ("rows", "first", "unit"), [(1, 50, LATE), pytest.param(-3, 20, EARLY, marks=pytest.mark.slow)]
)
def test_columns_that_are_late_are_a_ground(tmp_path: Path, rows: int, first: int, unit: str) -> None:
    right = _table(tmp_path / "table", np.random.default_rng(7))
    assert _of_file(right) == []
    (ground,) = _of_file(_late(right, "C", rows, first))
    assert (ground.kind, ground.run, ground.size, ground.unit) == (LATE_ROWS, 1, abs(rows), unit)
    sequence, column = ground.subject.split(" ")
    assert column == "(c_deg)"
    assert abs(int(sequence) - (first + 1)) <= 4
    for language, word in (("en", f"too {unit}"), ("de", "zu spät" if unit == LATE else "zu früh")):
        assert f"sequence {ground.subject}" in ground_sentence(ground, texts_of(language))
        assert word in ground_sentence(ground, texts_of(language))


@pytest.mark.slow
def test_uncertainty_says_and_stores_it_with_its_result(tmp_path: Path) -> None:
    campaign = _read(write_plate(tmp_path / "plate", _pasted(plate_rows(1), 60, 80)))
    with Database(tmp_path / "m.duckdb", threads=1) as db:
        import_campaign(db, campaign)
        answer = uncertainty(db, UncertaintyRequest(campaign.name, 1, method="guf"))
        stored = stored_uncertainty(
            db, campaign, 1, resolve(db, None, campaign.method), UncertaintyRequest(campaign.name, 1).asked
        )
    assert (answer.grounds or ())[:1] == nominal_grounds(campaign)
    assert stored is not None
    assert stored.answer.grounds == answer.grounds
