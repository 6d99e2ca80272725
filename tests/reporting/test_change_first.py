"""What to do begins with what changed in the week: a machine that somebody ran into is not first compensated."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from pathlib import Path

import pytest
from by_path import load

from monitor.documents import Said
from monitor.reporting.health.answers import answers, to_do
from monitor.reporting.health.news import EventNoted, ParameterChanged, SteppedAtEvent
from monitor.reporting.health.records import Change, ChangeKind, MachineHealth
from monitor.reporting.lacks import Undecided

first_page = load("first_page", Path(__file__).with_name("test_first_page.py"))
STEP = ParameterChanged("EXX", "step", 12.0, 1.0, "µm/m")
AT_EVENT = SteppedAtEvent("EXX", "hit the vice", 12.0, 1.0, "µm/m", None)
OUT = "adjust or compensate squareness X-Y (EC0Y) and measure again now."


def changed(kind: ChangeKind, what: Said, *, this_week: bool = True) -> Change:
    return Change(kind, None, datetime(2026, 3, 4), what, 1e-5, this_week)


def with_changes(*changes: Change) -> MachineHealth:
    drifted: MachineHealth = replace(first_page.DRIFTED, changes=changes)
    return drifted


@pytest.mark.parametrize(
    ("changes", "begins"),
    [
        (
            [changed(ChangeKind.CHANGE, STEP)],
            "EXX stepped by +12.0 µm/m (u = 1.0 µm/m): find out what was done or happened then and record it as an "
            "event, then ",
        ),
        (
            [changed(ChangeKind.EVENT_STEP, AT_EVENT), changed(ChangeKind.EVENT, EventNoted("crash", "hit the vice"))],
            "EXX stepped by +12.0 µm/m at the event 'hit the vice' (u = 1.0 µm/m): look at what that did to the "
            "machine, then ",
        ),
        (
            [changed(ChangeKind.EVENT_STEP, replace(AT_EVENT, undecided=Undecided.ONE_DAY_EACH))],
            "EXX may have stepped by +12.0 µm/m (not decided) at the event 'hit the vice': look at what that did to "
            "the machine, then ",
        ),
        (
            [changed(ChangeKind.EVENT, EventNoted("crash", "hit the vice"))],
            "Crash: hit the vice: look at what that did to the machine, then ",
        ),
    ],
)  # fmt: skip
def test_it_begins_with_what_changed(changes: list[Change], begins: str) -> None:
    assert to_do(with_changes(*changes)) == begins + OUT


def test_of_many_changes_two_are_named() -> None:
    steps = [
        changed(ChangeKind.CHANGE, replace(STEP, parameter=name)) for name in ("EXX", "EYY", "EZZ", "EC0Y")
    ]
    advice = to_do(with_changes(*steps))
    assert advice.startswith("EXX stepped by +12.0 µm/m (u = 1.0 µm/m); EYY stepped by")
    assert "µm/m); and 2 more: find out" in advice


@pytest.mark.parametrize(
    "change",
    [
        changed(ChangeKind.CHANGE, STEP, this_week=False),
        changed(ChangeKind.SETTLING, "EXX settled"),
        changed(ChangeKind.EVENT, EventNoted("note", "hall heated")),
    ],
)
def test_what_is_past_or_of_no_harm_changes_no_word(change: Change) -> None:
    assert to_do(with_changes(change)) == OUT[0].upper() + OUT[1:]


def test_the_first_page_says_it_of_the_worst_machine() -> None:
    fleet = first_page.fleet(with_changes(changed(ChangeKind.CHANGE, STEP)))[0]
    said = {answer.kind: answer.sentence for answer in answers(fleet)}
    assert said["do"].startswith("EXX stepped by +12.0 µm/m")
    assert first_page.CHANGED.changes
    assert to_do(first_page.CHANGED).startswith("Find out what was done or happened then")
