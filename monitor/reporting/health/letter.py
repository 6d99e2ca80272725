"""The e-mail of a health report: its subject and its lines."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from monitor.documents import Said
from monitor.reporting.health.records import FleetRow


def report_subject(week: str, alarms: int, measured: int) -> str:
    """Return the subject: the number of alarms, or that there is none."""
    if alarms:
        return f"Machine health {week}: {alarms} alarm{'s' if alarms != 1 else ''}"
    return f"Machine health {week}: {'no alarm' if measured else 'no machine was measured'}"


def report_lines(week: str, from_: str, to: str, rows: Sequence[FleetRow], message: Said) -> list[str]:
    """Return the fleet table as lines of text, and the message of the report where there is one."""
    lines = [f"Week {week}, {from_} to {to}", ""]
    for row in rows:
        p = row.probability_out
        out = "" if p is None else f", probability out of tolerance {p:.2g}"
        lines += [f"{row.machine}: {row.state}{out}", f"  {row.changed}; next check {row.next_check}"]
    return [*lines, "", str(message)] if message else lines


def not_attached(file: Path) -> str:
    """Return the line for a file that is too large to be attached."""
    return f"too large to be attached: {file}"
