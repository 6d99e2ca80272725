"""Sentences about what stands on record: certificates in force and replaced, events long ago."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime


def certificates_in_force(campaign: str, numbers: Sequence[str]) -> str:
    """Return that other certificates of the same runs are in force."""
    several = len(numbers) > 1
    return (
        f"of the same runs of {campaign} {'certificates' if several else 'certificate'} {', '.join(numbers)} "
        f"{'are' if several else 'is'} in force: withdraw {'them' if several else 'it'}, or amend "
        f"{'one of them' if several else 'it'} instead of issuing another"
    )


def why_replaced(number: str) -> str:
    """Return that a certificate is replaced only with a reason."""
    return f"say why certificate {number} is replaced: --reason TEXT"


def long_before_all_runs(machine: str, at: datetime, first: datetime) -> str:
    """Return that an event lies long before the first run of its machine, in UTC, and how it is confirmed."""
    return (
        f"{at:%Y-%m-%d} lies more than a year before the first run of {machine} ({first:%Y-%m-%d} UTC): give the time "
        "it had, or confirm that it was so long before (--before-runs; the box beside the time); nothing was recorded"
    )
