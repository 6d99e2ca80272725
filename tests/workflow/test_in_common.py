"""Two campaigns by one laser: `trend` judges their difference without its scale, and states their level with it.

The simulator shares no code with the package; E_n is computed in the test.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest

from monitor.cli.agreement_output import agreement_line
from monitor.cli.rests_on_output import levels
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.sources import CommonQuantity
from monitor.statistics import Change
from monitor.store import Database, import_campaign, load_identification, machine_history
from monitor.workflow.history.agreement import AgreementPair
from monitor.workflow.history.in_common import RestsOn, calibrated_alike
from monitor.workflow.history.other_instruments import other_instruments
from monitor.workflow.history.past import machine_past
from monitor.workflow.history.series import Series, parameter_series
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.trend.answer import TrendAnswer
from monitor.workflow.trend.parameter import latest_mean
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import trend
from tests.simulator import four_instruments as shop

#: The scale, um/m, and what the gain of X grew by from January to June.
U, GROWN = 1.0, 1.2
LASER, GAINS = "laser interferometer", ("EXX", "EYY", "EZZ")


def _campaign(
    folder: Path, month: int, truth: dict[str, float], certificate: str, *others: object
) -> Campaign:
    """The laser, and ``others`` besides, of one machine."""
    rng = np.random.default_rng(month)
    chain = shop.machine(0.0, truth)
    parts = [shop.laser(chain, rng, 2), *(measure(chain, rng) for measure in others)]
    text, of = "".join(setups for setups, _ in parts), 'reading = "displacement"\n'
    text = text.replace(of, f'{of}scale_standard_uncertainty_um_per_m = {U}\ncertificate = "{certificate}"\n')
    rows = [row for _, of_part in parts for row in of_part]
    path = chain.write(folder, text, rows, started=[f"2026-{month:02d}-05T08:00:00+00:00"])
    file = path / "campaign.toml"
    text = file.read_text(encoding="utf-8").replace(f'id = "{folder.name}"', 'id = "CENTRE-9"', 1)
    file.write_text(text, encoding="utf-8")
    campaign = read_campaign(path)
    assert isinstance(campaign, Campaign)
    return campaign


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    folder = tmp_path_factory.mktemp("common")
    with Database(folder / "shop.duckdb", threads=1) as database:
        january = _campaign(folder / "january", 1, shop.TRUTH, "C-7")
        grown = {**shop.TRUTH, "EXX": shop.TRUTH["EXX"] + 1e-6 * GROWN}
        june = _campaign(folder / "june", 6, grown, "C-7", shop.r_test)
        again = _campaign(folder / "july", 7, grown, "C-8", shop.dial)
        for campaign in (january, june, again):
            import_campaign(database, campaign)
            identify(database, IdentifyRequest(campaign.name))
        yield database


@pytest.fixture(scope="module")
def answer(db: Database) -> TrendAnswer:
    return trend(db, TrendRequest("CENTRE-9"))


def _pair(answer: TrendAnswer, *campaigns: str) -> AgreementPair:
    (pair,) = (each for each in answer.agreement if set(each.campaigns) == set(campaigns))
    return pair


def test_what_a_run_has_of_the_scale_is_stored_and_read_again(db: Database) -> None:
    stored = load_identification(db, "january")
    ((quantity, part),) = stored.runs[0].common_parts.items()
    assert quantity == CommonQuantity(LASER, "C-7", "scale", 1e-6 * U)
    rows = db.rows("SELECT part FROM v_common_parts WHERE campaign = 'january' AND parameter = 'EXX'")
    assert rows == [(pytest.approx(1e6 * part[stored.parameters.index("EXX")]),)]
    assert abs(rows[0][0]) == pytest.approx(U, rel=0.02)


def test_iso13528_9_7_e_n_of_one_laser_is_without_its_scale(db: Database, answer: TrendAnswer) -> None:
    """1.2 um/m between two results of u = 1.05 um/m each: 0.4 as independent ones, above 1 by the same laser."""
    pair = _pair(answer, "january", "june")
    gain = pair.parameters["EXX"]
    plain = abs(gain.difference) / (2.0 * np.hypot(gain.u_first, gain.u_second))
    own = [np.sqrt(u**2 - U**2) for u in (gain.u_first, gain.u_second)]
    assert gain.e_n is not None
    assert abs(gain.e_n) == pytest.approx(abs(gain.difference) / (2.0 * np.hypot(*own)), rel=0.05)
    assert plain < 0.6 < 1.0 < abs(gain.e_n)
    assert "EXX" in pair.disagree
    assert pair.in_common == (RestsOn(LASER, "scale", "C-7"),)
    assert (
        "the scale of laser interferometer (C-7) is in both and no part of the difference"
        in agreement_line(pair)
    )


def test_another_calibration_is_another_scale(answer: TrendAnswer) -> None:
    pair = _pair(answer, "june", "july")
    gain = pair.parameters["EXX"]
    assert pair.in_common is None
    assert gain.expanded == pytest.approx(2.0 * np.hypot(gain.u_first, gain.u_second), rel=1e-12)


def test_levels_hold_what_all_runs_rest_on_and_weights_do_not(db: Database) -> None:
    history = machine_history(db, "CENTRE-9")
    january = history.part(history.campaign != "july")
    series, _ = parameter_series(january)["EXX"]
    np.testing.assert_allclose(series.u_common, U, rtol=0.02)
    weights = series.weights()
    assert weights is not None
    np.testing.assert_allclose(np.hypot(weights, series.u_common), series.u, rtol=1e-9)
    # With July by another calibration nothing is in all runs.
    assert np.all(parameter_series(history)["EXX"][0].u_common == 0.0)


def test_a_step_between_instruments_has_what_their_calibrations_leave_open(db: Database) -> None:
    """June and July are by two calibrations of 1 um/m each; January and June by one, and June by an R-test besides."""
    history = machine_history(db, "CENTRE-9")
    past = machine_past(history, ())["EXX"]
    january, june, july = past.series.t
    between = [
        other_instruments(
            history,
            past,
            Change("EXX", "step", 1, at=last, interval=(first, last), size=size, u=0.1, p_value=1e-4),
        )
        for first, last, size in ((june, july, 2.5), (june, july, 4.0), (january, june, 1.2))
    ]
    assert all(each is not None for each in between)
    assert [each.may_be_all for each in between if each] == [True, False, False]
    assert [each.u for each in between if each] == pytest.approx([np.sqrt(2.0) * U] * 2 + [0.0], abs=0.03)
    assert between[0] is not None
    assert (
        between[0].in_words("µm/m").endswith("after it: their calibrations (u = 1.4 µm/m) can be all of it")
    )
    slope = Change("EXX", "slope", 1, at=july, interval=(june, july), size=2.5, u=0.1, p_value=1e-4)
    assert other_instruments(history, past, slope) is None


def test_the_page_says_what_all_runs_rest_on(db: Database) -> None:
    answer = trend(db, TrendRequest("CENTRE-9", campaigns=("january", "june")))
    (stated,) = answer.parameters["EXX"].rests_on or ()
    assert (stated.calibrated, stated.quantity, stated.certificate) == (LASER, "scale", "C-7")
    assert stated.u == pytest.approx(U, rel=0.02)
    (sentence,) = levels(answer)
    assert sentence.startswith(
        "all runs rest on the scale of laser interferometer (C-7): u of levels and of what is "
    )
    assert all(each.rests_on is None for name, each in answer.parameters.items() if name not in GAINS)


def test_the_mean_of_a_days_runs_has_what_they_have_in_common() -> None:
    """Ten runs that scatter by 0.1 are known to 0.03, and by their laser to 1."""
    rng, count = np.random.default_rng(5), 10
    scale = CommonQuantity(LASER, "", "scale", 1e-6)
    values = rng.normal(3.0, 0.1, count)
    series = Series(
        "EXX", "µm/m", values, np.full(count, 1.01), np.linspace(0.0, 0.1, count), np.zeros(count, dtype=np.int64),
        np.zeros(count), np.zeros(count, dtype=np.bool_), timedelta(),
        common_parts={scale: np.full(count, 1.0)},
    )  # fmt: skip
    mean = latest_mean(series)
    assert mean.latest_u == pytest.approx(np.hypot(values.std(ddof=1) / np.sqrt(count), 1.0), rel=1e-9)
    alone = latest_mean(replace(series, common_parts={}))
    assert alone.latest_u == pytest.approx(values.std(ddof=1) / np.sqrt(count), rel=1e-9)


def test_of_two_statements_of_one_calibration_the_surer_is_in_common() -> None:
    """What the other campaign states beyond it is its own: the part of 2 is as large as that of 1."""
    sure, unsure = (CommonQuantity(LASER, "C-7", "scale", u) for u in (1e-6, 2e-6))
    other = CommonQuantity(LASER, "C-8", "scale", 1e-6)
    parts = {
        unsure: np.array([[0.0], [2.0]]), sure: np.array([[1.0], [0.0]]), other: np.array([[0.0], [0.0]])
    }  # fmt: skip
    alike = calibrated_alike(parts)
    assert list(alike) == [sure, other]
    np.testing.assert_array_equal(alike[sure], [[1.0], [1.0]])
