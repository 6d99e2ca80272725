"""`contributions` and the example of four instruments: what only the combination shows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
import scipy

from monitor.cli.agreement_output import agreement_line
from monitor.exceptions import DataError, NotFoundError
from monitor.readers import read_campaign
from monitor.store import Database, import_campaign
from monitor.workflow.explain.compare import compare
from monitor.workflow.explain.explain import explain
from monitor.workflow.explain.request import CompareRequest, ExplainRequest
from monitor.workflow.health.request import ReportOptions
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.instruments.answer import InstrumentsAnswer
from monitor.workflow.instruments.instruments import instruments
from monitor.workflow.instruments.request import InstrumentsRequest
from monitor.workflow.model.change import add_effect
from monitor.workflow.model.request import AddEffectRequest
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import trend
from tests.answers import report
from tests.simulator import four_instruments as shop

EXAMPLES = Path(__file__).parents[2] / "examples"
NAMES = ("four-instruments", "laser", "ball-bar", "r-test")
LASER, BAR, NEST, DIAL = "laser interferometer", "ball bar", "R-test", "dial on a square"


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    with Database(tmp_path_factory.mktemp("instruments") / "shop.duckdb") as db:
        for name in NAMES:
            import_campaign(db, read_campaign(EXAMPLES / name))
        yield db


@pytest.fixture(scope="module")
def shared(db: Database) -> InstrumentsAnswer:
    return instruments(db, InstrumentsRequest("four-instruments"))


def test_the_examples_are_those_of_the_simulator(tmp_path: Path) -> None:
    shop.write_examples(tmp_path)
    for name in NAMES:
        for file in ("campaign.toml", "runs.csv", "probings.csv"):
            made, kept = (folder / name / file for folder in (tmp_path, EXAMPLES))
            if file == "probings.csv":
                # Sines differ in the last bit between processors; the files round to 10 nm.
                first, second = (path.read_text(encoding="utf-8").splitlines() for path in (made, kept))
                assert len(first) == len(second)
            else:
                assert made.read_bytes() == kept.read_bytes()


def test_the_parts_of_the_instruments_make_up_u(db: Database, shared: InstrumentsAnswer) -> None:
    """The squares of the parts sum to the variance of the identification, which is made by another route (QR and
    elimination of the run's unknowns)."""
    run = identify(db, IdentifyRequest("four-instruments")).runs[0]
    for parameter in shared.parameters:
        total = sum(part**2 for part in parameter.parts.values()) + parameter.known_beforehand**2
        assert np.sqrt(total) == pytest.approx(parameter.u, rel=1e-9)
        assert parameter.u == pytest.approx(run.parameters[parameter.parameter].u, rel=1e-6)


def test_what_an_instrument_says_alone_is_what_its_own_campaign_says(
    db: Database, shared: InstrumentsAnswer
) -> None:
    """The examples laser and ball-bar hold the same rows: fitted by themselves they give the same to a tenth of u, from
    which the joint point, 12 u away for the bar, is one linear step."""
    for name, instrument in (("laser", LASER), ("ball-bar", BAR)):
        run = identify(db, IdentifyRequest(name)).runs[0]
        # Where its readings scatter more than stated, alone is by their scatter.
        scatter = np.sqrt(max(1.0, run.chi_square / run.degrees_of_freedom))
        for parameter in shared.parameters:
            for alone in parameter.alone:
                if alone.instrument == instrument:
                    own = run.parameters[parameter.parameter]
                    assert own.value == pytest.approx(alone.value, abs=0.1 * alone.u)
                    assert scatter * own.u == pytest.approx(alone.u, rel=0.02)
                    assert (alone.degrees_of_freedom is None) == (scatter == 1.0)


def test_laser_and_ball_bar_disagree_where_the_pitch_is_hidden(shared: InstrumentsAnswer) -> None:
    """E_n by hand (ISO 13528), and where it comes from: 40 µrad/m on the half metre between laser and bar, 20 µm/m."""
    gain = next(parameter for parameter in shared.parameters if parameter.parameter == "EXX")
    values = {alone.instrument: alone for alone in gain.alone}
    laser, bar = values[LASER], values[BAR]
    (pair,) = gain.agreement
    assert pair.e_n == pytest.approx(
        abs(laser.value - bar.value) / np.hypot(2.0 * laser.u, 2.0 * bar.u), rel=1e-9
    )
    assert pair.e_n > 3.0
    # Bonferroni's bound over all comparisons, by scipy's normal distribution.
    every = [pair.e_n for parameter in shared.parameters for pair in parameter.agreement]
    assert shared.by_chance == pytest.approx(2.0 * len(every) * scipy.stats.norm.sf(2.0 * max(every)))
    assert shared.by_chance < 1e-6
    apart = shop.PITCH * (shop.BAR_AT[2] - shop.TOOL[2] - 0.0) * 1e6
    assert bar.value - laser.value == pytest.approx(apart, abs=4.0 * bar.u)


def test_compare_says_that_instruments_disagree(db: Database, shared: InstrumentsAnswer) -> None:
    """The worst E_n of `contributions`, where chance does not make it; with the pitch in the model nothing is said, nor
    where one instrument measured."""
    apart = compare(db, CompareRequest("four-instruments")).instruments_disagree
    assert apart is not None
    worst = max((pair for each in shared.parameters for pair in each.agreement), key=lambda pair: pair.e_n)
    assert (apart.run, apart.parameter, {apart.first, apart.second}) == (1, "EXX", {LASER, BAR})
    assert (apart.first, apart.second) == (worst.first, worst.second)
    assert apart.e_n == pytest.approx(worst.e_n, rel=1e-3)
    assert apart.by_chance < 1e-6
    assert compare(db, CompareRequest("r-test")).instruments_disagree is None
    add_effect(db, AddEffectRequest("EBX:poly1", "instruments", "level", campaign="four-instruments"))
    assert compare(db, CompareRequest("four-instruments", "level")).instruments_disagree is None


@pytest.mark.slow
def test_only_the_combination_shows_the_pitch(db: Database) -> None:
    for name in NAMES[1:]:
        assert explain(db, ExplainRequest(name)).explanation.missing == ()
    (effect,) = explain(db, ExplainRequest("four-instruments")).explanation.missing
    assert effect.effect == "EBX:poly1"
    assert abs(effect.amplitude - 1e9 * shop.PITCH) < 3.0 * effect.u


def test_with_the_pitch_every_instrument_is_at_its_noise(db: Database) -> None:
    add_effect(db, AddEffectRequest("EBX:poly1", "instruments", "pitched", campaign="four-instruments"))
    answer = instruments(db, InstrumentsRequest("four-instruments", model="pitched"))
    assert {fit.instrument for fit in answer.instruments} == {LASER, BAR, NEST, DIAL}
    for fit in answer.instruments:
        # A mean square of n unit normals less some unknowns: 4 standard deviations of it, and 8 unknowns.
        assert abs(fit.rms_in_u**2 - 1.0) < 4.0 * np.sqrt(2.0 / fit.numbers) + 8.0 / fit.numbers
    truth = {"EXX": 12.0, "EYY": -8.0, "EZZ": 5.0, "EC0X": -35.0, "EB0Z": 26.0, "EA0C": 45.0}
    for parameter in answer.parameters:
        if parameter.parameter in truth:
            assert abs(parameter.value - truth[parameter.parameter]) < 4.0 * parameter.u, parameter.parameter


def test_a_run_that_is_not_there_and_a_method_of_one_instrument_are_refused(db: Database) -> None:
    with pytest.raises(NotFoundError, match="has no run 7; it has runs 1"):
        instruments(db, InstrumentsRequest("four-instruments", run=7))
    import_campaign(db, read_campaign(EXAMPLES / "tilting-table"))
    with pytest.raises(DataError, match="one instrument measured all of it"):
        instruments(db, InstrumentsRequest("tilting-table"))


@pytest.mark.slow
def test_the_health_report_of_several_instruments_names_what_the_combination_shows(
    db: Database, tmp_path: Path
) -> None:
    """The campaign with all four says what is missing and stands in the report of its machine, in HTML and PDF."""
    options = ReportOptions(campaigns=("four-instruments",))
    answer = report(db, "2026-W10", "CENTRE-4", tmp_path, options=options, workers=1)
    (machine,) = answer["machines"]
    assert machine["state"] == "model fails"
    assert "EBX:poly1" in str(machine)
    assert {Path(file).suffix for file in answer["files"]} == {".html", ".pdf"}


def test_two_instruments_make_one_history_and_their_step_is_an_e_n(tmp_path: Path) -> None:
    """A laser in January, a ball bar in June: one history of every gain, and the pitch that hides between them shows as
    E_n, as it does where both measure in one campaign. What they read is no condition of the machine."""
    moments = {
        "laser": datetime(2026, 1, 12, 8, tzinfo=UTC),
        "ball-bar": datetime(2026, 6, 15, 8, tzinfo=UTC),
    }
    with Database(tmp_path / "years.duckdb") as db:
        for name, moment in moments.items():
            campaign = read_campaign(EXAMPLES / name)
            runs = tuple(replace(run, started_at=moment) for run in campaign.runs)
            import_campaign(db, replace(campaign, runs=runs))
            identify(db, IdentifyRequest(name))
        answer = trend(db, TrendRequest("CENTRE-4"))
    (pair,) = answer.agreement
    assert pair.methods == ("instruments (laser interferometer)", "instruments (ball bar)")
    gain = pair.parameters["EXX"]
    # The pitch times the height of the tool point over X adds to the gain: 120 mm below for the laser, 380 above.
    assert gain.first == pytest.approx(12.0 - 1e6 * shop.PITCH * 120.0, abs=4.0 * gain.u_first)
    assert gain.second == pytest.approx(12.0 + 1e6 * shop.PITCH * 380.0, abs=4.0 * gain.u_second)
    assert set(pair.parameters) == {"EXX", "EYY", "EZZ"}
    assert pair.disagree == ("EXX",)
    assert pair.days_apart == (moments["ball-bar"] - moments["laser"]).days == 154
    said = agreement_line(pair)
    assert "instruments (ball bar) (ball-bar), 154 days apart, disagree in EXX; " in said
    assert said.endswith("measure with both on one day to tell them apart")
    same_day = agreement_line(replace(pair, days_apart=0.2))
    assert "instruments (ball bar) (ball-bar) disagree in EXX; " in same_day
    assert "apart" not in same_day
    assert gain.e_n is not None
    assert gain.e_n == pytest.approx(gain.difference / np.hypot(2.0 * gain.u_first, 2.0 * gain.u_second))
    assert answer.parameters["EXX"].drift.n == 2
    channels = {effect.channel for of in answer.parameters.values() for effect in of.conditions}
    assert channels.isdisjoint({"reading_um", "setup"})
