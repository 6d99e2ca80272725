"""Withdrawing a campaign that should not have been imported, so that the corrected folder can take its place."""

from __future__ import annotations

from typing import Any

from monitor.store import Database, withdraw_campaign

Document = dict[str, Any]


def withdraw(db: Database, campaign: str, reason: str) -> Document:
    """Let a campaign count no longer; its certificates are named. Raises InputError without a reason, NotFoundError."""
    done = withdraw_campaign(db, campaign, reason)
    return {
        "campaign": done.campaign,
        "machine": done.machine,
        "reason": done.reason,
        "withdrawn_at": f"{done.withdrawn_at.isoformat()}Z",
        "certificates": list(done.certificates),
        "message": f"{done.campaign}: withdrawn, it no longer counts; its name is free for the corrected folder",
    }
