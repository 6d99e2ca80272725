"""Moments that are typed: read by ``monitor.moments``, without an offset in the time zone of the configuration."""

from __future__ import annotations

from datetime import datetime
from zoneinfo import ZoneInfo

from monitor.cli.configuration import configuration
from monitor.moments import moment_of


def moment(text: str, option: str) -> datetime:
    """Return the moment with its offset; a day is its beginning, without an offset it is the time of the
    configuration's zone, else of this computer.

    Raises InputError, which names the forms that are read, or says what no calendar or clock has.
    """
    zone = configuration().time_zone
    return moment_of(text, f"{option} {text}", None if zone is None else ZoneInfo(zone))
