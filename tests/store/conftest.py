"""A small campaign with awkward names, an identification of it, and an open database."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest

from monitor.records import (
    Artefact,
    AxisSettings,
    Ball,
    Campaign,
    Machine,
    Probe,
    Probings,
    Run,
    ScaleBar,
    SourceFile,
)
from monitor.sources import CommonQuantity
from monitor.store import (
    Database,
    StoredIdentification,
    StoredRun,
    import_campaign,
    record_event,
    save_analysis,
    save_certificate,
    save_identification,
    save_model,
)
from monitor.units import DEGREE, MICROMETRE, MICRORADIAN

#: As a controller prints them, among them degrees whose radians do not divide back to the same double.
PRINTED_DEGREES = np.array([-60.0, -235.123456, 0.1, 29.9998, 359.99999, 123.4567])
PRINTED_MM = np.array([191.060674, -72.530157, 0.1, 26.519621, 1e-6, -0.3])


@pytest.fixture(scope="session")
def make_campaign() -> Callable[..., Campaign]:
    """A factory of campaigns of two runs with three touches each."""

    def make(
        name: str = 'Märzkampagne "o\'hara"; DROP TABLE run',
        machine_id: str = "HU40 'T'",
        topology: str = "w C B X b Z Y (C1) t",
        location: str = "hall 3",
        files: tuple[tuple[str, bytes], ...] = (
            ("campaign.toml", b"format = 1\n"),
            ("probings.csv", b"\xef\xbb\xbfrun,sequence\r\n"),
            ("runs.csv", b"run\n"),
        ),
        start: datetime = datetime(2026, 3, 2, 8, 37, 6, 421766, timezone(-timedelta(hours=5))),
    ) -> Campaign:
        return Campaign(
            name,
            "samba",
            Machine(
                machine_id,
                topology,
                manufacturer="Mitsui Seiki",
                location=location,
                axes={
                    "X": AxisSettings("X", -1, (-0.1, 500.3), 20.0),
                    "B": AxisSettings("B", None, (-1.1, 0.3)),
                },
                tolerances={"EC0Y": 20.0, "EXX": 0.1},
            ),
            Probe("probe-1", "touch-trigger", 0.001, (0.1, 0.2, -120.3), "probe certificate"),
            Artefact(
                "four balls",
                (Ball("S1", (118.0, 6.1, 178.8), 19.05), Ball("β", (-4.0, 0.1, 153.4), 19.05)),
                ScaleBar(("S1", "β"), 304.98923, 0.0012, "bar certificate 2016-04", 1.15e-5, 20.0),
            ),
            (
                Run(2, start, 1, True, {"ambient_degC": 22.08, "humidity_percent": 41.3}),
                Run(1, start + timedelta(hours=1), 2, False, {}),
            ),
            Probings(
                np.array([2, 2, 2, 1, 1, 1]),
                np.array([1, 2, 3, 1, 2, 3]),
                np.array([0.0, 62.9, 125.7, 0.0, 60.1, 120.3]),
                np.array(["S1", "β", "S1", "S1", "β", "S1"]),
                {"X": PRINTED_MM, "B": PRINTED_DEGREES * DEGREE.factor, "C1": np.zeros(6)},
                {"x_axis_degC": np.array([21.536, np.nan, 21.6, np.nan, -0.0, 22.1])},
            ),
            tuple(SourceFile(file, content) for file, content in files),
        )

    return make


@pytest.fixture
def campaign(make_campaign: Callable[..., Campaign]) -> Campaign:
    """The small campaign as it is."""
    return make_campaign()


@pytest.fixture
def make_identification() -> Callable[..., StoredIdentification]:
    """A factory of identifications of three parameters, one of them refused."""

    def make(
        campaign: Campaign, runs: tuple[int, ...] = (2, 1), version: int = 1, shift: float = 0.0
    ) -> StoredIdentification:
        covariance = np.array([[4e-12, 1e-13, np.nan], [1e-13, 9e-8, np.nan], [np.nan, np.nan, np.nan]])
        return StoredIdentification(
            campaign.name,
            "samba",
            version,
            "samba",
            ("EA0B", "EX0C", "EX0C1"),
            (MICRORADIAN, MICROMETRE, MICROMETRE),
            tuple(
                StoredRun(
                    run,
                    np.array([(1 / 3 + shift) * 1e-5, 0.1e-3 * run, np.nan]),
                    covariance * run,
                    ((("EX0C1", "tip x"), "the spindle is never indexed"),),
                    0.001234 * run,
                    4,
                    17,
                    16.3 / run,
                    np.array([1, 2, 3]),
                    np.array([[0.1, 0.2, 0.3], [-0.1, 1 / 3, 0.0], [0.0, 2e-3, -1e-3]]) * run,
                    {
                        CommonQuantity("a laser", "C-7", "scale", 1e-6): np.array(
                            [0.0, 1e-6 / 3 * run, np.nan]
                        )
                    },
                )
                for run in runs
            ),
        )

    return make


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Where a database may be made; the name needs quoting."""
    return tmp_path / "o'hara ü.duckdb"


@pytest.fixture
def db(path: Path) -> Iterator[Database]:
    """An open, empty database."""
    with Database(path, actor="the test") as database:
        yield database


@pytest.fixture
def filled(
    db: Database, campaign: Campaign, make_identification: Callable[..., StoredIdentification]
) -> Database:
    """A database with a campaign and its identification."""
    import_campaign(db, campaign)
    save_identification(db, make_identification(campaign))
    return db


@pytest.fixture(scope="session")
def everything_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the file of ``something_of_everything`` is kept once it was made, to be copied."""
    return tmp_path_factory.mktemp("everything") / "everything.duckdb"


@pytest.fixture
def something_of_everything(
    path: Path,
    everything_once: Path,
    make_campaign: Callable[..., Campaign],
    make_identification: Callable[..., StoredIdentification],
) -> Iterator[Database]:
    """A database with something of everything."""
    if not everything_once.exists():
        with Database(everything_once, actor="the test") as database:
            _fill(database, make_campaign, make_identification)
    shutil.copy(everything_once, path)
    with Database(path, actor="the test") as database:
        yield database


def _fill(
    db: Database,
    make_campaign: Callable[..., Campaign],
    make_identification: Callable[..., StoredIdentification],
) -> None:
    one = make_campaign("one")
    import_campaign(db, one)
    import_campaign(db, make_campaign("two"))
    save_model(db, "samba", ["EA0B"])
    save_identification(db, make_identification(one))
    save_analysis(db, "uncertainty", {"a": 1}, method="guf", campaign="one")
    save_certificate(db, "C-1", "issued", "one", [1], {"a": 1}, b"pdf")
    record_event(db, one.machine.id, datetime(2026, 1, 1, tzinfo=UTC), "crash", "x")
