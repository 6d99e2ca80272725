"""What people know of a machine: record an event, or list what was recorded."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from monitor.exceptions import InputError, NotFoundError
from monitor.store import NOTE, Database, StoredEvent, list_machines, record_event, stored_events
