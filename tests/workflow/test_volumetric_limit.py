"""A limit of the volumetric error binds the weekly report and the fleet as it does the trend page."""

import json
import shutil
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from scipy import stats

from monitor.cli import main
from monitor.cli.trend_output import _volumetric
from monitor.documents import from_document, to_document
from monitor.readers import read_campaign
from monitor.reporting.health.page import _map
from monitor.reporting.health.records import VolumetricMap
from monitor.reporting.lacks import Lack
from monitor.store import Database, import_campaign, machine_history
from monitor.workflow.fleet.fleet import fleet
from monitor.workflow.fleet.request import FleetRequest
from monitor.workflow.health.map import probability_beyond, stated_map
from monitor.workflow.health.verdict import Conformity, state_of, with_volumetric
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.trend.answer import VolumetricForecast
from monitor.workflow.trend.volumetric import _vectors
from monitor.workflow.volumetric.request import VolumetricRequest
from monitor.workflow.volumetric.volumetric import volumetric_map


@dataclass(frozen=True)
class _Page:
    """As a page of the report has its map."""

    map: VolumetricMap | None


EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "five-days"
NOTHING = SimpleNamespace(suspect=())


@pytest.fixture(scope="module")
def limited(tmp_path_factory):
    """A machine whose file allows 150 µm, identified and mapped: about 187 µm at worst. Map, rows before, rows
    after."""
    folder = tmp_path_factory.mktemp("limited")
    campaign = read_campaign(EXAMPLE)
    machine = replace(campaign.machine, tolerances={"volumetric": 150.0, "EXX": 300.0})
    with Database(folder / "limited.duckdb") as db:
        import_campaign(db, replace(campaign, machine=machine))
        identify(db, IdentifyRequest("five-days"))
        before = fleet(db, FleetRequest(top=0))
        mapped = volumetric_map(db, VolumetricRequest("five-days", 20, points=2))
        return mapped, before, fleet(db, FleetRequest(top=0))


def test_the_fleet_says_out_of_tolerance_first_and_before_a_map_that_the_limit_is_not_judged(limited):
    mapped, before, after = limited
    unjudged = [row for row in before.table if row.parameter == "volumetric error"]
    assert [row.attention for row in unjudged] == [
        "limit not judged: no map is stored (monitor map CAMPAIGN)"
    ]
    first = after.table[0]
    assert (first.rank, first.parameter, first.attention) == (1, "volumetric error", "out of tolerance")
    assert (first.limit, first.latest) == (150.0, pytest.approx(mapped.worst.error_um))
    assert after.attention["out of tolerance"] == 1
    assert [row.rank for row in after.table] == list(range(1, 15))


def test_jcgm106_7_probability_beyond_the_limit(limited):
    mapped, _, _ = limited
    limit = mapped.worst.error_um + 0.5 * mapped.worst.u_um
    expected = stats.t(mapped.degrees_of_freedom).sf(0.5)
    assert probability_beyond(mapped, limit) == pytest.approx(expected, rel=1e-9)


def test_the_report_is_out_of_tolerance_where_only_the_volumetric_error_is(limited):
    mapped, _, _ = limited
    within = Conformity({"EXX": 0.001}, 0.001, every_has_one=True)
    assert state_of(within, (), None, NOTHING, 0.05, evaluated=True) == "in tolerance"
    assert state_of(within, (), None, NOTHING, 0.05, evaluated=False) == "not evaluated"
    beyond = with_volumetric(within, probability_beyond(mapped, 150.0))
    assert state_of(beyond, (), None, NOTHING, 0.05, evaluated=True) == "out of tolerance"
    assert (
        state_of(with_volumetric(within, 0.06), (), None, NOTHING, 0.05, evaluated=True)
        == "may be out of tolerance"
    )
    # Without a tolerance of any parameter the limit alone judges.
    alone = with_volumetric(Conformity({}, None, every_has_one=False), 0.9)
    assert state_of(alone, (), None, NOTHING, 0.05, evaluated=True) == "out of tolerance"
    lines = dict(_map(stated_map(mapped, 150.0, 0.999999)))
    assert lines["limit"] == "150.0 µm for the worst: beyond it, P(out): > 99.9 %"


def test_beyond_the_limit_is_said_as_since_when_and_not_as_a_day_that_is_past():
    ahead = VolumetricForecast(
        limit_um=60.0, latest_um=61.3, crosses_limit_at="2026-03-06T12:00:00", crosses_limit_interval=None,
        next_check="2026-04-06T12:00:00", predicted_um=62.0, predicted_interval_um=(58.0, 66.0),
        in_tolerance_at_next_check=0.2, recommended_interval_days=0.0, beyond_since="2026-02-20T08:00:00", method="",
        why=None,
    )  # fmt: skip
    first = next(_volumetric(ahead, "2026-03-06T12:00:00"))
    assert first.endswith("limit 60 µm; already beyond it since 2026-02-20")
    later = replace(ahead, latest_um=55.0, crosses_limit_at="2026-05-01T00:00:00", beyond_since=None)
    assert "reaches its limit on 2026-05-01" in next(_volumetric(later, "2026-03-06T12:00:00"))


def test_trend_judges_the_last_map_where_it_foretells_nothing(tmp_path, capsys):
    """Five days have no drift of a year: the page said only that, beside 187 µm of 150."""
    folder = tmp_path / "five-days"
    shutil.copytree(EXAMPLE, folder)
    with (folder / "campaign.toml").open("a", encoding="utf-8") as file:
        file.write("\n[machine.tolerances]\nvolumetric = 150.0\n")
    asked = ["--db", str(tmp_path / "m.duckdb")]

    def said(*words: str) -> str:
        capsys.readouterr()
        assert main([*asked, *words]) == 0
        return capsys.readouterr().out

    said("import", str(folder))
    said("identify", "five-days")
    assert "extrapolate; its limit, 150 µm, is not judged: no map is stored (monitor map CAMPAIGN)\n" in said(
        "trend", "HU40-T"
    )
    mapped = json.loads(said("map", "five-days", "--points", "2", "--json"))["worst"]["error_um"]
    assert f"{mapped:.0f} µm at worst in the last map stored, limit 150 µm: out of tolerance" in said(
        "trend", "HU40-T"
    )
    assert json.loads(said("trend", "HU40-T", "--json"))["volumetric_error"]["mapped_um"] == mapped


def test_a_forecast_that_lacks_the_place_of_the_tool_says_that_a_map_does_not_need_it(tmp_path):
    """The page said that the method does not find the place of the tool, and to compute a map."""
    with Database(tmp_path / "m.duckdb") as db:
        import_campaign(db, read_campaign(EXAMPLE.parent / "r-test"))
        identify(db, IdentifyRequest("r-test"))
        history = machine_history(db, "CENTRE-4")
        why = _vectors(db, history, None, dict.fromkeys(history.parameters, 1.0))
        assert volumetric_map(db, VolumetricRequest("r-test", points=2)).worst.error_um > 1.0
    assert isinstance(why, Lack)
    ahead = VolumetricForecast(limit_um=20.0, next_check=None, method="", why=why)
    assert list(_volumetric(ahead, "")) == [
        "no forecast of the volumetric error: it needs the place of the tool, which this method does not find; a map "
        "does not need it; its limit, 20 µm, is not judged: no map is stored (monitor map CAMPAIGN)"
    ]


def test_a_report_of_before_the_limit_is_still_read(limited):
    mapped, _, _ = limited
    document = to_document(_Page(stated_map(mapped)))
    assert not {"limit_um", "probability_out"} & set(document["map"])
    assert to_document(from_document(_Page, document)) == document
