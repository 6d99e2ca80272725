"""Plug-ins by entry point: a shape or a driver of the user's own, one class in one file."""

from __future__ import annotations

from functools import cache
from importlib.metadata import entry_points
from typing import Any


@cache
def plug_ins(group: str) -> tuple[Any, ...]:
    """What is registered under an entry point group (``monitor.shapes`` or ``monitor.drivers``)."""
    return tuple(point.load() for point in sorted(entry_points(group=group), key=lambda point: point.name))
