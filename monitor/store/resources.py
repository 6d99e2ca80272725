"""Where the numbered SQL files are: packed inside ``monitor`` when installed, beside it in a checkout."""

from __future__ import annotations

from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path


def migration_folder() -> Traversable:
    """The folder that holds ``0001_*.sql`` and the others."""
    try:
        return resources.files("monitor.migrations")
    except ModuleNotFoundError:
        return Path(__file__).resolve().parents[2] / "migrations"
