"""The steps from folder to certificate as functions: what they store, refuse and leave alone."""

from __future__ import annotations

import shutil
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from monitor.exceptions import InputError, NotFoundError
from monitor.methods import ChainMethod, methods
from monitor.reporting.covariance_source import covariance_sentence
from monitor.store import Database, load_campaign, load_identification, machine_events, verify_audit
from monitor.workflow.events import EventRequest, WithdrawEventRequest, event, withdraw as withdraw_event
from monitor.workflow.explain.compare import compare
from monitor.workflow.explain.explain import explain
from monitor.workflow.explain.explain_answer import MachineExplanation
from monitor.workflow.explain.request import CompareRequest, ExplainRequest
from monitor.workflow.explain.versions import latest_campaign
from monitor.workflow.fleet.fleet import fleet
from monitor.workflow.fleet.request import FleetRequest
from monitor.workflow.identify.every import IdentifyAllRequest, identify_all
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.intake import campaigns
from monitor.workflow.intake.importing import ImportRequest, import_folders
from monitor.workflow.model.change import add_effect, version_with
from monitor.workflow.model.request import AddEffectRequest
from monitor.workflow.model.show import list_all_models
from monitor.workflow.run_statistics.columns import run_columns
from monitor.workflow.run_statistics.coordinates import coordinates
from monitor.workflow.run_statistics.request import StatisticsRequest
from monitor.workflow.run_statistics.statistics import stats
from monitor.workflow.uncertainty.evaluation import evaluate
from monitor.workflow.uncertainty.request import UncertaintyRequest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def test_what_is_shown_is_what_is_stored(db: Database) -> None:
    shown = identify(db, IdentifyRequest("five-days"))
    stored = load_identification(db, "five-days", "samba", 1)
    factors = np.array([unit.factor for unit in stored.units])
    for run, kept in zip(shown.runs, stored.runs, strict=True):
        values = [estimate.value for estimate in run.parameters.values()]
        assert values == pytest.approx(list(kept.estimate / factors), rel=1e-12)
        u = [estimate.u for estimate in run.parameters.values()]
        assert u == pytest.approx(list(np.sqrt(np.diag(kept.covariance)) / factors), rel=1e-12)


def test_one_run_alone_has_the_numbers_it_has_among_all(db: Database) -> None:
    together = identify(db, IdentifyRequest("cold-cold")).runs[6]
    (alone,) = identify(db, IdentifyRequest("cold-cold", run=7)).runs
    assert alone.run == together.run == 7
    for name, estimate in together.parameters.items():
        assert alone.parameters[name].value == pytest.approx(estimate.value, abs=1e-6 * estimate.u)


def test_statistics_from_sums_by_hand(db: Database) -> None:
    document = stats(db, StatisticsRequest("five-days"))
    found = load_identification(db, "five-days", "samba", 1)
    place = found.parameters.index("EB0C")
    values = np.array([run.estimate[place] for run in found.runs]) / found.units[place].factor
    days = np.array([run.day for run in load_campaign(db, "five-days").runs])
    one = document.parameters["EB0C"]
    assert one.mean == pytest.approx(values.mean(), rel=1e-12)
    assert one.u_all == pytest.approx(values.std(ddof=1), rel=1e-12)
    within = sum(((values[days == day] - values[days == day].mean()) ** 2).sum() for day in range(1, 6))
    assert one.u_pooled == pytest.approx(np.sqrt(within / 15), rel=1e-12)
    for day in range(1, 6):
        assert one.u_by_day[str(day)] == pytest.approx(values[days == day].std(ddof=1), rel=1e-12)


def test_columns_of_the_runs(db: Database) -> None:
    columns = run_columns(load_campaign(db, "five-days").runs)
    assert {"run", "day", "warm_up", "hours", "ambient_degC"} <= set(columns)
    assert columns["hours"][0] == 0.0
    assert (np.diff(columns["hours"]) > 0).all()


def test_coordinates_only_where_all_runs_follow_one_plan(db: Database) -> None:
    loaded = load_campaign(db, "five-days")
    found = coordinates(loaded, [1, 2, 3])
    assert found is not None
    names, values = found
    assert values.shape == (3, len(names)) == (3, 186)


