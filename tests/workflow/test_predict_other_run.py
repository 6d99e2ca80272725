"""Rows of another campaign are predicted from its own start: its time, its conditions, its first moves.

Readings of a laser along X are made here from a closed form, a gain that grows with the time of the run; those of a
tracker by the simulator of robots.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.store import Database
from monitor.workflow.intake.importing import ImportRequest, import_folders
from monitor.workflow.model.change import add_effect
from monitor.workflow.model.request import AddEffectRequest
from monitor.workflow.predict.answer import PredictAnswer
from monitor.workflow.predict.predict import predict
from monitor.workflow.predict.request import PredictRequest
from tests.simulator.instruments import SimulatedAxis, SimulatedChain
from tests.simulator.robot_campaign import FIXED, track, write_tracked

#: Of a reading in mm, and what the gain grows by.
NOISE, GROWTH = 3e-4, 40e-6
SETUP = (
    '\n[[setups]]\nid = "laser"\nreading = "displacement"\nstandard_uncertainty_um = 0.3\n'
    'direction = "X"\nknown = ["direction"]\ntool_point_mm = [0, 0, 0]\n'
)
#: How much of the growth is there at each of the rows, one a minute.
GROWN = {
    "EXX:poly1@run_time": lambda count: np.linspace(0.0, 1.0, count),
    "EXX:poly1@sequence": lambda count: np.linspace(0.0, 1.0, count),
    "EXX:poly1@warmup45min": lambda count: -np.expm1(-np.arange(count) / 45.0),
    "EXX:poly1@settling45min": lambda count: -np.expm1(-np.arange(count) / 45.0),
    "EXX:poly2@each_run": lambda count: np.ones(count),
}
#: The same, and what the run of the fit alone shows.
SHOWN = {
    **GROWN,
    "EXX:poly1@run_time(1)": lambda count: np.linspace(0.0, 1.0, count),
    "nothing": lambda count: np.zeros(count),
}


def _measured(folder: Path, name: str, effect: str, ways: int, started: str, seed: int) -> Path:
    """A laser there and back so many times, the gain growing from the start; all campaigns of one machine."""
    chain = SimulatedChain((SimulatedAxis("X", "linear", (1.0, 0.0, 0.0)),))
    stops = np.linspace(0.0, 500.0, 11)
    x = np.concatenate([stops[:: (-1) ** way] for way in range(ways)])
    shape = x**2 / 500.0 if "poly2" in effect else x
    off = GROWTH * SHOWN[effect](len(x)) * shape + np.random.default_rng(seed).normal(0.0, NOISE, len(x))
    rows = [
        {"setup": "laser", "X": float(at), "reading_um": 1e3 * float(at + by)}
        for at, by in zip(x, off, strict=True)
    ]
    written = chain.write(folder / name, SETUP, rows, started=(started,))
    text = (written / "campaign.toml").read_text()
    (written / "campaign.toml").write_text(text.replace(f'id = "{name}"', 'id = "machine"'))
    return written


def _predicted(
    tmp_path: Path, effect: str, ways: int, started: str, seed: int = 1, shown: str | None = None
) -> PredictAnswer:
    """What a model with the effect, fitted to four ways, says of another campaign, which has it or ``shown``."""
    folders = [
        _measured(tmp_path, "fitted", effect, 4, "2026-03-02T08:00:00+00:00", 1),
        _measured(tmp_path, "other", shown or effect, ways, started, seed),
    ]
    with Database(tmp_path / "one.duckdb") as db:
        import_folders(db, ImportRequest(folders))
        add_effect(db, AddEffectRequest(effect, to="instruments", new_name="grows"))
        return predict(db, PredictRequest("fitted", "grows", "other"))


@pytest.mark.parametrize("effect", GROWN)
def test_a_copy_of_the_fitted_rows_leaves_what_these_leave(tmp_path: Path, effect: str) -> None:
    answer = _predicted(tmp_path, effect, 4, "2026-03-02T08:00:00+00:00")
    assert answer.rms_um == pytest.approx(answer.fitted_rms_um, rel=1e-9)
    assert answer.fitted_rms_um == pytest.approx(0.3, rel=0.3)


@pytest.mark.parametrize("effect", GROWN)
@pytest.mark.parametrize("started", ["2026-03-02T18:00:00+00:00", "2026-05-09T06:00:00+00:00"])
def test_time_counts_from_the_start_of_the_other_run(tmp_path: Path, effect: str, started: str) -> None:
    """Another length of the run, later the same day or months later: what is left is noise."""
    answer = _predicted(tmp_path, effect, 2, started, seed=2)
    assert answer.rms_um == pytest.approx(0.3, rel=0.4)


@pytest.mark.parametrize("effect", GROWN)
def test_what_no_row_says_of_another_run_is_named(tmp_path: Path, effect: str) -> None:
    answer = _predicted(tmp_path, effect, 1, "2026-03-03T08:00:00+00:00")
    of_each_run = effect.endswith("@each_run")
    assert answer.taken_over == ((effect,) if of_each_run else ())
    assert answer.from_own_start == (() if of_each_run else (effect,))


def test_a_drift_of_the_fitted_run_alone_is_none_of_the_other_one(tmp_path: Path) -> None:
    effect = "EXX:poly1@run_time(1)"
    answer = _predicted(tmp_path, effect, 4, "2026-05-09T06:00:00+00:00", seed=2, shown="nothing")
    assert answer.fitted_rms_um == pytest.approx(0.3, rel=0.3)
    assert answer.rms_um == pytest.approx(0.3, rel=0.4)
    assert answer.from_own_start == ()


def test_rows_of_a_tracker_that_stayed_are_predicted_in_its_frame(tmp_path: Path) -> None:
    """One session in two files: what is left of the second is what the first leaves, on the tool and beside it. Each
    file had a guessed frame of its own: 0.2 mm and more were left."""
    whole = track(np.random.default_rng(11), poses=150, fixed_every=15)
    cut = next(row for row, name in enumerate(whole.target) if name in FIXED and row > 350)
    folders = [
        write_tracked(
            tmp_path / name,
            replace(
                whole, target=whole.target[part], readings=whole.readings[part], points=whole.points[part]
            ),
        )
        for name, part in (("fitted", slice(0, cut)), ("other", slice(cut, None)))
    ]
    with Database(tmp_path / "one.duckdb") as db:
        import_folders(db, ImportRequest(folders))
        answer = predict(db, PredictRequest("fitted", None, "other"))
    assert answer.fitted_rms_um == pytest.approx(20.0, rel=0.1)
    assert answer.rms_um == pytest.approx(20.0, rel=0.15)
