"""`standards` of an axis of rotation: two spheres on a turning table before sensors that stand still, simulated."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.exceptions import DataError
from monitor.readers import read_campaign
from monitor.store import Database, import_campaign
from monitor.workflow.standards.answer import StandardsAnswer
from monitor.workflow.standards.request import StandardsRequest
from monitor.workflow.standards.standards import standards
from tests.simulator.instruments import SimulatedAxis, SimulatedChain

#: Heights of the spheres over the table, mm; what the table does: a shift in X and a tilt about Y twice a turn, and an
#: axial motion once.
LOW, HIGH = 50.0, 150.0
RADIAL, TILT, AXIAL, NOISE = 3e-3, 20e-6, 2e-3, 5e-5


def table(q: float) -> tuple[float, ...]:
    """Error motions after C, in its turning frame: the shift and the tilt keep their directions in the machine's."""
    c, s = np.cos(np.deg2rad(q)), np.sin(np.deg2rad(q))
    shift, tilt = RADIAL * np.cos(2.0 * np.deg2rad(q)), TILT * np.cos(2.0 * np.deg2rad(q))
    return (c * shift, -s * shift, AXIAL * s, s * tilt, c * tilt, 0.0)


CHAIN = SimulatedChain(
    (SimulatedAxis("X", "linear", (1.0, 0.0, 0.0)), SimulatedAxis("Z", "linear", (0.0, 0.0, 1.0))),
    work=(
        SimulatedAxis("Y", "linear", (0.0, 1.0, 0.0), sign=-1),
        SimulatedAxis("C", "rotary", (0.0, 0.0, 1.0), motion=table),
    ),
)


def answer_of(folder: Path, frame: str = "tool", heights: tuple[float, ...] = (LOW, HIGH)) -> StandardsAnswer:
    rng, text, rows = np.random.default_rng(2), "", []
    for number, height in enumerate(heights):
        sphere = np.array([0.01 * number, -0.02, height])
        text += f'\n[[setups]]\nid = "sphere-{number}"\nreading = "vector"\nframe = "{frame}"\n'
        text += 'standard_uncertainty_um = 0.05\ninstrument = "nest of sensors"\n'
        text += f"work_point_mm = [0.0, 0.0, {height}]\n"
        for angle in [*np.arange(0.0, 360.0, 15.0)] * 2:
            readings = {"X": 0.0, "Y": 0.0, "Z": height, "C": float(angle)}
            work = CHAIN.side(CHAIN.work, readings)
            # The sensors stand where the tool is; the sphere moves with the table.
            off = (
                CHAIN.pose(readings)[:3, 3]
                - (work[:3, :3] @ sphere + work[:3, 3])
                + rng.normal(0.0, NOISE, 3)
            )
            cells = dict(zip(("dx_um", "dy_um", "dz_um"), 1e3 * off, strict=True))
            rows.append({"setup": f"sphere-{number}", **readings, **cells})
    campaign = read_campaign(CHAIN.write(folder / "spheres", text, rows))
    with Database(folder / "shop.duckdb") as db:
        import_campaign(db, replace(campaign))
        return standards(db, StandardsRequest("spheres"))


def test_iso_230_7_radial_axial_and_tilt_error_motions_are_those_that_were_put_in(tmp_path: Path) -> None:
    answer = answer_of(tmp_path)
    assert answer.left_out == ()
    figures = {(test.setup, figure.symbol): figure for test in answer.tests for figure in test.figures}
    # A shift of a cosine has twice its amplitude from end to end; of a tilt the sphere adds its height times that.
    for number, height in enumerate((LOW, HIGH)):
        radial = figures[f"sphere-{number}", "EXC synchronous"]
        assert radial.value == pytest.approx(2e3 * (RADIAL + TILT * height), abs=4.0 * 1e3 * NOISE)
        assert radial.standard.startswith("ISO 230-7")
        assert figures[f"sphere-{number}", "EYC total"].value < 8.0 * 1e3 * NOISE
        assert figures[f"sphere-{number}", "EZC synchronous"].value == pytest.approx(2e3 * AXIAL, abs=0.2)
        asynchronous = figures[f"sphere-{number}", "EXC asynchronous"]
        assert 1e3 * NOISE < asynchronous.value < 6.0 * 1e3 * NOISE
    tilt = figures["sphere-0, sphere-1", "EBC synchronous"]
    assert tilt.unit == "µrad"
    assert tilt.value == pytest.approx(2e6 * TILT, abs=4.0 * tilt.u)
    assert figures["sphere-0, sphere-1", "EAC total"].value < 8.0


def test_sensors_that_turn_with_the_axis_show_no_error_motion_in_fixed_directions(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="sensors that stand still around the one axis that turns"):
        answer_of(tmp_path, frame="work", heights=(LOW,))
