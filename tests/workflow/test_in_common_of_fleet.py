"""Fleet, `trend` and weekly report hold the same of two calibrations in one history."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from monitor.store import Database, machine_history
from monitor.workflow.fleet.answer import FleetTableRow
from monitor.workflow.fleet.fleet import fleet
from monitor.workflow.fleet.request import FleetRequest
from monitor.workflow.health.forecast import stated_drift
from monitor.workflow.history.forecast import drift_forecast
from monitor.workflow.history.past import machine_past
from monitor.workflow.trend.answer import ParameterTrend
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import trend
from tests.store.test_fleet import keep

CAMPAIGNS, LIMIT, SCALE = 14, 40.0, 3.0
#: By which certificate the campaigns of each machine are measured.
CERTIFICATES = {
    "one": "A" * CAMPAIGNS,
    "halves": "A" * (CAMPAIGNS // 2) + "B" * (CAMPAIGNS // 2),
    "turns": "AB" * (CAMPAIGNS // 2),
    "none": "-" * CAMPAIGNS,
}


@pytest.fixture(scope="module")
def shop(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    """Machines of the same values, measured once a week."""
    scatter = np.random.default_rng(8).normal(0.0, 0.5, (CAMPAIGNS, 3))
    with Database(tmp_path_factory.mktemp("common") / "monitor.duckdb", threads=1) as db:
        for machine, certificates in CERTIFICATES.items():
            for number, certificate in enumerate(certificates):
                keep(db, machine, [(36.0 + scatter[number]).tolist()], f"{machine}-{number}")
                if certificate != "-":
                    db.execute(
                        "INSERT INTO common_part SELECT identification_id, run, 'laser', ?, 'scale', 1e-6, [?] "
                        "FROM identification JOIN campaign USING (campaign_id) JOIN run USING (campaign_id) "
                        "WHERE campaign = ?",
                        [certificate, SCALE, f"{machine}-{number}"],
                    )
        db.execute(
            "UPDATE imported_campaign SET machine_description = ?", [f'{{"tolerances": {{"EXX": {LIMIT}}}}}']
        )
        yield db


@pytest.fixture(scope="module")
def rows(shop: Database) -> dict[str, FleetTableRow]:
    return {row.machine: row for row in fleet(shop, FleetRequest(None, 0)).table}


@pytest.fixture(scope="module")
def parameters(shop: Database) -> dict[str, ParameterTrend]:
    return {machine: trend(shop, TrendRequest(machine)).parameters["EXX"] for machine in CERTIFICATES}


@pytest.mark.parametrize("machine", list(CERTIFICATES))
def test_one_history_has_one_slope_with_one_u_and_one_probability(
    shop: Database, rows: dict[str, FleetTableRow], parameters: dict[str, ParameterTrend], machine: str
) -> None:
    row, stated = rows[machine], parameters[machine]
    assert not stated.changes
    assert (row.slope_per_year, row.u_slope, row.drift_p) == pytest.approx(
        (stated.drift.slope_per_year, stated.drift.u_slope, stated.drift.p_value), rel=1e-6
    )
    assert row.in_tolerance_at_next_check == pytest.approx(
        stated.forecast.in_tolerance_at_next_check, abs=0.02
    )
    drift = machine_past(machine_history(shop, machine), ())["EXX"].drift
    of_report = stated_drift(drift, drift_forecast(drift, LIMIT))
    assert of_report is not None
    assert of_report.u_per_year == pytest.approx(stated.drift.u_slope, rel=1e-12)


def test_shares_are_those_of_the_runs(
    rows: dict[str, FleetTableRow], parameters: dict[str, ParameterTrend]
) -> None:
    """In turns the level has 1 / sqrt(2) of the scale and the slope next to nothing; in halves the slope is unsure."""
    # `slope_per_year` is of weeks: the part of the slope by two halves, by hand.
    week = 7.0 * np.arange(CAMPAIGNS)
    weights = (week - week.mean()) / np.sum((week - week.mean()) ** 2)
    of_half = SCALE * np.abs(weights[: CAMPAIGNS // 2].sum()) * np.sqrt(2.0) * 365.25
    none, halves = rows["none"].u_slope, rows["halves"].u_slope
    assert none is not None
    assert halves == pytest.approx(np.hypot(none, of_half), rel=0.35)
    assert rows["one"].u_slope == pytest.approx(none, rel=1e-9)
    assert rows["turns"].u_slope == pytest.approx(none, rel=3.0)
    inside = [rows[name].in_tolerance_at_next_check for name in ("none", "turns", "one", "halves")]
    assert sorted(inside, reverse=True) == inside
    u_line = {name: [each.u_line for each in parameters[name].rests_on or ()] for name in ("one", "turns")}
    assert u_line["one"] == pytest.approx([SCALE], rel=1e-6)
    assert np.hypot(*u_line["turns"]) == pytest.approx(SCALE / np.sqrt(2.0), rel=0.1)
