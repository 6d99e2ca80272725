"""Identifications come back to the last bit; a later one stands beside the earlier, and the views show it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from monitor.exceptions import DataError, NotFoundError
from monitor.records import Campaign
from monitor.store import (
    Database,
    StoredIdentification,
    identification_by_number,
    import_campaign,
    load_identification,
    save_identification,
)

Make = Callable[..., StoredIdentification]


def superseded(db: Database) -> list[bool]:
    """Whether each identification was replaced by a later one, in the order of their numbers."""
    return [
        bool(replaced)
        for (replaced,) in db.rows("SELECT superseded FROM v_identifications ORDER BY identification_id")
    ]


@pytest.fixture
def kept(db: Database, campaign: Campaign) -> Campaign:
    """The small campaign, imported."""
    import_campaign(db, campaign)
    return campaign


def _assert_same(one: StoredIdentification, other: StoredIdentification) -> None:
    assert dataclasses.replace(one, runs=()) == dataclasses.replace(other, runs=())
    assert len(one.runs) == len(other.runs)
    for a, b in zip(one.runs, other.runs, strict=True):
        for field in dataclasses.fields(a):
            left, right = getattr(a, field.name), getattr(b, field.name)
            if isinstance(left, np.ndarray):
                np.testing.assert_array_equal(left, right, strict=True)
            elif field.name == "common_parts":
                assert list(left) == list(right)
                for quantity, part in left.items():
                    np.testing.assert_array_equal(part, right[quantity], strict=True)
            else:
                assert left == right


def test_identification_comes_back_to_the_last_bit(
    db: Database, kept: Campaign, make_identification: Make
) -> None:
    identification = make_identification(kept)
    assert save_identification(db, identification) == 1
    _assert_same(load_identification(db, kept.name), identification)
    _assert_same(load_identification(db, kept.name, "samba", 1, run=1), identification)


def test_parameters_are_seen_in_their_display_unit(
    db: Database, kept: Campaign, make_identification: Make
) -> None:
    save_identification(db, make_identification(kept))
    table = db.frame("SELECT * FROM v_parameters WHERE campaign = ?", [kept.name]).set_index(
        ["run", "parameter"]
    )
    assert table.loc[(2, "EX0C"), "unit"] == "µm"
    assert table.loc[(2, "EX0C"), "value"] == pytest.approx(0.2, rel=1e-15)
    assert table.loc[(1, "EA0B"), "unit"] == "µrad"
    assert table.loc[(1, "EA0B"), "u"] == pytest.approx(2.0, rel=1e-15)


def test_refused_parameter_has_no_number_and_its_reason(
    db: Database, kept: Campaign, make_identification: Make
) -> None:
    save_identification(db, make_identification(kept))
    values = db.rows("SELECT DISTINCT value, u FROM v_parameters WHERE parameter = 'EX0C1'")
    assert values == [(None, None)]
    why = db.rows("SELECT DISTINCT refused -> 0 ->> 'why' FROM v_identified_runs")
    assert why == [("the spindle is never indexed",)]


def test_residuals_are_seen_with_the_touch_that_they_belong_to(
    db: Database, kept: Campaign, make_identification: Make
) -> None:
    save_identification(db, make_identification(kept))
    ((target, dx, dy, length, b),) = db.rows(
        "SELECT target, dx_um, dy_um, length_um, readings['B'] FROM v_residuals WHERE run = 2 AND sequence = 2"
    )
    assert (target, b) == ("β", -235.123456)
    assert (dx, dy) == pytest.approx((-200.0, 2000 / 3), rel=1e-15)
    assert length == pytest.approx(np.hypot(200.0, 2000 / 3), rel=1e-15)


def test_later_identification_supersedes_and_the_earlier_stays(
    db: Database, kept: Campaign, make_identification: Make
) -> None:
    first, second = make_identification(kept), make_identification(kept, shift=1.0)
    save_identification(db, first)
    save_identification(db, second)
    assert superseded(db) == [True, False]
    _assert_same(load_identification(db, kept.name), second)
    _assert_same(identification_by_number(db, 1), first)
    assert set(db.rows("SELECT identification_id FROM v_parameters")) == {(2,)}


def test_identification_of_one_run_replaces_that_run_in_the_views_only(
    db: Database, kept: Campaign, make_identification: Make
) -> None:
    whole, single = make_identification(kept), make_identification(kept, runs=(1,), shift=1.0)
    save_identification(db, whole)
    save_identification(db, single)
    seen = db.rows("SELECT DISTINCT run, identification_id FROM v_parameters ORDER BY run")
    assert seen == [(1, 2), (2, 1)]
    _assert_same(load_identification(db, kept.name), whole)
    _assert_same(load_identification(db, kept.name, run=1), single)


def test_versions_of_a_model_stand_side_by_side(
    db: Database, kept: Campaign, make_identification: Make
) -> None:
    save_identification(db, make_identification(kept, version=1))
    save_identification(db, make_identification(kept, version=2))
    assert superseded(db) == [False, False]
    assert load_identification(db, kept.name, "samba", 1).model_version == 1
    assert load_identification(db, kept.name, "samba").model_version == 2


def test_not_identified_yet_says_what_to_type(db: Database, kept: Campaign) -> None:
    with pytest.raises(NotFoundError, match="has not been identified yet; type `monitor identify M"):
        load_identification(db, kept.name)
    with pytest.raises(NotFoundError, match="identified yet for model base run 3; type"):
        load_identification(db, kept.name, "base", run=3)
    with pytest.raises(NotFoundError, match="no identification number 7"):
        identification_by_number(db, 7)


def test_unknown_campaign_or_run(db: Database, kept: Campaign, make_identification: Make) -> None:
    with pytest.raises(NotFoundError, match="has no run 3"):
        save_identification(db, make_identification(kept, runs=(1, 3)))
    with pytest.raises(NotFoundError, match="there is no campaign 'other'"):
        save_identification(db, dataclasses.replace(make_identification(kept), campaign="other"))
    assert db.rows("SELECT count(*) FROM identification") == [(0,)]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"estimate": np.zeros(2)}, r"must be \(3,\) and \(3, 3\), not \(2,\)"),
        ({"covariance": np.zeros((3, 2))}, r"not \(3,\) and \(3, 2\)"),
        ({"residuals": np.zeros((2, 3))}, r"residuals must be \(3, 3\)"),
        ({"residuals": np.full((3, 3), np.nan)}, "residuals must be finite"),
        ({"chi_square": float("inf")}, "chi-square and residuals must be finite"),
        ({"estimate": np.array([np.inf, 0.0, 0.0])}, "finite, or NaN where refused"),
        ({"refused": ()}, "EX0C1 has no number and no reason"),
    ],
)
def test_arrays_that_do_not_fit(
    db: Database, kept: Campaign, make_identification: Make, change: dict[str, object], message: str
) -> None:
    identification = make_identification(kept, runs=(1,))
    wrong = dataclasses.replace(identification, runs=(dataclasses.replace(identification.runs[0], **change),))
    with pytest.raises(DataError, match=message):
        save_identification(db, wrong)


def test_units_and_runs_that_are_missing(db: Database, kept: Campaign, make_identification: Make) -> None:
    identification = make_identification(kept)
    with pytest.raises(DataError, match="3 parameters need 3 units, not 0"):
        save_identification(db, dataclasses.replace(identification, units=()))
    with pytest.raises(DataError, match="at least one run"):
        save_identification(db, dataclasses.replace(identification, runs=()))
