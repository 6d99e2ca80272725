"""Selections and groups of runs by column, bin and typed condition."""

from __future__ import annotations

import numpy as np
import pytest

from monitor.exceptions import DataError, NotFoundError
from monitor.statistics import group_by, select_runs
from monitor.statistics.sums import label_groups

COLUMNS = {
    "run": np.arange(1, 7),
    "day": np.array([1, 1, 2, 2, 10, 10]),
    "warm_up": np.array([True, False, False, True, False, False]),
    "hours": np.array([0.5, 1.5, 2.5, 6.0, 7.0, 8.5]),
    "operator": np.array(["Jo", "Jo", "An and Bo", "Jo", "An and Bo", "Jo"]),
    "started_at": np.array([f"2026-03-0{d}" for d in range(1, 7)], dtype="datetime64[s]"),
}


@pytest.mark.parametrize(
    ("condition", "runs"),
    [
        ("hours >= 6", [4, 5, 6]),
        ("warm_up == true and hours<6", [1]),
        ("warm_up = False", [2, 3, 5, 6]),
        ("operator == 'An and Bo'", [3, 5]),
        ("operator == 'An and Bo' and day != 2", [5]),
        ("started_at > 2026-03-03 and started_at <= 2026-03-05", [4, 5]),
        ("started_at > 2026-03-03T02:00+02:00 and started_at <= '2026-03-04 19:00-05:00'", [4, 5]),
        ("operator == Jo", [1, 2, 4, 6]),
    ],
)
def test_conditions_select_runs(condition, runs):
    np.testing.assert_array_equal(np.flatnonzero(select_runs(COLUMNS, condition).mask) + 1, runs)


def test_a_selection_keeps_its_name_and_condition():
    selection = select_runs(COLUMNS, "hours >= 6", name="settled")
    assert (selection.name, selection.condition) == ("settled", "hours >= 6")


@pytest.mark.parametrize(
    ("condition", "message"),
    [
        ("speed > 3", "no column 'speed'; there are day, hours, operator"),
        ("hours around 6", "is no condition; write column, operator"),
        ("hours > warm", "hours is compared with 'warm'; it holds numbers"),
        ("warm_up == 1", "it is true or false"),
        ("started_at > monday", "it holds ISO 8601 times"),
        ("hours > 99", "no run meets 'hours > 99'"),
    ],
)
def test_refusals_say_what_is_right(condition, message):
    with pytest.raises((DataError, NotFoundError), match=message):
        select_runs(COLUMNS, condition)


def test_groups_by_column_and_by_bin_sort_as_they_should():
    assert list(group_by(COLUMNS, "day")) == [" 1", " 1", " 2", " 2", "10", "10"]
    assert list(group_by(COLUMNS, "hours", edges=[1, 6])) == [
        "below 1", "1 to 6", "1 to 6", "6 and above", "6 and above", "6 and above",
    ]  # fmt: skip


def test_groups_refuse_what_makes_no_groups():
    with pytest.raises(DataError, match="every run has its own hours; give edges"):
        group_by(COLUMNS, "hours")
    with pytest.raises(DataError, match="operator holds no numbers"):
        group_by(COLUMNS, "operator", edges=[1])
    with pytest.raises(DataError, match="finite rising numbers"):
        group_by(COLUMNS, "hours", edges=[6, 1])
    with pytest.raises(NotFoundError, match="no column 'shift'"):
        group_by(COLUMNS, "shift")
    with pytest.raises(DataError, match="not recorded for every run"):
        group_by({"t": np.array([1.0, np.nan])}, "t", edges=[1])


def test_groups_stand_in_the_order_of_their_numbers():
    for labels in (
        ["below 4.5", "4.5 to 12", "above 12"],
        ["1", "2", "10"],
        ["-5", "0", "1e3"],
        ["2026-03-02", "2026-03-10"],
        ["campaign day 2", "campaign day 10"],
        ["below 9", "9 to 10", "10 and above", "cold"],
    ):
        found, index = label_groups(labels[::-1], len(labels))
        assert found == tuple(labels)
        assert index.tolist() == list(range(len(labels)))[::-1]
