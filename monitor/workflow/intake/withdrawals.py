"""Withdrawing a campaign that should not have been imported, so that the corrected folder can take its name."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime

from monitor.documents import IN_UTC
from monitor.reporting import messages
from monitor.store import Database, withdraw_campaign


@dataclass(frozen=True)
class WithdrawRequest:
    """A campaign that is to count no longer, and why."""

    campaign: str
    reason: str


@dataclass(frozen=True)
class WithdrawAnswer:
    """The withdrawn campaign; ``certificates`` are the numbers that are valid or drafts and rest on it."""

    campaign: str
    machine: str
    reason: str
    withdrawn_at: datetime = field(metadata=IN_UTC)
    certificates: tuple[str, ...]
    message: str


def withdraw(db: Database, request: WithdrawRequest) -> WithdrawAnswer:
    """Let a campaign count no longer; its certificates are named. Raises InputError without a reason, NotFoundError."""
    withdrawal = withdraw_campaign(db, request.campaign, request.reason)
    return WithdrawAnswer(
        withdrawal.campaign,
        withdrawal.machine,
        withdrawal.reason,
        withdrawal.withdrawn_at,
        withdrawal.certificates,
        messages.campaign_withdrawn(withdrawal.campaign),
    )