def test_import_of_several_folders_lists_those_that_were_refused(tmp_path: Path) -> None:
    with Database(tmp_path / "x.duckdb") as own:
        answer = import_folders(own, ImportRequest([tmp_path / "nope", EXAMPLES / "cold-cold"]))
        assert [refused.folder for refused in answer.refused] == [str(tmp_path / "nope")]
        assert [row.campaign for row in campaigns.campaigns(own).campaigns] == ["cold-cold"]


def test_no_campaign_yet(tmp_path: Path) -> None:
    with (
        Database(tmp_path / "x.duckdb") as own,
        pytest.raises(NotFoundError, match="no campaign yet; type `monitor import FOLDER`"),
    ):
        identify_all(own, IdentifyAllRequest())


def test_a_campaign_that_cannot_be_identified_does_not_hinder_the_others(tmp_path: Path) -> None:
    inches = tmp_path / "in inches"
    shutil.copytree(EXAMPLES / "cold-cold", inches)
    toml = inches / "campaign.toml"
    text = toml.read_text("utf-8").replace('"cold-cold"', '"in inches"', 1).replace("HU40-T", "HU40-I", 1)
    toml.write_text(text, "utf-8")
    table = pd.read_csv(inches / "probings.csv", dtype={"target": str})
    table["y_mm"] /= 25.4
    table.to_csv(inches / "probings.csv", index=False)
    with Database(tmp_path / "x.duckdb") as own:
        import_folders(own, ImportRequest([inches, EXAMPLES / "cold-cold"]))
        answer = identify_all(own, IdentifyAllRequest())
        assert [each.campaign for each in answer.identifications] == ["cold-cold"]
        assert [each.campaign for each in answer.refused] == ["in inches"]
        assert fleet(own, FleetRequest()).not_identified == ("in inches",)


def test_a_base_effect_is_not_added(db: Database) -> None:
    with pytest.raises(InputError, match="EXX:poly1 is free in every run already, whatever the model"):
        add_effect(db, AddEffectRequest("EXX:poly1", "samba"))
    assert [version.model for version in list_all_models(db).models] == [
        name for name, method in methods().items() if isinstance(method, ChainMethod)
    ]


def test_effects_that_take_each_others_part_are_added_in_one_version(db: Database) -> None:
    pair = AddEffectRequest("EBX:poly2", "samba", "bent", beside=("EBX:poly1",), campaign="hidden-reversal-x")
    answer = add_effect(db, pair)
    assert answer.model.version.added == ("EBX:poly2", "EBX:poly1")
    assert [step.added for step in answer.history] == [None, "EBX:poly2 + EBX:poly1"]
    with pytest.raises(InputError, match="model bent has EBX:poly1 already"):
        add_effect(db, AddEffectRequest("EYX:poly2", "bent", beside=("EBX:poly1",)))
    with pytest.raises(InputError, match="lists an effect twice: EYX:poly2"):
        add_effect(db, AddEffectRequest("EYX:poly2", "bent", beside=("EYX:poly2",)))


def test_history_is_that_of_the_campaign_last_looked_at(db: Database) -> None:
    model = version_with(db, AddEffectRequest("EXX:reversal", "samba", "m"))
    with pytest.raises(NotFoundError, match="model m has not been compared with a campaign yet"):
        latest_campaign(db, model)
    identify(db, IdentifyRequest("cold-cold"))
    assert latest_campaign(db, model) == "cold-cold"
    compare(db, CompareRequest("hidden-reversal-x"))
    assert latest_campaign(db, model) == "hidden-reversal-x"


@pytest.mark.parametrize("seed", [-1, 2**63])
def test_seeds_that_cannot_be_stored(db: Database, seed: int) -> None:
    with pytest.raises(InputError, match="a seed is a whole number from 0"):
        evaluate(db, UncertaintyRequest("five-days", seed=seed))


def covariance_of(db: Database, campaign: str) -> str:
    """Where the covariance of a campaign's readings comes from, in words."""
    return covariance_sentence(evaluate(db, UncertaintyRequest(campaign, method="guf")).covariance_source)


def test_inputs_come_from_the_repeated_runs_where_there_are_enough(db: Database) -> None:
    assert covariance_of(db, "five-days").startswith("repeated runs, pooled by day, 15")
    assert covariance_of(db, "cold-cold").startswith("repeated runs, pooled by day, 43")


