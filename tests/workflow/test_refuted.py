"""Values of a model that the readings refute are followed with a word about it, read from what was stored."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import scipy.stats
from by_path import TESTS, load

from monitor.cli import main
from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.readers import read_campaign
from monitor.reporting.health.page import machine_pages
from monitor.store import (
    Database,
    LackOfFit,
    StoredIdentification,
    import_campaign,
    load_identification,
    machine_history,
    verify_audit,
)
from monitor.workflow.fleet.fleet import fleet
from monitor.workflow.fleet.request import FleetRequest
from monitor.workflow.health.report import stored_health
from monitor.workflow.history.refuted import REFUTED_P, ModelRefuted, RefutedCampaign, model_refuted
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.lack_of_fit import lack_of_fit
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import trend

wrong = load("gross_readings", TESTS / "discovery" / "gross_readings.py")
report = load("answers", TESTS / "answers.py").report
EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
REFUTED, RIGHT = "hidden-reversal-x", "nothing-hidden"


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    """Two campaigns of one machine, the later one without what the earlier one hides."""
    with Database(tmp_path_factory.mktemp("refuted") / "a.duckdb", threads=1) as database:
        for example in (REFUTED, RIGHT):
            import_campaign(database, read_campaign(EXAMPLES / example))
            identify(database, IdentifyRequest(example))
        yield database


def f_test(identification: StoredIdentification) -> float:
    """Lack of fit of readings with independent noise, from the stored residuals alone: what the runs share, against
    what they do not."""
    residuals = np.array([run.residuals for run in identification.runs])
    runs, freedom = len(residuals), identification.runs[0].degrees_of_freedom
    mean = residuals.mean(axis=0)
    shared = runs * np.sum(mean**2) / freedom
    scatter = np.sum((residuals - mean) ** 2) / (freedom * (runs - 1))
    return float(scipy.stats.f.sf(shared / scatter, freedom, freedom * (runs - 1)))


@pytest.mark.parametrize("example", [REFUTED, RIGHT])
def test_what_is_stored_is_the_f_test_of_the_stored_residuals(db: Database, example: str) -> None:
    stored = load_identification(db, example)
    assert stored.lack_of_fit is not None
    assert stored.lack_of_fit.p_value == pytest.approx(f_test(stored), rel=1e-6, abs=1e-12)
    assert db.rows("SELECT p_value FROM v_lack_of_fit WHERE campaign = ?", [example]) == [
        (stored.lack_of_fit.p_value,)
    ]


def test_trend_says_which_campaigns_refute_the_model_and_what_to_type(db: Database) -> None:
    answer = trend(db, TrendRequest("HU40-T"))
    assert answer.model_refuted == ModelRefuted((RefutedCampaign(REFUTED, "samba", 0.0),), 2)
    (said,) = [note for note in answer.notes if "refute" in note]
    assert said.startswith(
        f"the readings of {REFUTED} refute the model samba beyond noise (lack of fit, p < 0.0001); of 2 campaigns"
    )
    assert said.endswith(f"type `monitor explain {REFUTED}`")
    right = trend(db, TrendRequest("HU40-T", campaigns=(RIGHT,)))
    assert right.model_refuted is None
    assert not [note for note in right.notes if "refute" in note]


def test_the_fleet_names_machines_by_their_latest_campaign(
    db: Database, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    latest = max((REFUTED, RIGHT), key=lambda name: db.rows(
        "SELECT max(started_at) FROM run JOIN campaign USING (campaign_id) WHERE campaign = ?", [name]
    )[0][0])  # fmt: skip
    expected = {"HU40-T": RefutedCampaign(REFUTED, "samba", 0.0)} if latest == REFUTED else None
    assert fleet(db, FleetRequest()).models_refuted == expected
    path = tmp_path / "b.duckdb"
    for words in (["import", str(EXAMPLES / REFUTED)], ["identify", REFUTED], ["fleet"]):
        assert main(["--db", str(path), *words]) == 0
    said = capsys.readouterr().out
    assert f"refute the model that the values come from: HU40-T ({REFUTED}); type `monitor explain" in said


@pytest.mark.slow
def test_the_weekly_page_says_it_of_the_whole_campaign(tmp_path: Path) -> None:
    pages = {}
    for example in (REFUTED, RIGHT):
        with Database(tmp_path / f"{example}.duckdb", threads=1) as own:
            import_campaign(own, read_campaign(EXAMPLES / example))
            ((last,),) = own.rows("SELECT max(started_at) FROM run")
            year, week, _ = last.isocalendar()
            named = f"{year}-W{week:02d}"
            report(own, named, out=tmp_path)
            ((number,),) = own.rows("SELECT analysis_id FROM v_analyses WHERE kind = 'health'")
            health = stored_health(own, number)
            pages[example] = health.model
            (page,) = machine_pages([health])
            assert ("refuted" in dict(page.fit)) == (example == REFUTED)
    assert pages[REFUTED].refuted_p == 0.0
    assert pages[RIGHT].refuted_p is None


def test_identifications_of_before_are_not_judged_and_identifying_again_judges_them(tmp_path: Path) -> None:
    with Database(tmp_path / "old.duckdb", threads=1) as old:
        import_campaign(old, read_campaign(EXAMPLES / REFUTED))
        identify(old, IdentifyRequest(REFUTED))
        # What an older version stored: no row, and a hash without it.
        old.execute("DELETE FROM lack_of_fit")
        assert load_identification(old, REFUTED).lack_of_fit is None
        assert verify_audit(old).faults != ()
        assert machine_history(old, "HU40-T").fits == {}
        assert model_refuted(machine_history(old, "HU40-T")) is None
        assert fleet(old, FleetRequest()).models_refuted is None
        assert trend(old, TrendRequest("HU40-T")).model_refuted is None
        identify(old, IdentifyRequest(REFUTED))
        assert trend(old, TrendRequest("HU40-T")).model_refuted is not None


def test_one_run_of_several_has_nothing_to_compare(tmp_path: Path) -> None:
    with Database(tmp_path / "a.duckdb", threads=1) as own:
        import_campaign(own, read_campaign(EXAMPLES / REFUTED))
        identify(own, IdentifyRequest(REFUTED, run=3))
        assert load_identification(own, REFUTED).lack_of_fit == LackOfFit(None)
        assert own.rows("SELECT p_value FROM v_lack_of_fit") == [(None,)]


def test_a_gross_reading_does_not_hide_what_the_runs_share() -> None:
    """Five millimetres in one touch of one run are the scatter that what is missing would be held against."""
    campaign = read_campaign(EXAMPLES / REFUTED)
    row = int(np.flatnonzero(campaign.probings.run == 2)[17])
    spoiled = wrong.with_wrong_reading(campaign, row, "Y", 5.0)
    problem = campaign_method(spoiled).problem_of(spoiled, campaign_method(spoiled).own_model)
    solution = solve_problem(problem)
    assert lack_of_fit(problem, solution, is_gross=False).p_value > REFUTED_P
    assert lack_of_fit(problem, solution, is_gross=True).p_value < REFUTED_P
