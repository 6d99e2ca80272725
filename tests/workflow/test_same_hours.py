"""Campaigns of the same hours: the table of all machines and the page of one state the same number, and that it mixes.

The runs of each campaign's last day are averaged here from the stored values, by another way than either.
"""

from __future__ import annotations

from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest

from monitor.cli import main
from monitor.readers import read_campaign
from monitor.store import Database, import_campaign, machine_history
from monitor.workflow.fleet.answer import FleetAnswer
from monitor.workflow.fleet.fleet import fleet
from monitor.workflow.fleet.request import FleetRequest
from monitor.workflow.history.runs import overlapping
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import trend

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
CAMPAIGNS = ("five-days", "hidden-spindle-growth")
MACHINE = "HU40-T"


@pytest.fixture(scope="module")
def both_orders(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Two databases with the same campaigns, imported and identified in one order and in the other."""
    folder, paths = tmp_path_factory.mktemp("same"), []
    for order in (CAMPAIGNS, CAMPAIGNS[::-1]):
        paths.append(folder / f"{'-'.join(order)}.duckdb")
        with Database(paths[-1], threads=1) as db:
            for name in order:
                import_campaign(db, read_campaign(EXAMPLES / name))
                identify(db, IdentifyRequest(name))
    return paths


def latest_of(answer: FleetAnswer) -> dict[str, float | None]:
    return {row.parameter: row.latest for row in answer.table if row.machine == MACHINE}


def test_both_mix_the_runs_of_the_last_day_in_whatever_order_they_were_stored(
    both_orders: list[Path],
) -> None:
    stated = []
    for path in both_orders:
        with Database(path, threads=1) as db:
            answer = fleet(db, FleetRequest(top=0))
            of_page = trend(db, TrendRequest(MACHINE))
            history = machine_history(db, MACHINE)
        of_fleet = latest_of(answer)
        last = np.array([at.date() == history.started_at[-1].date() for at in history.started_at])
        assert set(history.campaign[last].tolist()) == set(CAMPAIGNS)
        for name, statement in of_page.parameters.items():
            mean = history.values[last, history.parameters.index(name)].mean()
            assert statement.mean.latest_runs == last.sum() == 8
            assert statement.mean.latest == pytest.approx(mean, rel=1e-9, abs=1e-9)
            assert of_fleet[name] == pytest.approx(mean, rel=1e-9, abs=1e-9)
        assert answer.same_hours == {MACHINE: (CAMPAIGNS,)}
        stated.append(of_fleet)
    assert stated[0] == pytest.approx(stated[1], rel=1e-9, abs=1e-9)


def test_the_command_names_the_campaigns_and_what_to_type(
    both_orders: list[Path], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["--db", str(both_orders[0]), "fleet", "--top", "1"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "; campaigns overlap" in said
    assert (
        "campaigns five-days and hidden-spindle-growth of HU40-T hold runs of the same hours, which one machine cannot "
        "have made; the numbers here mix them: see the one that counts alone with `monitor trend HU40-T --campaign "
        "five-days`"
    ) in said


def test_days_that_follow_each_other_do_not_overlap_and_chains_of_those_that_do_are_one_group() -> None:
    hour = timedelta(hours=1) / timedelta(days=1)
    assert overlapping([(0.0, hour, "a"), (2 * hour, 3 * hour, "b"), (1.0, 1.1, "a")]) == []
    assert overlapping([(0.0, 0.2, "a"), (0.1, 0.4, "b"), (0.3, 0.5, "c"), (1.0, 1.1, "d")]) == [
        ("a", "b", "c")
    ]
