"""Many campaigns identified, explained, reported on a Dask cluster: the bits of one process, whoever dies meanwhile."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest
from by_path import TESTS, load

from monitor.cli import main
from monitor.exceptions import InputError
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.store import Database, import_campaign
from monitor.workflow.health.report import report
from monitor.workflow.health.request import ReportRequest
from monitor.workflow.identify.every import IdentifyAllRequest, identify_all

first_runs = load("first_runs", TESTS / "first_runs.py").first_runs

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
MADE = datetime(2026, 3, 9, 8)
#: All that is computed and stored, but for the moments at which it was, and who did it.
STORED = (
    "SELECT * EXCLUDE (computed_at) FROM identification ORDER BY ALL",
    "SELECT * FROM identified_run ORDER BY ALL",
    "SELECT * FROM identified_values ORDER BY ALL",
    "SELECT * FROM residual ORDER BY ALL",
    "SELECT * EXCLUDE (computed_at) FROM analysis ORDER BY ALL",
)


def fleet(path: Path, machines: int) -> Database:
    """A database with a campaign of nine runs of each of so many machines, none identified."""
    campaign = read_campaign(EXAMPLES / "cold-cold")
    assert isinstance(campaign, Campaign)
    campaign = first_runs(campaign, 9)
    db = Database(path, threads=1)
    for number in range(machines):
        machine = replace(campaign.machine, id=f"M{number}")
        import_campaign(db, replace(campaign, name=f"week of {number}", machine=machine))
    return db


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    """The address of a scheduler with two workers, one of which ends with the first test that kills one."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address=None, silence_logs=50
    ) as local:  # fmt: skip
        yield local.scheduler_address


def killer(address: str) -> tuple[Callable[[str], None], list[int]]:
    """What kills one of the workers when it is first told of progress, and which process that was."""
    killed: list[int] = []

    def told(_: str) -> None:
        if not killed:
            from distributed import Client

            with Client(address, set_as_default=False) as client:
                pids = client.run(os.getpid)
            killed.append(next(iter(pids.values())))
            os.kill(killed[0], signal.SIGKILL)

    return told, killed


def contents(db: Database) -> list[Any]:
    return [str(db.rows(query)) for query in STORED]


@pytest.mark.slow
def test_all_campaigns_are_identified_to_the_bit_on_a_cluster_that_loses_a_worker(
    tmp_path: Path, scheduler: str
) -> None:
    progress, killed = killer(scheduler)
    with fleet(tmp_path / "here.duckdb", 12) as here, fleet(tmp_path / "there.duckdb", 12) as there:
        alone = identify_all(here, IdentifyAllRequest())
        spread = identify_all(there, IdentifyAllRequest(cluster=scheduler), progress=progress)
        assert len(killed) == 1
        assert len(alone.identifications) == 12
        assert str(spread) == str(alone)
        assert contents(there) == contents(here)


@pytest.mark.slow
@pytest.mark.usefixtures("laid_out_anew")
def test_weekly_reports_with_explanations_are_the_same_to_the_bit_on_a_cluster_that_loses_a_worker(
    tmp_path: Path, scheduler: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    progress, killed = killer(scheduler)
    monkeypatch.setattr("monitor.workflow.health.report.last_anchor", lambda db: None)
    request = ReportRequest("2026-W08", workers=1, made_at=MADE)
    with fleet(tmp_path / "here.duckdb", 2) as here, fleet(tmp_path / "there.duckdb", 2) as there:
        alone = report(here, replace(request, out=tmp_path / "here"))
        spread = report(
            there,
            replace(request, out=tmp_path / "there", workers=None, cluster=scheduler),
            progress=progress,
        )
        assert len(killed) == 1
        assert alone.machines == spread.machines
        assert {kind for (kind,) in here.rows("SELECT kind FROM analysis")} >= {
            "explanation",
            "uncertainty",
            "health",
        }
        assert contents(there) == contents(here)
    for one, other in zip(alone.files, spread.files, strict=True):
        assert Path(one).read_bytes() == Path(other).read_bytes()


@pytest.mark.slow
def test_all_campaigns_are_identified_to_the_bit_by_two_processes(tmp_path: Path) -> None:
    with fleet(tmp_path / "here.duckdb", 2) as here, fleet(tmp_path / "there.duckdb", 2) as there:
        alone = identify_all(here, IdentifyAllRequest())
        spread = identify_all(there, IdentifyAllRequest(workers=2))
        assert str(spread) == str(alone)
        assert contents(there) == contents(here)


def test_processes_and_a_cluster_at_once_or_for_one_campaign_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for request in (IdentifyAllRequest, ReportRequest):
        with pytest.raises(
            InputError, match="--workers starts processes here, --cluster uses those of a cluster"
        ):
            request(workers=2, cluster="tcp://127.0.0.1:1")
        with pytest.raises(InputError, match="--workers 0: at least one worker is needed"):
            request(workers=0)
    Database(tmp_path / "x.duckdb").close()
    assert main(["--db", str(tmp_path / "x.duckdb"), "identify", "any", "--workers", "2"]) == 2
    assert "leave the campaign out to identify all" in capsys.readouterr().err
