"""Campaigns that should not have been imported: withdrawn with a reason, their name free for the corrected folder.

Nothing is deleted: rows, files and results stay in the tables, and the audit tells who withdrew what. The views
``campaign`` and ``machine``, and all that read them, leave the withdrawn out.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from monitor import __version__
from monitor.said import reason as said_reason
from monitor.store import audit
from monitor.store.catalogue import campaign_number
from monitor.store.connection import Database, utc_now


@dataclass(frozen=True)
class Withdrawal:
    """A campaign that was withdrawn (UTC). ``certificates`` are the numbers that are valid or drafts and rest on it."""

    campaign: str
    machine: str
    reason: str
    withdrawn_at: datetime
    certificates: tuple[str, ...]


def withdraw_campaign(db: Database, name: str, reason: str) -> Withdrawal:
    """Let a campaign count no longer. Its certificates are named, not withdrawn: that is a decision of its own.

    Raises InputError without a reason, NotFoundError listing what is there.
    """
    reason = said_reason(
        reason, f'say why campaign {name} is withdrawn: --reason "balls 3 and 5 were exchanged"'
    )
    with db.transaction():
        campaign_id = campaign_number(db, name)
        ((machine,),) = db.rows("SELECT machine FROM campaign WHERE campaign_id = ?", [campaign_id])
        at = utc_now()
        db.execute(
            "INSERT INTO withdrawn_campaign VALUES (?, ?, ?, ?)",
            [campaign_id, reason, __version__, at],
        )
        audit.record(
            db, "withdraw", "withdrawn campaign", str(campaign_id), withdrawal_content(db, campaign_id)
        )
        resting = db.rows(
            "SELECT number FROM v_certificates WHERE campaign_id = ? AND state IN ('draft', 'issued') ORDER BY number",
            [campaign_id],
        )
    db.forget_campaigns()
    return Withdrawal(name, machine, reason, at, tuple(str(number) for (number,) in resting))


def withdrawal_content(db: Database, campaign_id: int) -> str:
    """The hash of all that is stored of a withdrawal, with the name of its campaign."""
    return audit.digest(
        *db.rows(
            "SELECT w.*, c.campaign FROM withdrawn_campaign AS w JOIN imported_campaign AS c USING (campaign_id) "
            "WHERE campaign_id = ?",
            [campaign_id],
        )
    )
