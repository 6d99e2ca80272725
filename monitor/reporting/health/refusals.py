"""Refused imports as a health report prints them."""

from __future__ import annotations

from dataclasses import dataclass

from monitor.reporting.health.records import RefusedImport
from monitor.reporting.health.words import day

#: Faults of a refused import in words; the others are counted.
_FAULTS_SHOWN = 3


@dataclass(frozen=True)
class PrintedRefusal:
    """A refused import as printed."""

    when: str
    folder: str
    of: str
    faults: tuple[str, ...]
    more: int
    settled: str


def printed_refusal(refusal: RefusedImport) -> PrintedRefusal:
    """The first faults in words, the others counted."""
    shown = refusal.faults[:_FAULTS_SHOWN]
    names = [
        f"campaign {refusal.campaign}" if refusal.campaign else "",
        f"machine {refusal.machine}" if refusal.machine else "",
    ]
    return PrintedRefusal(
        when=day(refusal.at),
        folder=refusal.folder,
        of=", ".join(name for name in names if name),
        faults=shown,
        more=refusal.fault_count - len(shown),
        settled="" if refusal.imported_at is None else day(refusal.imported_at),
    )
