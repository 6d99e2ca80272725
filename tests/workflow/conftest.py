"""A database with three example campaigns, filled once."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from datetime import date
from pathlib import Path

import pytest

from monitor.store import Database
from monitor.workflow.intake.importing import ImportRequest, import_folders

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
CAMPAIGNS = ("five-days", "cold-cold", "hidden-reversal-x")


@pytest.fixture(scope="session", autouse=True)
def clock() -> Iterator[None]:
    """Certificates are issued on a day of ours, whatever the clock of the computer says."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("monitor.workflow.certificate.issue.today", lambda: date(2027, 6, 1))
        yield


@pytest.fixture(scope="session")
def filled(made_once: Callable[[str, Callable[[Path], object]], Path]) -> Path:
    def fill(folder: Path) -> None:
        with Database(folder / "filled.duckdb") as db:
            import_folders(db, ImportRequest([EXAMPLES / name for name in CAMPAIGNS]))

    return made_once("workflow", fill) / "filled.duckdb"


@pytest.fixture
def db(filled: Path, tmp_path: Path) -> Iterator[Database]:
    path = tmp_path / "own.duckdb"
    shutil.copyfile(filled, path)
    with Database(path) as opened:
        yield opened
