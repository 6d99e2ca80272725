"""The time left of a bar: known from the first piece on, counting down between two, by the mean pace."""

from __future__ import annotations

import io

import pytest
from rich.console import Console
from rich.progress import Progress

from monitor.cli import output
from monitor.cli.time_left import TimeLeft


def test_the_time_left_is_known_from_the_first_piece_on_and_counts_down() -> None:
    now = 100.0
    column = TimeLeft()
    progress = Progress(column, get_time=lambda: now)
    task = progress.add_task("reporting", total=5)

    def shown() -> str:
        return column.render(progress.tasks[0]).plain

    now = 118.0
    assert shown() == "-:--:--"
    now = 120.0
    progress.update(task, completed=1)
    # One of five pieces took 20 s: four are left.
    assert shown() == "0:01:20"
    now = 133.0
    assert shown() == "0:01:07"
    now = 134.0
    progress.update(task, completed=2)
    # Two took 34 s: three at 17 s are left.
    assert shown() == "0:00:51"
    now = 190.0
    assert shown() == "0:00:00"
    progress.update(task, completed=5)
    assert shown() == "0:00:00"


def test_no_total_no_time_left() -> None:
    column = TimeLeft()
    progress = Progress(column, get_time=lambda: 0.0)
    progress.add_task("propagating", total=None)
    assert column.render(progress.tasks[0]).plain == "-:--:--"


def test_what_comes_behind_the_last_piece_is_shown_as_being_at_work(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = io.StringIO()
    monkeypatch.setattr(output, "_shows_progress", lambda: True)
    monkeypatch.setattr(output, "Console", lambda stderr: Console(file=seen, force_terminal=True, width=120))
    with output.stepping("reporting", 2, behind=True, afterwards="writing the pages") as progress:
        progress("A1")
        progress("A2")
    assert "writing the pages" in seen.getvalue()
    assert "2/2" not in seen.getvalue()
