"""Write a database whose records had fewer keys when it was written: setups of instruments, a curve, one of all else.

``instruments-2026-11-24.duckdb.gz`` was written by the version of commit 18700241, of 24 November 2026: its setups say
nothing of a drift, of a tool point's or a scale's uncertainty.
"""

from __future__ import annotations

import gzip
import sys
import tempfile
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from monitor import store
from monitor.records import (
    Artefact,
    AxisSettings,
    Campaign,
    ChainAxis,
    CurveCampaign,
    Instrument,
    KnownError,
    LShape,
    Machine,
    Module,
    Placement,
    Probe,
    Probings,
    Reflector,
    Run,
    SelfCalibration,
    Setup,
)
from monitor.sources import Quantity, Source
from monitor.units import DEGREE

HERE = Path(__file__).resolve().parent
START = datetime(2026, 3, 2, 8, 37, 6, tzinfo=UTC)
SETUPS = (
    Setup("laser", "displacement", 3e-4, "laser", (0.0, 0.0, -120.0), direction=(1.0, 0.0, 0.0),
          direction_uncertainty=2e-4, certificate="L-1"),
    Setup("bar", "distance", 5e-4, "bar", (0.0, 0.0, -120.0), (150.0, 120.0, 380.0), length=100.0,
          length_uncertainty=3e-4),
    Setup("r-test", "vector", None, "r-test", (0.0, 0.0, -120.0), (80.0, 0.0, 60.0), frame="tool"),
    Setup("dial", "component", 1e-3, direction=(0.0, 1.0, 0.0), known=("tool_point",)),
    Setup("level", "angle", 2e-6, direction=(0.0, 1.0, 0.0), side="work"),
    Setup("straight", "straightness", 1e-3, direction=(0.0, 0.0, 1.0), along="X"),
    Setup("tracker", "pose", 1e-2, tool_direction=(0.0, 0.0, 1.0), turn_uncertainty=5e-6),
)  # fmt: skip


def instruments() -> Campaign:
    """A machine of a chain with setups of seven kinds, and whatever else an artefact can have; all is made up."""
    count = len(SETUPS)
    return Campaign(
        "instruments",
        "instruments",
        Machine(
            "M-2",
            "Y C X Z",
            axes={"C": AxisSettings("C", 1, (-1.0, 1.0), gear_ratio=90.0)},
            chain=(
                ChainAxis("Y", "linear", "work", (0.0, 1.0, 0.0), sign=-1),
                ChainAxis("C", "rotary", "work", (0.0, 0.0, 1.0), (0.1, 0.2, 0.3)),
                ChainAxis("X", "linear", "tool", (1.0, 0.0, 0.0)),
                ChainAxis("Z", "linear", "tool", (0.0, 0.0, 1.0)),
            ),
            gravity=(0.0, 0.0, -1.0),
        ),
        Probe("none", "instruments", 0.001),
        Artefact(
            "none",
            (),
            reflectors=(Reflector("R1"), Reflector("base", fixed=True)),
            l_shape=LShape(100.0, 50.0, 1e-4, 1e-6, (Module("m1", (0.0, 0.0)), Module("m2", (50.0, 0.0))),
                           (Placement("XY", (1.0, 2.0, 3.0)),)),
            self_calibration=SelfCalibration({"X": (0.0, 50.0)}, KnownError("EXX(50)", 1e-3, 2e-4, "K-1"), ("EYX(0)",)),
            setups=SETUPS,
        ),
        (Run(1, START, 1, True, {"ambient_degC": 22.08}),),
        Probings(
            np.ones(count, dtype=np.int64),
            np.arange(1, count + 1),
            np.arange(count) * 60.3,
            np.array(["-"] * count),
            {"X": np.arange(count) * 10.1, "C": np.arange(count) * 7.3 * DEGREE.factor},
            {"setup": np.arange(1.0, count + 1), "reading_um": np.arange(count) / 7},
        ),
        sources=(Source(name="play of X", quantity=Quantity.EFFECT, size=1e-3, effect="EXX"),),
    )  # fmt: skip


def curve() -> CurveCampaign:
    """A curve of three rows."""
    forces = {"force_N": np.array([0.0, 1.0, 2.0]), "signal": np.array([0.1, 1.1, 2.2])}
    return CurveCampaign(
        "cell", "curve", Instrument("LC-1", model="cell"), "signal", "signal ~ force_N", forces,
        {}, {"force_N": "N", "signal": ""}, None, np.array([2, 3, 4]),
    )  # fmt: skip


def fill(db: store.Database) -> None:
    """Keep them, and one of everything that an entry of the audit holds and ``make_archive`` does not write."""
    store.import_campaign(db, instruments(), ("looks like inches",))
    store.import_curve(db, curve())
    store.save_model(db, "instruments", ["EXX"])
    store.save_machine_model(db, "M-2", "instruments", ("instruments", 1), "it has no B")
    store.save_analysis(db, "trend", {"slope": 1 / 3}, method="guf", machine="M-2")
    store.record_event(db, "M-2", START, "repair", "zero of C reset")
    store.save_selection(db, "instruments", "warm", "warm_up = 1", [1])
    store.record_refusal(db, "folder", ["no runs.csv"], campaign="second", machine="M-2")
    store.clear_refusals(db, "folder", "second")
    store.import_campaign(db, replace(instruments(), name="wrong"))
    store.withdraw_campaign(db, "wrong", "another bar")


def main(name: str) -> None:
    """Write ``NAME.duckdb.gz`` here."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "archive.duckdb"
        with store.Database(path, actor="make_instruments") as db:
            fill(db)
        (HERE / f"{name}.duckdb.gz").write_bytes(gzip.compress(path.read_bytes(), 9, mtime=0))


if __name__ == "__main__":
    main(sys.argv[1])