def test_events_need_words_and_a_machine(db: Database) -> None:
    at = datetime.fromisoformat("2026-03-05T07:00:00-05:00")
    with pytest.raises(InputError, match="say in words what happened"):
        event(db, EventRequest("HU40-T", " ", at, "note"))
    with pytest.raises(NotFoundError, match="there is no machine 'NOPE'; there are HU40-T"):
        event(db, EventRequest("NOPE"))
    assert event(db, EventRequest("HU40-T")).events == ()
    unsaid: tuple[dict[str, Any], ...] = ({"at": at}, {"kind": "crash"})
    for without_words in unsaid:
        with pytest.raises(InputError, match="say in words what happened"):
            event(db, EventRequest("HU40-T", **without_words))


def test_an_event_before_all_runs_is_recorded_with_a_word(tmp_path: Path) -> None:
    """An event of 1999 was recorded without a question, and could not be taken away."""
    with Database(tmp_path / "one.duckdb") as db:
        import_folders(db, ImportRequest([EXAMPLES / "cold-cold"]))
        mistyped = EventRequest("HU40-T", "belt", datetime(1926, 3, 5, tzinfo=UTC), "repair")
        with pytest.raises(InputError, match="lies more than a year before the first run of HU40-T"):
            event(db, mistyped)
        early = event(db, replace(mistyped, before_runs=True))
        assert early.notes[0].startswith("recorded, and it lies before the first run of HU40-T (20")
        late = event(db, EventRequest("HU40-T", "belt", datetime.now(UTC), "repair"))
        assert late.notes == ()
        assert len(late.events) == 2
        for wordless in ("", "-"):
            with pytest.raises(InputError, match="say in words why event 1 is withdrawn"):
                withdraw_event(db, WithdrawEventRequest("HU40-T", 1, wordless))
        left = withdraw_event(db, WithdrawEventRequest("HU40-T", 1, "the year was mistyped"))
        assert [of.event_id for of in left.events] == [2]
        assert [of.at for of in machine_events(db, "HU40-T")] == [
            late.events[1].happened_at.replace(tzinfo=UTC)
        ]
        with pytest.raises(NotFoundError, match="has no event 1 that counts; it has 2"):
            withdraw_event(db, WithdrawEventRequest("HU40-T", 1, "once more"))
        assert db.rows("SELECT description, reason FROM v_withdrawn_events") == [
            ("belt", "the year was mistyped")
        ]
        assert verify_audit(db).faults == ()
        db.execute("UPDATE withdrawn_event SET reason = 'none'")
        assert verify_audit(db).faults == ("withdrawn event 1 was altered after it was stored",)


@pytest.mark.parametrize("text", ["\x07bell", "nul\x00", "\u202eturned"])
def test_what_happened_is_said_in_letters_that_one_sees(text: str) -> None:
    with pytest.raises(
        InputError, match=r"what happened holds the character U\+[0-9A-F]{4}, which nobody sees"
    ):
        EventRequest("HU40-T", text, datetime(2026, 3, 4, tzinfo=UTC))


@pytest.mark.slow
def test_figures_of_a_comparison_and_of_an_explanation(db: Database, tmp_path: Path) -> None:
    folder = tmp_path / "figures ü"
    files = compare(db, CompareRequest("hidden-reversal-x", figures=folder)).figures
    assert files is not None
    names = {Path(file).name for file in files}
    assert {"where-it-fails.svg", "where-it-fails.png", "residual-vectors.png"} <= names
    answer = explain(db, ExplainRequest("hidden-reversal-x", figures=folder))
    assert answer.figures is not None
    files += answer.figures
    # Where the model fails, what is missing, how far the error falls.
    names = {Path(file).name for file in files}
    assert names >= {
        "missing-effects.svg", "residual-vectors.svg", "missing-effect-before-after.svg", "error-falling.png"
    }  # fmt: skip
    for file in files:
        assert Path(file).stat().st_size > 1000
    assert isinstance(answer.explanation, MachineExplanation)
    first = answer.explanation.missing[0]
    # Beside the bar stands the size, short enough to be whole; the words are in the title.
    text = (tmp_path / "figures ü" / "missing-effects.svg").read_text(encoding="utf-8")
    assert first.effect in text
    assert f"± {first.u:.2g}" in text
