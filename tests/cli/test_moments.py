"""Every form of a moment that a message proposes is read, by every option that takes one."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any

import pytest

from monitor.api.arguments import argument
from monitor.cli.moments import moment
from monitor.exceptions import InputError


@pytest.fixture
def new_york(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("TZ", "EST5EDT,M3.2.0,M11.1.0")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()


@pytest.mark.parametrize(
    ("text", "read"),
    [
        ("2025-07-20", "2025-07-20T00:00:00-04:00"),
        ("2025-07-20 14:00", "2025-07-20T14:00:00-04:00"),
        ("2025-07-20T14:00", "2025-07-20T14:00:00-04:00"),
        ("2025-01-20 7:05", "2025-01-20T07:05:00-05:00"),
        ("2025-07-20 14:00:30", "2025-07-20T14:00:30-04:00"),
        ("2025-07-20T14:00:00+02:00", "2025-07-20T14:00:00+02:00"),
        ("2025-07-20 14:00 +02:00", "2025-07-20T14:00:00+02:00"),
        ("2025-07-20T14:00Z", "2025-07-20T14:00:00+00:00"),
        (" 2025-07-20 ", "2025-07-20T00:00:00-04:00"),
    ],
)
@pytest.mark.usefixtures("new_york")
def test_a_moment_without_offset_is_the_time_of_this_computer(text: str, read: str) -> None:
    assert moment(text, "--at").isoformat() == read


@pytest.mark.parametrize("text", ["", "soon", "20250720", "2025-W10-1", "20.07.2025"])
def test_what_is_no_moment_is_refused_with_forms_that_are_read(text: str) -> None:
    with pytest.raises(InputError, match=re.escape(f"--at {text}: write a day or a time as")) as refusal:
        moment(text, "--at")
    proposed = re.findall(r"2026-03-05(?:[T ][0-9:+-]+)?", str(refusal.value))
    assert len(proposed) == 3
    for form in proposed:
        assert moment(form, "--at").tzinfo is not None


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("2025-02-30", "day"),
        ("2025-13-01", "month"),
        ("2025-07-20 25:00", "hour"),
        ("2025-07-20 14:61", "minute"),
    ],
)
def test_a_day_that_no_calendar_has_is_not_answered_with_the_form_that_it_has(text: str, why: str) -> None:
    with pytest.raises(InputError, match=re.escape(f"--at {text}: there is no such day or time, {why}")):
        moment(text, "--at")


@pytest.mark.parametrize(
    "at",
    [
        "2025-07-20 14:00",
        *(pytest.param(at, marks=pytest.mark.slow) for at in ("2025-07-20", "2025-07-20T14:00")),
    ],
)
def test_every_option_with_a_moment_reads_the_same_forms(typed: Any, db: Path, at: str) -> None:
    recorded = typed("event", "HU40-T", "belt changed", "--at", at, "--json", db=db)
    stored = datetime.fromisoformat(recorded.document["events"][0]["happened_at"])
    assert stored == moment(at, "--at").astimezone(UTC)
    trend = ["trend", "HU40-T", "--parameter", "EXX", "--campaign", "cold-cold", "--since", at]
    answer = typed(*trend, "--reference", f"{at}..2026-03-04", "--next-check", "2026-09-01", db=db)
    assert (answer.status, answer.err) == (0, "")


def test_the_command_line_and_python_read_the_same_forms(new_york: None) -> None:
    """Python read 20260305 and weeks, which the command line refuses."""
    for text in ("2025-07-20", "2025-01-20 7:05", "2025-07-20 14:00 +02:00", "2025-07-20T14:00Z"):
        assert argument("at", text, datetime) == moment(text, "--at")
    for text in ("20250720", "2025-W10-1", "soon"):
        with pytest.raises(InputError, match=re.escape(f"at={text!r}: write a day or a time as 2026-03-05")):
            argument("at", text, datetime)
    with pytest.raises(InputError, match="start='2025-02-30': there is no such day"):
        argument("start", "2025-02-30", date)
