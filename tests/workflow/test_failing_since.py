"""A model fails since the first of the compared campaigns that show it, week after week."""

from __future__ import annotations

from datetime import datetime, timedelta
from types import SimpleNamespace
from typing import Any

import pytest

from monitor.records import Verdict
from monitor.workflow.health import failing

FIRST = datetime(2026, 5, 19, 8, 0)
GEAR, SHAPE = "EBB:harmonic5", "EXX:free(2,7)"


def explanation(*effects: str, explained: bool = False) -> Any:
    """What a comparison says of the model: nothing, or that these effects are missing."""
    verdict = Verdict.EXPLAINED if explained else Verdict.SOMETHING_IS_MISSING
    missing = [SimpleNamespace(effect=effect, indistinguishable_from=()) for effect in effects]
    return SimpleNamespace(comparison=SimpleNamespace(verdict=verdict), missing=missing)


OK = explanation(explained=True)


@pytest.mark.parametrize(
    ("of_weeks", "since"),
    [
        ([OK, explanation(GEAR), explanation(GEAR)], 1),
        ([OK, explanation(GEAR), None, None, explanation(GEAR)], 1),
        ([explanation(GEAR), OK, explanation(GEAR)], 2),
        ([explanation(SHAPE), explanation(GEAR), explanation("EBB:harmonic5.1")], 1),
        ([explanation(), explanation(GEAR)], 0),
        ([explanation(GEAR)], 0),
        ([explanation(GEAR), OK], 1),
    ],
)
def test_a_model_fails_since_the_first_compared_week_that_shows_it(
    monkeypatch: pytest.MonkeyPatch, of_weeks: list[Any], since: int
) -> None:
    starts = [FIRST + timedelta(weeks=week) for week in range(len(of_weeks))]
    runs: Any = [
        SimpleNamespace(campaign=str(week), method="instruments", local_start=start)
        for week, start in enumerate(starts)
    ]
    stored = {str(week): answer for week, answer in enumerate(of_weeks)}
    monkeypatch.setattr(failing, "stored_explanation", lambda db, campaign, week: stored[campaign])
    week: Any = SimpleNamespace(last=runs[-1], span=SimpleNamespace(first=starts[-1]))
    assert failing.failing_since(None, runs, week, of_weeks[-1]) == starts[since]  # type: ignore[arg-type]
