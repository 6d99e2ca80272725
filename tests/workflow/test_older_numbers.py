"""After a new version of a model the fleet has the numbers of the version before, and says so."""

from __future__ import annotations

from pathlib import Path

import pytest

from monitor.cli import main
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.store import (
    Database,
    import_campaign,
    not_identified,
    numbered_by,
    save_machine_model,
    save_model,
)
from monitor.workflow.fleet.answer import FleetAnswer, OlderVersion
from monitor.workflow.fleet.fleet import fleet
from monitor.workflow.fleet.request import FleetRequest
from monitor.workflow.history.values import ValuesRequest, values_of_machine
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import trend
from tests.store.test_fleet import keep

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
#: Two campaigns of one method on two machines.
CAMPAIGNS = {"HU40-T": "hidden-spindle-growth", "HU40-S": "steel-bar"}
EFFECT = "EZC1:const@warmup"


@pytest.fixture
def shop(tmp_path: Path) -> Path:
    """A database whose two machines were identified by the first version, of which a second was made since."""
    path = tmp_path / "monitor.duckdb"
    with Database(path, threads=1) as db:
        for campaign in CAMPAIGNS.values():
            measured = read_campaign(EXAMPLES / campaign)
            assert isinstance(measured, Campaign)
            import_campaign(db, measured)
            identify(db, IdentifyRequest(campaign))
    return path


def _numbers(answer: FleetAnswer) -> dict[tuple[str, str], float | None]:
    return {(row.machine, row.parameter): row.latest for row in answer.table}


def _second_version(db: Database) -> None:
    save_model(db, "samba", (EFFECT,), parent=("samba", 1))


def test_the_fleet_keeps_its_numbers_and_says_which_version_they_are_of(shop: Path) -> None:
    with Database(shop, threads=1) as db:
        before = fleet(db, FleetRequest(top=0))
        assert before.older_versions is None
        _second_version(db)
        after = fleet(db, FleetRequest(top=0))
        assert _numbers(after) == _numbers(before)
        older = (OlderVersion("samba@1", "samba@2"),)
        assert after.older_versions == dict.fromkeys(sorted(_machines(before)), older)
        # They have a part in it; what waits to be identified by the newest is what it was.
        assert (after.not_identified, after.without_numbers) == ((), None)
        assert not_identified(db) == tuple(sorted(CAMPAIGNS.values()))
        # A version that is named is meant.
        assert fleet(db, FleetRequest("samba@1", top=0)).older_versions is None


def _machines(answer: FleetAnswer) -> set[str]:
    return {row.machine for row in answer.table}


def test_a_machine_has_the_newest_numbers_as_soon_as_one_campaign_does(shop: Path) -> None:
    with Database(shop, threads=1) as db:
        before = _numbers(fleet(db, FleetRequest(top=0)))
        _second_version(db)
        identify(db, IdentifyRequest("hidden-spindle-growth"))
        after = fleet(db, FleetRequest(top=0))
        growing = "HU40-T"
        (other,) = _machines(after) - {growing}
        assert after.older_versions == {other: (OlderVersion("samba@1", "samba@2"),)}
        # That machine's are of the second version alone, which has the effect; the other's are what they were.
        assert (growing, EFFECT) in _numbers(after)
        assert (growing, EFFECT) not in before
        assert {key: value for key, value in before.items() if key[0] == other} == {
            key: value for key, value in _numbers(after).items() if key[0] == other
        }
        assert numbered_by(db, growing)["samba"] == ("samba", 2)
        assert numbered_by(db, other)["samba"] == ("samba", 1)


def test_a_machine_with_a_model_of_its_own_is_not_behind(shop: Path) -> None:
    with Database(shop, threads=1) as db:
        save_machine_model(db, "HU40-T", "samba", ("samba", 1), "as delivered")
        _second_version(db)
        assert "HU40-T" not in (fleet(db, FleetRequest()).older_versions or {})


def test_a_trend_that_may_not_identify_has_the_same_numbers_and_says_so(shop: Path) -> None:
    with Database(shop, threads=1) as db:
        _second_version(db)
    with Database(shop, threads=1, read_only=True) as db:
        answer = trend(db, TrendRequest("HU40-T"))
        values = values_of_machine(db, ValuesRequest("HU40-T"))
        ranked = _numbers(fleet(db, FleetRequest(top=0)))
    said = (
        "the numbers of HU40-T are of samba@1, the newest version that all its campaigns have; samba@2 is newer: "
        "type `monitor identify`"
    )
    assert said in answer.notes
    assert answer.runs == len(values.run) > 0
    assert set(values.parameters) == {parameter for machine, parameter in ranked if machine == "HU40-T"}
    # Where it may, it identifies first, and there is nothing to say.
    with Database(shop, threads=1) as db:
        newest = trend(db, TrendRequest("HU40-T"))
    assert EFFECT in newest.parameters
    assert not any("samba@1" in note for note in newest.notes)


def test_the_command_line_says_it(shop: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with Database(shop, threads=1) as db:
        _second_version(db)
    assert main(["fleet", "--db", str(shop)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "the numbers of HU40-T are of samba@1" in said
    assert "left out" not in said


def test_one_campaign_of_two_by_the_newest_moves_nothing_and_drops_none(tmp_path: Path) -> None:
    """Looking at one campaign identifies it by the newest version; the history of the machine stays whole."""
    with Database(tmp_path / "monitor.duckdb", threads=1) as db:
        save_model(db, "samba", ())
        for campaign in ("a-1", "a-2"):
            keep(db, "A", [[1.0, 1.1, 0.9]], campaign)
        before = fleet(db, FleetRequest(top=0))
        save_model(db, "samba", (EFFECT,), parent=("samba", 1))
        _keep_by(db, "a-2", 2)
        after = fleet(db, FleetRequest(top=0))
        assert numbered_by(db, "A")["samba"] == ("samba", 1)
        assert (after.table, after.left_out) == (before.table, None)
        assert after.older_versions == {"A": (OlderVersion("samba@1", "samba@2"),)}
        # No version has all: the newest one then, and what it lacks is named with its machine.
        _keep_by(db, "a-3", 2)
        part = fleet(db, FleetRequest(top=0))
        assert (part.left_out, part.older_versions) == ({"A": ("a-1",)}, None)
        _keep_by(db, "a-1", 2)
        whole = fleet(db, FleetRequest(top=0))
        assert (numbered_by(db, "A")["samba"], whole.left_out) == (("samba", 2), None)
        assert _numbers(whole) == {("A", "EXX"): pytest.approx(5.0)}


def _keep_by(db: Database, campaign: str, version: int) -> None:
    """Keep an identification by another version, with values of its own."""
    number = keep(db, "A", [[5.0, 5.1, 4.9]], campaign)
    db.execute("UPDATE identification SET model_version = ? WHERE identification_id = ?", [version, number])
