"""Write the archive of the present version: a small database, compressed, and what a reader must find in it."""

from __future__ import annotations

import gzip
import json
import tempfile
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import numpy as np

from monitor import __version__, store
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
from monitor.units import DEGREE, MICROMETRE, MICRORADIAN

HERE = Path(__file__).resolve().parent


def small_campaign() -> Campaign:
    """Two runs of three touches, with everything that a campaign can have; every number is made up."""
    start = datetime(2026, 3, 2, 8, 37, 6, 421766, timezone(timedelta(hours=-5)))
    return Campaign(
        "archive",
        "samba",
        Machine(
            "M-1",
            "w C B X b Z Y (C1) t",
            location="hall 3",
            axes={"X": AxisSettings("X", -1, (-0.1, 500.3), 20.0)},
            tolerances={"EC0Y": 20.0},
        ),
        Probe("probe-1", "touch-trigger", 0.001, (0.1, 0.2, -120.3), "probe certificate"),
        Artefact(
            "two balls",
            (Ball("S1", (118.0, 6.1, 178.8), 19.05), Ball("S2", (-4.0, 0.1, 153.4), 19.05)),
            ScaleBar(("S1", "S2"), 304.98923, 0.0012, "bar certificate", 1.15e-5, 20.0),
        ),
        (
            Run(1, start, 1, True, {"ambient_degC": 22.08}),
            Run(2, start + timedelta(hours=1), 1, False, {"ambient_degC": 22.29}),
        ),
        Probings(
            np.array([1, 1, 1, 2, 2, 2]),
            np.array([1, 2, 3, 1, 2, 3]),
            np.array([0.0, 62.9, 125.7, 0.0, 60.1, 120.3]),
            np.array(["S1", "S2", "S1", "S1", "S2", "S1"]),
            {
                "X": np.array([191.060674, -72.530157, 0.1, 26.519621, 1e-6, -0.3]),
                "B": np.array([-60.0, -235.123456, 0.1, 29.9998, 359.99999, 123.4567]) * DEGREE.factor,
            },
            {"x_axis_degC": np.array([21.536, np.nan, 21.6, 21.7, -0.1, 22.1])},
        ),
        (SourceFile("campaign.toml", b"format = 1\n"), SourceFile("runs.csv", b"\xef\xbb\xbfrun\r\n")),
    )


def fill(db: store.Database) -> None:
    """Keep one of everything."""
    campaign = small_campaign()
    store.import_campaign(db, campaign)
    store.save_model(db, "samba", ["EA0B", "EX0C", "EX0C1"])
    store.save_model(
        db, "samba", ["EA0B", "EX0C", "EX0C1", "EXX:reversal"], parent=("samba", 1), note="worn nut"
    )
    covariance = np.array([[4e-12, 1e-13, np.nan], [1e-13, 9e-8, np.nan], [np.nan, np.nan, np.nan]])
    store.save_identification(
        db,
        store.StoredIdentification(
            campaign.name,
            "samba",
            1,
            "samba",
            ("EA0B", "EX0C", "EX0C1"),
            (MICRORADIAN, MICROMETRE, MICROMETRE),
            tuple(
                store.StoredRun(
                    run,
                    np.array([1e-5 / 3, 0.1e-3 * run, np.nan]),
                    covariance * run,
                    ((("EX0C1", "tip x"), "the spindle is never indexed"),),
                    0.00125 * run,
                    4,
                    17,
                    16.5,
                    np.array([1, 2, 3]),
                    np.array([[0.125, 0.25, 0.5], [-0.1, 1 / 3, 0.0], [0.0, 2e-3, -1e-3]]) * run,
                )
                for run in (1, 2)
            ),
        ),
    )
    document = {"k_p": 4.73, "u_urad": {"EA0B": 1 / 3}}
    store.save_analysis(
        db, "uncertainty", document, method="mcm", campaign=campaign.name, run=1, model="samba", seed=20260302
    )
    for number in ("C-1", "C-2"):
        store.save_certificate(
            db, number, "issued", campaign.name, [1, 2], {"number": number}, number.encode()
        )
    store.mark_certificate(db, "C-1", "amended", "name of the customer", "C-2")
    store.record_event(db, "M-1", datetime(2026, 3, 5, 12, tzinfo=UTC), "repair", "zero of B reset")
    store.save_selection(db, campaign.name, "warm", "warm_up == 0", [2])


def expected(db: store.Database) -> dict[str, object]:
    """What every later version must find."""
    campaign = store.load_campaign(db, "archive")
    identification = store.load_identification(db, "archive", "samba", 1)
    return {
        "last_audit_sha256": store.verify_audit(db).last_sha256,
        "files": {file.name: file.sha256 for file in campaign.files},
        "started_at": [run.started_at.isoformat() for run in campaign.runs],
        "readings": {axis: values.tolist() for axis, values in campaign.probings.readings.items()},
        "estimates": [np.nan_to_num(run.estimate).tolist() for run in identification.runs],
        "residuals": [run.residuals.tolist() for run in identification.runs],
        "effects": [list(model.effects) for model in store.model_history(db, "samba")],
        "uncertainty": dict(store.load_analysis(db, "uncertainty").document),
        "certificates": {
            number: [certificate.state, certificate.pdf_sha256]
            for number in ("C-1", "C-2")
            for certificate in [store.load_certificate(db, number)]
        },
        "events": [event.description for event in store.list_events(db)],
        "selections": {"warm": list(store.find_selection(db, "warm").runs)},
    }


def main() -> None:
    """Write ``monitor-VERSION.duckdb.gz`` and ``monitor-VERSION.json``."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "archive.duckdb"
        with store.Database(path, actor="make_archive") as db:
            fill(db)
            content = expected(db)
        # Level 9 takes the file, mostly empty blocks, to a few kilobytes; no time stamp in it.
        packed = gzip.compress(path.read_bytes(), 9, mtime=0)
    (HERE / f"monitor-{__version__}.duckdb.gz").write_bytes(packed)
    text = json.dumps(content, indent=1, ensure_ascii=False)
    (HERE / f"monitor-{__version__}.json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
