"""Answers as JSON documents: what the command line prints and the store keeps, for tests that compare keys."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Any

from monitor.documents import to_document
from monitor.store import Database
from monitor.workflow.fleet import fleet as fleet_question
from monitor.workflow.fleet.request import FleetRequest
from monitor.workflow.health import report as report_question
from monitor.workflow.health.request import ReportOptions, ReportRequest
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import trend


def trends(db: Database, machine: str, **request: Any) -> dict[str, Any]:
    """The answer of `monitor trend`."""
    return to_document(trend(db, TrendRequest(machine, **request)))


def fleet(db: Database, **request: Any) -> dict[str, Any]:
    """The answer of `monitor fleet`."""
    return to_document(fleet_question.fleet(db, FleetRequest(**request)))


def report(
    db: Database,
    week: str | None = None,
    machine: str | None = None,
    out: Path | None = None,
    *,
    options: ReportOptions | None = None,
    made_at: datetime | None = None,
    workers: int | None = None,
) -> dict[str, Any]:
    """The answer of `monitor report`."""
    request = ReportRequest(week, machine, out or Path(), options or ReportOptions(), workers, made_at)
    return to_document(report_question.report(db, request))
