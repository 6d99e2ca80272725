"""A page that was asked just before an answer came: it says that it waits, or nothing loads it again."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from monitor.web.ticket import Ticket

CAMPAIGN = "hidden-spindle-growth"
TOOK_S = 60.0


@pytest.fixture
def too_late(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Ticket]]:
    """Every answer comes right after it was looked for; the tickets that were looked at."""
    looked_at: list[Ticket] = []
    answer = Ticket.answer

    def answered_afterwards(ticket: Ticket, patience: float = 0.0) -> Any:
        answer(ticket, ticket.seconds + TOOK_S)
        looked_at.append(ticket)

    monkeypatch.setattr(Ticket, "answer", answered_afterwards)
    yield looked_at
    assert all(ticket.is_done for ticket in looked_at)


@pytest.mark.parametrize(
    "address",
    [
        f"/campaign?name={CAMPAIGN}",
        pytest.param(f"/model?campaign={CAMPAIGN}", marks=pytest.mark.slow),
        f"/map?campaign={CAMPAIGN}",
        f"/plan?campaign={CAMPAIGN}",
        pytest.param("/reports?week={week}", marks=pytest.mark.slow),
        "/machine?name={machine}&parameter={parameter}",
        "/machine?name={machine}&every=1",
        "/",
    ],
)
def test_what_was_answered_right_after_the_look_is_waited_for(
    local: Any, too_late: list[Ticket], address: str
) -> None:
    assert local.ask("identify", {"campaign": CAMPAIGN})[0] == 200
    _, campaigns = local.ask("campaigns", {"campaign": CAMPAIGN})
    machine = campaigns["campaigns"][0]["machine"]
    _, values = local.ask("values", {"machine": machine})
    names = {"week": "2026-W10", "machine": machine, "parameter": next(iter(values["parameters"]))}
    page = local.client.get(address.format(**names))
    assert page.status_code == 200, page.text[-2000:]
    assert too_late
    assert 'class="waiting"' in page.text
