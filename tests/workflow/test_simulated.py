"""A campaign that nobody measured says so wherever its numbers stand, also beside one that was measured."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from by_path import TESTS, load
from openpyxl import load_workbook

from monitor.cli import main
from monitor.readers import read_campaign
from monitor.reporting.health.page import machine_pages
from monitor.store import Database, export_workbook, import_campaign, list_campaigns
from monitor.workflow.fleet.fleet import fleet
from monitor.workflow.fleet.request import FleetRequest
from monitor.workflow.health.report import stored_health
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import trend

report = load("answers", TESTS / "answers.py").report
EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
#: Campaigns of the machine; the last is simulated, of a machine of its own.
REHEARSAL, MEASURED, ALONE = "hidden-reversal-x", "nothing-hidden", "alone"
MACHINE, OWN = "HU40-T", "rehearsal"
SIMULATED = {REHEARSAL: True, MEASURED: False, ALONE: True}


def imported(db: Database, folder: Path, example: str, **replaced: str) -> None:
    """Import and identify a copy of an example with keys of its campaign.toml replaced; it is simulated."""
    shutil.copytree(EXAMPLES / example, folder)
    file = folder / "campaign.toml"
    text = file.read_text(encoding="utf-8").replace("[machine]\n", "[machine]\nvirtual = true\n", 1)
    for key, value in replaced.items():
        text = text.replace(f'{key} = "{example if key == "campaign" else MACHINE}"', f'{key} = "{value}"', 1)
    file.write_text(text, encoding="utf-8")
    campaign = read_campaign(folder)
    import_campaign(db, campaign)
    identify(db, IdentifyRequest(campaign.name))


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database of a machine with a simulated campaign beside a measured one, and of one that was simulated alone."""
    where = tmp_path_factory.mktemp("simulated")
    with Database(where / "a.duckdb", threads=1) as db:
        imported(db, where / "a", REHEARSAL)
        import_campaign(db, read_campaign(EXAMPLES / MEASURED))
        identify(db, IdentifyRequest(MEASURED))
        imported(db, where / "b", MEASURED, campaign=ALONE, id=OWN)
    return where / "a.duckdb"


def test_lists_and_views(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with Database(path, threads=1) as db:
        assert {row.campaign: row.simulated for row in list_campaigns(db)} == SIMULATED
        of_machine = list_campaigns(db, machine=MACHINE)
        assert {row.campaign: row.simulated for row in of_machine} == {REHEARSAL: True, MEASURED: False}
        assert dict(db.rows("SELECT campaign, simulated FROM v_campaigns")) == SIMULATED
    assert main(["--db", str(path), "campaigns"]) == 0
    lines = capsys.readouterr().out.splitlines()
    shown = {name: next(line for line in lines if name in line) for name in SIMULATED}
    assert {name: "simulated" in line for name, line in shown.items()} == SIMULATED


def test_workbook(path: Path, tmp_path: Path) -> None:
    with Database(path, threads=1) as db:
        written = export_workbook(db, tmp_path / "shop.xlsx")
    about = list(load_workbook(written)["about"].iter_rows(values_only=True))
    assert {row[1] for row in about if row[0] == "campaign"} == {REHEARSAL, ALONE}
    assert ("campaign", ALONE, "simulated, nobody measured it") in about


def test_trend_and_fleet(path: Path) -> None:
    with Database(path, threads=1) as db:
        table = fleet(db, FleetRequest())
        mixed, alone = (trend(db, TrendRequest(machine)) for machine in (MACHINE, OWN))
        measured = trend(db, TrendRequest(MACHINE, campaigns=(MEASURED,)))
    assert table.simulated == {MACHINE: (REHEARSAL,), OWN: (ALONE,)}
    assert any(f"simulated readings stand among measured ones: {REHEARSAL};" in note for note in mixed.notes)
    assert f"simulated readings, nobody measured them: {ALONE}" in alone.notes
    assert not any("simulated" in note for note in measured.notes)


def test_fleet_in_words(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--db", str(path), "fleet", "--top", "1"]) == 0
    assert (
        f"simulated, nobody measured it: {MACHINE} (1 campaign), {OWN} (1 campaign)"
        in capsys.readouterr().out
    )


def test_weekly_report(path: Path, tmp_path: Path) -> None:
    with Database(path, threads=1) as db:
        report(db, machine=OWN, out=tmp_path)
        ((number,),) = db.rows("SELECT analysis_id FROM v_analyses WHERE kind = 'health'")
        health = stored_health(db, number)
    (page,) = machine_pages([health])
    assert str(page.health.description).endswith(", simulated readings")
    assert any(f"nobody measured them: {ALONE}" in str(remark) for remark in page.health.quality.remarks)
