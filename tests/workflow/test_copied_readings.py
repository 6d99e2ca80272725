"""Readings that are copies, of another campaign or of rows before them, are told with every answer about a campaign."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.documents import from_document, to_document
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.reporting.certificate.completeness import RefusedGroundsError
from monitor.reporting.certificate.grounds import AT_ANOTHER_TIME, Ground, GroundKind, ground_sentence
from monitor.reporting.run_notes import RowsRepeated
from monitor.reporting.texts import texts_of
from monitor.store import Database, import_campaign, load_campaign, withdraw_campaign
from monitor.workflow.certificate.copies import copied_grounds
from monitor.workflow.certificate.issue import issue
from monitor.workflow.certificate.request import CertificateRequest
from monitor.workflow.copied_readings import MOST_NAMED, copied_readings, copies_in_history
from monitor.workflow.explain.compare import compare
from monitor.workflow.explain.request import CompareRequest, ExplainRequest
from monitor.workflow.identify.answer import IdentifyAnswer
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.instruments.instruments import instruments
from monitor.workflow.instruments.request import InstrumentsRequest
from monitor.workflow.intake.campaigns import RunsRequest, campaigns, runs
from monitor.workflow.run_statistics.request import StatisticsRequest
from monitor.workflow.run_statistics.statistics import stats
from monitor.workflow.standards.request import StandardsRequest
from monitor.workflow.standards.standards import standards
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import trend
from monitor.workflow.uncertainty.evaluation import uncertainty
from monitor.workflow.uncertainty.request import UncertaintyRequest
from monitor.workflow.volumetric.over_stroke import OverStrokeRequest, over_stroke
from monitor.workflow.volumetric.request import VolumetricRequest
from monitor.workflow.volumetric.volumetric import volumetric_map

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.fixture(scope="module")
def table() -> Campaign:
    campaign = read_campaign(EXAMPLES / "r-test")
    assert isinstance(campaign, Campaign)
    return campaign


def under(campaign: Campaign, name: str, machine: str) -> Campaign:
    """The campaign under another name, of another machine."""
    return replace(campaign, name=name, machine=replace(campaign.machine, id=machine), files=())


def later(campaign: Campaign, name: str) -> Campaign:
    """The campaign under another name, begun on the next day."""
    moved = [
        replace(run, started_at=run.started_at.replace(day=run.started_at.day + 1)) for run in campaign.runs
    ]
    return replace(campaign, name=name, runs=tuple(moved), files=())


def exported_twice(campaign: Campaign, name: str) -> Campaign:
    """The campaign with every row once more behind the last."""
    count = len(campaign.probings)
    probings = campaign.probings.rows(np.tile(np.arange(count), 2))
    numbered = replace(probings, sequence=np.arange(1, 2 * count + 1), time=60.0 * np.arange(2 * count))
    return replace(campaign, name=name, probings=numbered, files=())


@pytest.fixture
def db(table: Campaign) -> Iterator[Database]:
    """A campaign; the same of another machine, by another name, and of the next day; one with its rows twice."""
    with Database(":memory:") as db:
        import_campaign(db, table)
        import_campaign(db, under(table, "other", "CENTRE-5"))
        import_campaign(db, replace(table, name="again", files=()))
        import_campaign(db, later(table, "next-day"))
        twice = exported_twice(table, "twice")
        import_campaign(db, replace(twice, machine=replace(twice.machine, id="CENTRE-6")), ["rows twice"])
        yield db


def test_every_answer_says_that_its_readings_are_copies(db: Database) -> None:
    said = copied_readings(db, load_campaign(db, "other"))
    assert said is not None
    assert str(said[0]).startswith("1 run of other equals those of 3 campaigns in every reading")
    identified = identify(db, IdentifyRequest("other"))
    assert identified.copied_readings == said
    assert compare(db, CompareRequest("other")).copied_readings == said
    assert runs(db, RunsRequest("other")).notes == said
    restored = from_document(IdentifyAnswer, to_document(identified))
    assert [str(each) for each in restored.copied_readings or ()] == [str(each) for each in said]
    # What is stored outlives a withdrawal, and so does not say it.
    (stored,) = db.rows("SELECT CAST(document AS VARCHAR) FROM analysis WHERE kind = 'comparison'")
    assert "copied_readings" not in stored[0]
    for copy in ("r-test", "again", "next-day"):
        withdraw_campaign(db, copy, "a copy")
    assert identify(db, IdentifyRequest("other")).copied_readings is None


def test_a_history_says_which_of_its_campaigns_hold_runs_of_others(db: Database) -> None:
    said = [str(each) for each in trend(db, TrendRequest("CENTRE-4")).copied_readings or ()]
    never = "in every reading, which two measurements never do: withdraw the copy (monitor withdraw)"
    assert said == [
        f"1 run of other equals those of r-test {never}".replace(
            "r-test in", "r-test of machine CENTRE-4 in"
        ),
        f"1 run of again equals those of r-test {never}",
        f"1 run of next-day equals those of r-test {never}",
    ]
    assert len(trend(db, TrendRequest("CENTRE-4", campaigns=("again",))).copied_readings or ()) == 1
    # Rows that a run repeats are not looked for in a history.
    assert trend(db, TrendRequest("CENTRE-6")).copied_readings is None
    # What is stored outlives a withdrawal, and so does not say it.
    (stored,) = db.rows(
        "SELECT CAST(document AS VARCHAR) FROM analysis WHERE kind = 'trend' AND machine = 'CENTRE-4'"
    )
    assert "copied_readings" not in stored[0]


@pytest.mark.slow
def test_of_many_copies_in_a_history_the_first_are_named(table: Campaign) -> None:
    with Database(":memory:") as db:
        for number in range(MOST_NAMED + 3):
            import_campaign(db, replace(table, name=f"copy-{number}", files=()))
        said = copies_in_history(db, ["copy-0"])
        assert said is not None
        assert len(said) == MOST_NAMED + 1
        assert said[-1] == "2 more campaigns hold runs of others; `monitor campaigns` names all"
        assert copies_in_history(db, []) is None


def test_a_map_tests_of_standards_and_shares_of_instruments_say_it(db: Database) -> None:
    said = copied_readings(db, load_campaign(db, "other"))
    assert standards(db, StandardsRequest("other")).copied_readings == said
    assert instruments(db, InstrumentsRequest("other")).copied_readings == said
    mapped = volumetric_map(db, VolumetricRequest("other", 1, points=2))
    assert mapped.copied_readings == said
    (stored,) = db.rows("SELECT CAST(document AS VARCHAR) FROM analysis WHERE kind = 'volumetric map'")
    assert "copied_readings" not in stored[0]


@pytest.mark.slow
def test_statistics_of_runs_and_the_map_of_a_page_say_it(tmp_path: Path) -> None:
    measured = read_campaign(EXAMPLES / "l-shape")
    assert isinstance(measured, Campaign)
    with Database(tmp_path / "m.duckdb") as db:
        import_campaign(db, measured)
        import_campaign(db, replace(measured, name="again", files=()))
        said = copied_readings(db, load_campaign(db, "again"))
        assert said is not None
        assert stats(db, StatisticsRequest("again")).copied_readings == said
        assert over_stroke(db, OverStrokeRequest("again", points=2)).map.copied_readings == said


@pytest.mark.slow
def test_rows_that_repeat_earlier_ones_are_told_where_numbers_are(db: Database) -> None:
    said = (RowsRepeated(1, 25, 26, 1, may_be_passes=False),)
    assert identify(db, IdentifyRequest("twice")).copied_readings == said
    assert compare(db, CompareRequest("twice")).copied_readings == said
    assert uncertainty(db, UncertaintyRequest("twice", 1, method="guf")).copied_readings == said
    assert "u and the repeatability come out too small, the degrees of freedom" in str(said[0])
    assert "or the display hides the scatter" in str(replace(said[0], may_be_passes=True))
    listed = campaigns(db)
    assert listed.noted == {"twice": 1}
    assert [each.campaign for each in listed.copied or ()] == ["other", "again", "next-day"]


@pytest.mark.slow
def test_no_certificate_of_copies_but_for_one_measurement_under_two_names(db: Database) -> None:
    def of(name: str) -> list[Ground]:
        return list(copied_grounds(db, load_campaign(db, name)))

    copied, rows = GroundKind.COPIED_RUNS, GroundKind.COPIED_ROWS
    assert of("twice") == [Ground(rows, 1, "26 = 1", 25)]
    assert of("r-test") == [Ground(copied, 1, "other (CENTRE-5)", 1)]
    assert of("next-day")[-1] == Ground(copied, 1, "again", 1, None, AT_ANOTHER_TIME)
    assert "with another started_at" in ground_sentence(of("next-day")[-1], texts_of())
    withdraw_campaign(db, "other", "a copy")
    assert of("r-test") == of("again") == []
    assert [ground.subject for ground in of("next-day")] == ["r-test", "again"]


def test_a_certificate_of_copies_is_refused_with_what_to_do(db: Database, tmp_path: Path) -> None:
    shutil.copy(EXAMPLES / "laboratory.toml", tmp_path)
    request = CertificateRequest("twice", 1, laboratory=tmp_path / "laboratory.toml", out=tmp_path / "out")
    with pytest.raises(
        RefusedGroundsError, match=r"copied-rows: run 1: 25 rows equal earlier ones in every number"
    ):
        issue(db, request)
    assert not (tmp_path / "out").exists() or not list((tmp_path / "out").iterdir())


@pytest.mark.slow
def test_an_explanation_says_it_too(db: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    from monitor.workflow.explain import explain as module

    answer = module.explain(db, ExplainRequest("r-test"))
    assert [str(each)[:29] for each in answer.copied_readings or ()] == ["1 run of r-test equals those "]
