"""Moments of requests: each with its offset from UTC, so that nobody takes it for another hour."""

from __future__ import annotations

from datetime import datetime

from monitor.exceptions import InputError


def check_offsets(*moments: datetime | None) -> None:
    """Raise InputError for the first moment without its offset from UTC; None stands for no moment."""
    for moment in moments:
        if moment is not None and moment.utcoffset() is None:
            raise InputError(
                f"{moment.isoformat()} has no offset from UTC; write for example {moment.isoformat()}+01:00"
            )
