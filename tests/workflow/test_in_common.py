"""Two campaigns by one laser: `trend` judges their difference without its scale, and states their level with it.

The simulator shares no code with the package; E_n is computed in the test.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from monitor.cli.agreement_output import agreement_line
from monitor.cli.rests_on_output import levels
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.reporting import calibration_messages
from monitor.sources import CommonQuantity
from monitor.statistics import Change
from monitor.statistics.trend import trend as statistics_trend
from monitor.store import Database, import_campaign, load_identification, machine_history
from monitor.workflow.history.agreement import AgreementPair
from monitor.workflow.history.changes import ChangeSearch
from monitor.workflow.history.drift import PieceDrift
from monitor.workflow.history.in_common import RestsOn, calibrated_alike, calibrated_to, stated_differently
from monitor.workflow.history.other_instruments import between_instruments
from monitor.workflow.history.past import ParameterPast, machine_past
from monitor.workflow.history.series import Series, parameter_series
from monitor.workflow.history.what_measured import what_measured
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.trend.answer import TrendAnswer
from monitor.workflow.trend.parameter import latest_mean
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import trend
from tests.simulator import four_instruments as shop

#: The scale, um/m, and what the gain of X grew by from January to June.
U, GROWN = 1.0, 1.2
CERTIFICATES = {"january": "C-7", "june": "C-7", "july": "C-8"}
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


def test_jcgm100_5_2_2_a_mean_has_of_each_calibration_the_share_of_its_runs(db: Database) -> None:
    """Two runs of three rest on C-7: 2/3 of u by it, 1/3 by the other one, and the weights have none of it."""
    history = machine_history(db, "CENTRE-9")
    series, _ = parameter_series(history)["EXX"]
    assert [quantity.certificate for quantity in series.common_parts] == ["C-7", "C-8"]
    np.testing.assert_allclose(np.abs(series.common_of_mean), [2.0 * U / 3.0, U / 3.0], rtol=0.02)
    weights = series.weights()
    assert weights is not None
    np.testing.assert_allclose(np.hypot(weights, np.linalg.norm(series.common, axis=1)), series.u, rtol=1e-9)
    january, _ = parameter_series(history.part(history.campaign != "july"))["EXX"]
    np.testing.assert_allclose(np.abs(january.common_of_mean), U, rtol=0.02)


def test_a_line_over_two_calibrations_has_their_shares() -> None:
    """Five days by one, five by the other: the level has u / sqrt(2), the slope what both are apart; by hand."""
    t, u = np.arange(10.0), 2.0
    parts = np.column_stack([np.where(t < 5, u, 0.0), np.where(t < 5, 0.0, u)])
    y = np.random.default_rng(3).normal(size=10)
    line = statistics_trend(y, t, common=parts, robust=False)
    alone = statistics_trend(y, t, robust=False)
    weights = (t - t.mean()) / np.sum((t - t.mean()) ** 2)
    of_slope = np.hypot(*(weights @ parts))
    np.testing.assert_allclose(
        line.common, np.column_stack([parts.mean(axis=0), weights @ parts]), atol=1e-12
    )
    assert line.u_slope == pytest.approx(np.hypot(alone.u_slope, of_slope), rel=1e-9)
    assert line.u_common(t.mean()) == pytest.approx(u / np.sqrt(2.0), rel=1e-9)
    assert line.u_common(t)[-1] == pytest.approx(
        np.linalg.norm(parts.mean(axis=0) + (t[-1] - t.mean()) * (weights @ parts)), rel=1e-9
    )
    # One calibration moves no slope.
    assert statistics_trend(y, t, common=np.full((10, 1), u), robust=False).u_slope == pytest.approx(
        alone.u_slope
    )


def _stepped(past: dict[str, ParameterPast], sizes: dict[str, float], at: int) -> dict[str, ParameterPast]:
    """The past with steps of ``sizes`` between the run ``at`` and the next one."""
    times = past["EXX"].series.t[at : at + 2]
    return {
        name: replace(
            parameter,
            search=ChangeSearch(
                (Change(name, "step", at + 1, times[1], (times[0], times[1]), sizes[name], 0.1, 1e-4),)
                if name in sizes
                else ()
            ),
        )
        for name, parameter in past.items()
    }


def test_a_step_between_instruments_has_what_their_calibrations_leave_open(db: Database) -> None:
    """June and July are by two calibrations of 1 um/m each; January and June by one, and June by an R-test besides."""
    history = machine_history(db, "CENTRE-9")
    past = machine_past(history, ())
    judged = []
    for at, size in ((1, 2.5), (1, 4.0), (0, 1.2)):
        (between,) = between_instruments(history, _stepped(past, {"EXX": size}, at)).values()
        judged.append(between)
    assert [each.may_be_all for each in judged] == [True, False, False]
    assert [each.u for each in judged] == pytest.approx([np.sqrt(2.0) * U] * 2 + [0.0], abs=0.03)
    assert judged[0].e_n == pytest.approx(2.5 / (2.0 * np.hypot(0.1, np.sqrt(2.0) * U)), rel=0.03)
    assert judged[0].in_words("µm/m").endswith("after it: their calibrations (u = 1.4 µm/m) can be all of it")
    slope = _stepped(past, {"EXX": 2.5}, 1)
    (change,) = slope["EXX"].search.changes
    slope["EXX"] = replace(slope["EXX"], search=ChangeSearch((replace(change, kind="slope"),)))
    assert not between_instruments(history, slope)


def test_a_laser_calibrated_anew_under_its_old_name_is_named_at_the_step(db: Database) -> None:
    """The same instruments before and after, and another certificate: no event need be recorded."""
    history = machine_history(db, "CENTRE-9")
    history = replace(history, measured_by=np.full(3, "instruments (laser interferometer)"))
    past = machine_past(history, ())
    (between,) = between_instruments(history, _stepped(past, {"EXX": 2.5}, 1)).values()
    assert (between.before, between.after) == (f"{LASER} (C-7)", f"{LASER} (C-8)")
    assert between.may_be_all
    # January and June are by one certificate.
    assert not between_instruments(history, _stepped(past, {"EXX": 2.5}, 0))


def test_the_page_says_what_all_runs_rest_on(db: Database) -> None:
    answer = trend(db, TrendRequest("CENTRE-9", campaigns=("january", "june")))
    (stated,) = answer.parameters["EXX"].rests_on or ()
    assert (stated.calibrated, stated.quantity, stated.certificate) == (LASER, "scale", "C-7")
    assert stated.u == pytest.approx(U, rel=0.02)
    (sentence,) = levels(answer)
    assert sentence.startswith(
        "all runs since the last change rest on the scale of laser interferometer (C-7): u of levels and of what is "
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
    mean = latest_mean(PieceDrift(series, -np.inf))
    assert mean.latest_u == pytest.approx(np.hypot(values.std(ddof=1) / np.sqrt(count), 1.0), rel=1e-9)
    alone = latest_mean(PieceDrift(replace(series, common_parts={}), -np.inf))
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


def test_runs_of_two_calibrations_say_how_many_rest_on_each(answer: TrendAnswer) -> None:
    stated = {each.certificate: each for each in answer.parameters["EXX"].rests_on or ()}
    assert {name: (each.runs, each.of_runs) for name, each in stated.items()} == {
        "C-7": (2, 3),
        "C-8": (1, 3),
    }
    # The last day is by C-8 alone.
    assert [each.u for each in stated.values()] == pytest.approx([0.0, U], abs=0.02)
    first, second = levels(answer)
    assert first.startswith(
        "the scale of laser interferometer (C-7) is in u of means and lines with the share"
    )
    assert "EXX, 2 of 3 runs: latest 0;" in first
    assert "EXX, 1 of 3 runs: latest 1.0 µm/m;" in second


def test_an_older_identification_says_so_and_counts_all_of_its_u(db: Database) -> None:
    history = machine_history(db, "CENTRE-9")
    older = {
        quantity: np.where(history.campaign[:, None] == "january", 0.0, part)
        for quantity, part in history.common_parts.items()
    }
    history = replace(
        history,
        common_parts=older,
        calibrations=replace(history.calibrations, unstored={"january": ((LASER, "C-7"),)}),
    )
    series, _ = parameter_series(history)["EXX"]
    scale = next(quantity for quantity in series.common_parts if quantity.certificate == "C-7")
    part = np.abs(series.common_parts[scale])
    np.testing.assert_allclose(part, [series.u[0], U, 0.0], rtol=0.02)
    weights = series.weights()
    assert weights is not None
    assert weights[0] == series.u[0]


def test_identifications_of_before_the_parts_are_known_by_their_time(db: Database) -> None:
    assert not machine_history(db, "CENTRE-9").calibrations.unstored
    # As an older version left it: identified before the parts had a table, and none of them in it.
    db.execute("CREATE TEMP TABLE parts_set_aside AS FROM common_part")
    db.execute("DELETE FROM common_part")
    db.execute("UPDATE schema_migration SET applied_at = now()::TIMESTAMP + INTERVAL 1 DAY WHERE number = 17")
    try:
        again = machine_history(db, "CENTRE-9", parameter=None, since=datetime(2026, 1, 1, tzinfo=UTC))
        assert again.calibrations.unstored == {name: ((LASER, c),) for name, c in CERTIFICATES.items()}
        answer = trend(db, TrendRequest("CENTRE-9", since=datetime(2026, 1, 1, tzinfo=UTC)))
        (note,) = (note for note in answer.notes if "older version identified" in note)
        assert "type `monitor identify` for each" in note
    finally:
        db.execute("INSERT INTO common_part FROM parts_set_aside")
        db.execute("DROP TABLE parts_set_aside")
        db.execute(
            "UPDATE schema_migration SET applied_at = now()::TIMESTAMP - INTERVAL 1 DAY WHERE number = 17"
        )


def test_one_calibration_stated_with_two_uncertainties_is_said() -> None:
    parts = {CommonQuantity(LASER, "C-7", "scale", u): np.ones((1, 1)) for u in (2e-6, 0.5e-6)}
    parts[CommonQuantity("bar", "", "length of 100 mm", 3e-4)] = np.ones((1, 1))
    ((surest, other),) = stated_differently(parts)
    assert [calibrated_to(each) for each in (surest, other)] == ["0.5 µm/m", "2 µm/m"]
    words = calibration_messages.stated_differently(LASER, "C-7", "scale", "0.5 µm/m", "2 µm/m")
    assert words.startswith(
        "campaigns state the scale of laser interferometer (C-7) with u = 0.5 µm/m and with 2 µm/m"
    )
    assert calibrated_to(CommonQuantity("bar", "", "length of 100 mm", 3e-4)) == "0.3 µm"


@pytest.mark.parametrize("optics", ["K-1", pytest.param("C-7", marks=pytest.mark.slow)])
def test_optics_without_a_scale_calibrate_no_laser_anew(tmp_path: Path, optics: str) -> None:
    """The dial stands for optics of the laser, with the same certificate or another one, in January alone."""

    def dial(*of: object) -> tuple[str, list[object]]:
        text, rows = shop.dial(*of)
        return re.sub(
            r'instrument = ".*?"\n', f'instrument = "{LASER}"\ncertificate = "{optics}"\n', text
        ), rows

    with Database(tmp_path / "shop.duckdb", threads=1) as database:
        for name, month, others in (("january", 1, (dial,)), ("june", 6, ())):
            campaign = _campaign(tmp_path / name, month, shop.TRUTH, "C-7", *others)
            import_campaign(database, campaign)
            identify(database, IdentifyRequest(campaign.name))
        history = machine_history(database, "CENTRE-9")
    assert {of[LASER] for of in history.calibrations.certificates.values()} == {"C-7"}
    assert what_measured(history)[0] == (f"instruments ({LASER})",)
    assert not between_instruments(history, _stepped(machine_past(history, ()), {"EXX": 2.5}, 0))


def _two_a_day(values: Any) -> Series:
    count = values.size
    return Series(
        "EXX", "µm/m", values.ravel(), np.full(count, 1.0),
        np.repeat(np.arange(count // 2), 2) + np.tile([0.0, 0.1], count // 2),
        np.repeat(np.arange(count // 2), 2), np.zeros(count), np.zeros(count, dtype=np.bool_), timedelta(),
    )  # fmt: skip


def test_jcgm100_4_2_4_two_runs_of_a_day_have_the_scatter_of_all_days() -> None:
    """By their own scatter the mean of two was known 100 times too well in one of 100 days."""
    rng = np.random.default_rng(8)
    covered = {2: 0, 30: 0}
    for _ in range(400):
        for days in covered:
            mean = latest_mean(PieceDrift(_two_a_day(rng.normal(0.0, 2.0, (days, 2))), -np.inf))
            dof = mean.latest_degrees_of_freedom
            assert dof in (days, 1)
            covered[days] += abs(mean.latest) <= stats.t(dof).ppf(0.95 / 2 + 0.5) * mean.latest_u
    assert all(366 <= count <= 394 for count in covered.values()), covered


def test_a_day_that_scatters_more_than_the_others_has_its_own_u() -> None:
    values = np.random.default_rng(9).normal(0.0, 1.0, (20, 2))
    values[-1] = 0.0, 30.0
    loose = latest_mean(PieceDrift(_two_a_day(values), -np.inf))
    assert loose.latest_u == pytest.approx(15.0)
    assert loose.latest_degrees_of_freedom == 1
