"""The list of campaigns: a few by name, machine or order are the rows that the whole list has."""

from __future__ import annotations

from pathlib import Path

import pytest

from monitor.exceptions import InputError
from monitor.store import Database, list_campaigns
from monitor.workflow.intake.campaigns import CampaignsRequest, campaigns
from monitor.workflow.intake.importing import ImportRequest, import_folders
from monitor.workflow.intake.withdrawals import WithdrawRequest, withdraw

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
NAMES = ("five-days", "load-cell", "tracked-robot", "nothing-hidden")


def test_some_campaigns_are_those_of_the_view(tmp_path: Path) -> None:
    with Database(tmp_path / "shop.duckdb", threads=1) as db:
        import_folders(db, ImportRequest([EXAMPLES / name for name in NAMES]))
        every = list_campaigns(db)
        assert [row.campaign for row in every] == list(NAMES)
        assert every[1].rows == 44
        for row in every:
            assert list_campaigns(db, campaign=row.campaign) == (row,)
            assert list_campaigns(db, row.machine) == tuple(
                other for other in every if other.machine == row.machine
            )
            assert list_campaigns(db, "another", row.campaign) == ()
        assert list_campaigns(db, latest=2) == every[-2:]
        assert list_campaigns(db, latest=50) == every
        withdraw(db, WithdrawRequest("five-days", "a trial"))
        assert list_campaigns(db, campaign="five-days") == ()
        assert list_campaigns(db, every[0].machine) == (every[3],)
        answer = campaigns(db, CampaignsRequest(machine=every[0].machine))
        assert [row.campaign for row in answer.withdrawn] == ["five-days"]
        assert campaigns(db, CampaignsRequest(campaign="load-cell")).withdrawn == ()
        with pytest.raises(InputError, match="from 1 to 1000000"):
            CampaignsRequest(latest=0)
