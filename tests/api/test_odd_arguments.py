"""Whatever is given to the Python interface, it answers or says why not, never by an exception of Python's own."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from contextlib import suppress
from datetime import date, datetime
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
import pandas as pd
import pytest

import monitor as mm
from monitor.api.arguments import argument
from monitor.api.asking import request_of
from monitor.exceptions import InputError, MonitorError
from monitor.workflow.contract import QUESTIONS
from monitor.workflow.likeness import Drift, Step

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
CHAIN = "w C B X b Z Y (C1) t"
ODD: list[Any] = [
    None, 5, -1, 5.5, math.nan, math.inf, 10**400, True, "", "text", "12,0", "\0", "\udc80", b"x", [], ["a"], [[1]],
    [None], (0, 0), {}, {"a": 1}, {1: 2}, set(), object(), np.array(3.0), np.array([1.0, 2.0]), np.array([[1.0]]),
    np.float32(2), np.bool_(True), np.datetime64("NaT"), pd.Series([1, 2]), pd.DataFrame({"a": [1]}), pd.NaT, pd.NA,
    Path("x"), range(3), len, 1j, date(2026, 1, 1), datetime(1, 1, 1), "2026-02-30", "x" * 5000,
]  # fmt: skip
#: What a request needs besides the field that is odd.
NEEDED = {
    "start": "2026-01-01", "folders": ["a"], "machines": ["a"], "readings": {"X": 1.0}, "names": ["a", "b"],
    "earlier": ("2026-01-01", "2026-01-02"), "later": ("2026-01-03", "2026-01-04"), "parameters": ["EXX"],
}  # fmt: skip
OF_TYPE = {str: "a", int: 1, float: 0.5, bool: False, Path: "x"}


def needed(request: Any) -> dict[str, Any]:
    hints = get_type_hints(request)
    without = [
        field.name
        for field in dataclasses.fields(request)
        if field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
    ]
    return {name: OF_TYPE.get(hints[name], NEEDED.get(name, {})) for name in without}


@pytest.mark.slow
def test_every_field_of_every_request_answers_odd_values_in_words() -> None:
    """TypeError, AttributeError, OverflowError and others came from 89 fields."""
    raw = []
    for question in QUESTIONS.values():
        request = question.request
        for field in dataclasses.fields(request) if request is not None else ():
            for value in ODD:
                try:
                    request_of(request, {**needed(request), field.name: value})
                except MonitorError:
                    pass
                except Exception as error:
                    raw.append(f"{question.name}: {field.name}={value!r:.40}: {type(error).__name__} {error}")
    assert raw == []


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Iterator[mm.Database]:
    with mm.open(tmp_path_factory.mktemp("odd") / "shop.duckdb", new=True) as opened:
        opened.add(EXAMPLES / "tilting-table")
        yield opened


@pytest.mark.parametrize("value", ODD, ids=lambda value: f"{type(value).__name__}-{value!r:.12}")
def test_every_public_name_answers_odd_values_in_words(db: mm.Database, tmp_path: Path, value: Any) -> None:
    campaign, machine, like = db.campaign("tilting-table"), mm.Machine(CHAIN), EXAMPLES / "tilting-table"
    rehearsal = {"like": like, "machines": "M1", "start": "2026-01-01", "months": 0}
    calls = [
        lambda: mm.open(value), lambda: mm.open(db.path, new=value), lambda: mm.read(value), lambda: mm.Machine(value),
        lambda: machine.deviation(value), lambda: machine.vector(tool=value), lambda: machine.vector(X=value),
        lambda: db.add(value), lambda: db.campaign(value), lambda: db.trend(value), lambda: db.fleet(top=value),
        lambda: db.trend("x", campaigns=value), lambda: db.sql(value), lambda: db.ask(value),
        lambda: campaign.compare(model=value) if value is not None else None, lambda: campaign.add(value),
        lambda: campaign.uncertainty(method=value), lambda: campaign.certificate(value),
        lambda: mm.simulate(tmp_path / "o", value, days=0), lambda: mm.simulate(value, CHAIN, days=0),
        lambda: mm.simulate(tmp_path / "o", CHAIN, errors=value, days=0),
        lambda: mm.simulate(tmp_path / "o", **{**rehearsal, "machines": value}),
        lambda: mm.simulate(tmp_path / "o", **rehearsal, drifts=value),
        lambda: mm.simulate(tmp_path / "o", **rehearsal, events=[value]),
    ]  # fmt: skip
    for call in calls:
        with suppress(MonitorError):
            call()
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (
            lambda db: mm.simulate("o", CHAIN, errors={"EC0B": "12,0"}),
            r"^errors\['EC0B'\] is a number or several, such as 20\.0 or \[0\.0, 100\.0\], not '12,0'$",
        ),
        (
            lambda db: mm.simulate("o", CHAIN, errors=[("EC0B", 12.0)]),
            r"^errors is a dict of names, each with a number or several, .*, not \[\('EC0B', 12\.0\)\]$",
        ),
        (
            lambda db: mm.simulate("o", like="x", machines="M", start="2026-01-01", drifts={"EC0B": 0.5}),
            r"^drifts is a list, each \(parameter, per_month, \[machine\]\), not \{'EC0B': 0\.5\}$",
        ),
        (
            lambda db: mm.simulate("o", like="x", machines="M", start="2026-01-01", drifts=("EC0B", 0.5)),
            r"^drifts\[0\] is Drift or \(parameter, per_month, \[machine\]\), not 'EC0B'$",
        ),
        (
            lambda db: mm.simulate("o", like="x", machines="M", start="2026-01-01", drifts=[("EC0B", "0,5")]),
            r"^drifts\[0\]\.per_month is a number, such as 12\.0, not '0,5'$",
        ),
        (
            lambda db: mm.Machine(CHAIN).deviation({"EXX": 1.0}, tool=(0, 0)),
            r"^tool is 3 values, each a number, such as 12\.0, not 2: \(0, 0\)$",
        ),
        (lambda db: db.campaign("tilting-table").compare(modl="x"), "no option 'modl'; did you mean 'model'"),
        (lambda db: mm.open("s.duckdb", readonly=True), "no option 'readonly'; did you mean 'read_only'"),
        (lambda db: db.trend(), "^trend: missing a required argument: 'machine'"),
        (lambda db: db.ask("machines", name="x"), "^'machines' has no options"),
        (lambda db: db.campaign("tilting-table").explain(campaign="x"), "^campaign is 'tilting-table' here"),
        (
            lambda db: db.trend("TILT-500", since="20260305"),
            "^since='20260305': write a day or a time as 2026-03-05",
        ),
        (
            lambda db: db.campaign("tilting-table").uncertainty("3"),
            "^run is a whole number, such as 3, not '3'$",
        ),
    ],
)
def test_mistakes_of_users_are_named(db: mm.Database, call: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        call(db)


def test_other_forms_that_mean_one_thing_are_taken() -> None:
    assert argument("run", np.float64(3.0), int | None) == 3
    assert argument("folders", "a", tuple[Path, ...]) == (Path("a"),)
    assert argument("names", pd.Series(["a", "b"]), tuple[str, ...]) == ("a", "b")
    assert argument("sizes", np.array([1, 2]), tuple[float, ...]) == (1.0, 2.0)
    assert argument("at", np.datetime64("2026-03-05"), date) == date(2026, 3, 5)
    since = argument("since", pd.Timestamp("2026-03-05 07:00", tz="UTC"), datetime | None)
    assert since.isoformat() == "2026-03-05T07:00:00+00:00"
    assert argument("drifts", [("EY0A", 0.5)], tuple[Drift, ...]) == (Drift("EY0A", 0.5),)
    step = {"on": "2026-05-01", "parameter": "EB0C", "size": 9}
    assert argument("events", [step], tuple[Step, ...]) == (Step(date(2026, 5, 1), "EB0C", 9.0),)


def test_one_campaign_may_be_named_alone(db: mm.Database) -> None:
    """Its letters were taken for campaigns."""
    assert db.trend("TILT-500", campaigns="tilting-table").campaigns == ("tilting-table",)


def test_a_list_of_folders_is_taken(db: mm.Database) -> None:
    assert db.add([EXAMPLES / "tilting-table"]).imported[0].state == "unchanged"
    with pytest.raises(InputError, match="name a campaign folder or more"):
        db.add([])


def test_an_answer_without_rows_says_what_it_has(db: mm.Database, tmp_path: Path) -> None:
    """It was an empty line."""
    answer = db.ask("export", folder=tmp_path / "out.xlsx", format="xlsx")
    assert f"files: {tmp_path / 'out.xlsx'}" in repr(answer)
    assert f"<p>files: {tmp_path / 'out.xlsx'}</p>" in answer._repr_html_()
    assert len(db.ask("event", machine="TILT-500").table()) == 0
