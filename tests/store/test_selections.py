"""Named selections of runs: kept with their condition, the latest counts, and the audit knows them."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from monitor.exceptions import InputError, NotFoundError
from monitor.records import Campaign
from monitor.store import (
    Database,
    find_selection,
    import_campaign,
    list_selections,
    save_selection,
    verify_audit,
)


@pytest.fixture
def campaign(db: Database, make_campaign: Callable[..., Campaign]) -> Campaign:
    made = make_campaign()
    import_campaign(db, made)
    return made


def test_comes_back_as_it_was_stored(db: Database, campaign: Campaign) -> None:
    runs = [run.run for run in campaign.runs]
    number = save_selection(db, campaign.name, 'it\'s "warm"', "warm_up == 1", [*reversed(runs), runs[0]])
    found = find_selection(db, 'it\'s "warm"')
    assert (found.number, found.campaign, found.condition) == (number, campaign.name, "warm_up == 1")
    assert found.runs == tuple(sorted(runs))
    assert [row.run_count for row in list_selections(db)] == [len(runs)]


def test_the_latest_of_a_name_counts_and_the_earlier_stays(db: Database, campaign: Campaign) -> None:
    runs = [run.run for run in campaign.runs]
    save_selection(db, campaign.name, "cold", "hours >= 6", runs)
    save_selection(db, campaign.name, "cold", "hours >= 8", runs[1:])
    assert find_selection(db, "cold").runs == tuple(runs[1:])
    assert len(list_selections(db, campaign.name)) == 1
    assert db.rows("SELECT count(*) FROM selection") == [(2,)]


def test_two_campaigns_may_have_one_name_and_then_the_campaign_is_asked_for(
    db: Database, campaign: Campaign, make_campaign: Callable[..., Campaign]
) -> None:
    other = make_campaign("other")
    import_campaign(db, other)
    for name in (campaign.name, other.name):
        save_selection(db, name, "cold", "run > 0", [campaign.runs[0].run])
    assert find_selection(db, "cold", other.name).campaign == other.name
    with pytest.raises(
        InputError, match=r"selection 'cold' exists for several campaigns \(.*other.*\); name"
    ):
        find_selection(db, "cold")


def test_refusals_say_what_is_there(db: Database, campaign: Campaign) -> None:
    with pytest.raises(
        NotFoundError, match="there is no selection 'cold'; `monitor select CAMPAIGN --name cold"
    ):
        find_selection(db, "cold")
    with pytest.raises(InputError, match="a selection needs a name"):
        save_selection(db, campaign.name, " ", "run > 0", [1])
    with pytest.raises(InputError, match="selection none holds no run"):
        save_selection(db, campaign.name, "none", "run > 99", [])
    with pytest.raises(NotFoundError, match="has no run 99"):
        save_selection(db, campaign.name, "strange", "run > 98", [99])
    save_selection(db, campaign.name, "warm", "run > 0", [campaign.runs[0].run])
    with pytest.raises(NotFoundError, match=r"there is no selection 'cold'; there are warm \(of "):
        find_selection(db, "cold")


def test_an_altered_selection_is_seen(db: Database, campaign: Campaign) -> None:
    number = save_selection(db, campaign.name, "warm", "run > 0", [campaign.runs[0].run])
    assert verify_audit(db).faults == ()
    db.execute("UPDATE selection SET runs = [99::BIGINT]")
    assert verify_audit(db).faults == (f"selection {number} was altered after it was stored",)
