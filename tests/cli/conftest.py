"""The command line as a user types it: in this process where that is possible, in a process of its own where not."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

import pytest

import monitor
from monitor.cli import main

CHECKOUT = Path(__file__).resolve().parents[2]
EXAMPLES = CHECKOUT / "examples"
CAMPAIGNS = ("five-days", "cold-cold", "hidden-reversal-x")


@dataclass(frozen=True)
class Answer:
    """What a verb said and how it ended."""

    status: int
    out: str
    err: str

    @property
    def document(self) -> Any:
        """The one JSON document on standard output; nothing may stand beside it."""
        assert self.status in (0, 1), self.err
        return json.loads(self.out, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))


Typed = Callable[..., Answer]


@pytest.fixture(scope="session", autouse=True)
def clock() -> Iterator[None]:
    """Certificates are issued on a day of ours, whatever the clock of the computer says."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("monitor.workflow.certificate.issue.today", lambda: date(2027, 6, 1))
        yield


@pytest.fixture
def typed(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Typed:
    """``typed("campaigns", db=path)``: a verb run in this process, in an empty folder."""
    monkeypatch.delenv("MONITOR_DB", raising=False)
    monkeypatch.delenv("MONITOR_DEBUG", raising=False)
    work = tmp_path / "work"
    work.mkdir()
    monkeypatch.chdir(work)

    def run(*arguments: object, db: Path | None = None) -> Answer:
        capsys.readouterr()
        before = [] if db is None else ["--db", str(db)]
        try:
            status = main([*before, *(str(one) for one in arguments)])
        except SystemExit as ended:
            status = int(ended.code or 0)
        out, err = capsys.readouterr()
        return Answer(status, out, err)

    return run


@pytest.fixture(scope="session")
def environment() -> dict[str, str]:
    """What a process of its own needs to find the package, wherever it is installed."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("MONITOR_")}
    return {**kept, "PYTHONPATH": str(Path(monitor.__file__).parents[1])}


@pytest.fixture
def started(environment: dict[str, str], tmp_path: Path) -> Callable[..., subprocess.Popen[str]]:
    """A verb as a process of its own, not waited for."""

    def start(*arguments: object, **options: Any) -> subprocess.Popen[str]:
        own = {**environment, **options.pop("env", {})}
        return subprocess.Popen(
            [sys.executable, "-m", "monitor", *(str(one) for one in arguments)],
            env=own, cwd=tmp_path, text=True, stdin=subprocess.DEVNULL,
            **{"encoding": "utf-8", "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options},
        )  # fmt: skip

    return start


@pytest.fixture(scope="session")
def examples() -> Path:
    """The example campaigns."""
    return EXAMPLES


@pytest.fixture(scope="session")
def filled_once(made_once: Callable[[str, Callable[[Path], object]], Path]) -> Path:
    """A database with three campaigns and no results, to be copied."""

    def fill(folder: Path) -> None:
        path = folder / "filled.duckdb"
        assert main(["--db", str(path), "import", *(str(EXAMPLES / name) for name in CAMPAIGNS)]) == 0

    return made_once("three-campaigns", fill) / "filled.duckdb"


@pytest.fixture(scope="module")
def filled(filled_once: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The module's copy of the three campaigns. Verbs that only add results may use it; others take ``db``."""
    path = tmp_path_factory.mktemp("module") / "shop floor ü.duckdb"
    shutil.copyfile(filled_once, path)
    return path


@pytest.fixture
def db(filled_once: Path, tmp_path: Path) -> Path:
    """A database of the test's own with the three campaigns."""
    path = tmp_path / "own.duckdb"
    shutil.copyfile(filled_once, path)
    return path


@pytest.fixture(scope="session")
def laboratory() -> Path:
    """What a made-up laboratory states about itself."""
    return EXAMPLES / "laboratory.toml"


@dataclass(frozen=True)
class Issued:
    """A database with the certificates 2026-0001 and 2026-0002 of five-days and 2026-0003 of cold-cold."""

    db: Path
    folder: Path

    def file(self, number: str) -> Path:
        return self.folder / f"certificate-{number}.pdf"


@pytest.fixture(scope="session")
def issued_once(
    filled_once: Path, laboratory: Path, made_once: Callable[[str, Callable[[Path], object]], Path]
) -> Issued:
    def issue(folder: Path) -> None:
        path = folder / "issued.duckdb"
        shutil.copyfile(filled_once, path)
        stated = [
            "--date",
            "2026-03-10",
            "--laboratory",
            str(laboratory),
            "--out",
            str(folder / "out folder ü"),
        ]
        for campaign, run in (("five-days", 20), ("five-days", 19), ("cold-cold", 3)):
            assert (
                main(["--db", str(path), "certificate", "issue", campaign, "--run", str(run), *stated]) == 0
            )

    folder = made_once("three-certificates", issue)
    return Issued(folder / "issued.duckdb", folder / "out folder ü")


@pytest.fixture
def issued(issued_once: Issued, tmp_path: Path) -> Issued:
    path = tmp_path / "issued.duckdb"
    shutil.copyfile(issued_once.db, path)
    return Issued(path, issued_once.folder)
