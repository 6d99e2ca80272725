"""Backups: ``full`` copies, what follows them (``increment``), and ``restoring``; ``manifest`` says what each holds."""

from __future__ import annotations

from monitor.store.backups.full import snapshot, take_backup
from monitor.store.backups.increment import take_increment
from monitor.store.backups.manifest import Backup, list_backups
from monitor.store.backups.restoring import Restored, restore

__all__ = ["Backup", "Restored", "list_backups", "restore", "snapshot", "take_backup", "take_increment"]
