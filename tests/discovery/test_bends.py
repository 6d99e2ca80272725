"""A guideway that bends about the middle of its travel, in readings whose zero lies at one end: named by its powers.

Lasers along X near the table and higher up, a ball bar in three planes, and straightedges; simulated without the
package.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from monitor.discovery import explain
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from monitor.workflow.explain.machine_answer import machine_explanation
from tests.simulator.instruments import SimulatedAxis, SimulatedChain, X, Y, Z

TOOL = [0.0, 0.0, -120.0]
CENTRE = {"X": 250.0, "Y": 200.0, "Z": 320.0}
PITCH = 25e-6


def setup(name: str, reading: str, words: str) -> str:
    """The text of a setup of 0.3 um."""
    return (
        f'\n[[setups]]\nid = "{name}"\nreading = "{reading}"\nstandard_uncertainty_um = 0.3\n'
        f"tool_point_mm = {TOOL}\n{words}\n"
    )


def test_a_pitch_about_the_middle_of_the_travel_is_a_line_and_a_parabola(tmp_path: Path) -> None:
    """The scan takes the bend of the positioning, which no height agrees with; of free shape the pitch had eight parts
    and no name. Hidden: 25 urad at both ends."""
    rng = np.random.default_rng(4)
    chain = SimulatedChain(
        axes=(
            SimulatedAxis("X", "linear", X, motion=lambda x: (0, 0, 0, 0, PITCH * ((x - 250) / 250) ** 2, 0)),
            SimulatedAxis("Z", "linear", Z, errors=(0, 0, 0, 2e-5, -3e-5, 0)),
        ),
        work=(SimulatedAxis("Y", "linear", Y, sign=-1),),
    )
    heights = {"laser-low": 200.0, "laser-high": 450.0}
    setups = "".join(
        setup(name, "displacement", 'direction = "X"\ndirection_standard_uncertainty_urad = 200.0')
        for name in heights
    )
    setups += setup("edge", "offset", 'direction = "Z"\nalong = "X"')
    setups += "".join(
        setup(
            f"bar-{plane}",
            "distance",
            'instrument = "bar"\nwork_point_mm = [250.0, 200.0, 200.0]\nlength_mm = 150.0\n'
            "length_standard_uncertainty_um = 0.3",
        )
        for plane in ("XY", "YZ", "ZX")
    )
    rows = []
    travel = np.r_[np.linspace(0.0, 500.0, 31), np.linspace(500.0, 0.0, 31)]
    for name, component in (*((name, 0) for name in heights), ("edge", 2)):
        readings = [CENTRE | {"X": float(x), "Z": heights.get(name, CENTRE["Z"])} for x in travel]
        seen = np.array([(chain.seen(pose) @ [*TOOL, 1.0])[component] for pose in readings])
        values = 1e3 * (seen - seen[0]) + rng.normal(0.0, 0.3, len(seen))
        rows += [
            {**pose, "setup": name, "reading_um": value} for pose, value in zip(readings, values, strict=True)
        ]
    for plane in ("XY", "YZ", "ZX"):
        for angle in np.deg2rad(np.arange(0.0, 361.0, 5.0)):
            pose = CENTRE | {
                plane[0]: CENTRE[plane[0]] + 150.0 * float(np.cos(angle)),
                plane[1]: CENTRE[plane[1]] + 150.0 * float(np.sin(angle)),
            }
            off = (chain.seen(pose) @ [*TOOL, 1.0])[:3] - np.array([250.0, 200.0, 200.0])
            value = 1e3 * (np.linalg.norm(off) - 150.0) + rng.normal(0.0, 0.3)
            rows.append({**pose, "setup": f"bar-{plane}", "reading_um": value})
    campaign = read_campaign(chain.write(tmp_path / "bend", setups, rows))
    problem = campaign_method(campaign).problem_of(campaign)
    answer = explain(campaign, problem, "instruments", rng=np.random.default_rng(1))
    assert sorted(effect.effect for effect in answer.missing) == ["EBX:poly1", "EBX:poly2"]
    # Each takes the part of the other, so that both are added together.
    assert sorted(machine_explanation(answer).added_together) == ["EBX:poly1", "EBX:poly2"]
    parabola = next(effect for effect in answer.missing if effect.effect == "EBX:poly2")
    assert abs(parabola.amplitude - PITCH / 250.0**2) < 4 * parabola.u


def test_a_scale_that_bends_to_and_fro_about_its_middle_is_named_in_one_run(tmp_path: Path) -> None:
    """A plate of 12 by 10 points, measured once on a CMM: 8 um at both ends of X, 2 um of noise. One run shows no lack
    of fit, neither power alone comes near, nor does a part of a free shape: nothing was named."""

    def errors(x: float) -> tuple[float, ...]:
        return (8e-3 * ((x - 225.0) / 225.0) ** 3, 0.0, 0.0, 0.0, 0.0, 0.0)

    chain = SimulatedChain((SimulatedAxis("Y", "linear", Y), SimulatedAxis("X", "linear", X, motion=errors)))
    rng = np.random.default_rng(5)
    grid = [(x, y) for x in np.linspace(0.0, 450.0, 12) for y in np.linspace(0.0, 380.0, 10)]
    rows: list[dict[str, object]] = []
    for index in rng.permutation(len(grid)):
        at = dict(zip("XY", np.round(grid[index], 4), strict=True))
        point = chain.pose(at)[:2, 3] + rng.normal(0.0, 2e-3, 2)
        rows.append(
            {"setup": "cmm", **at, "point_x_mm": point[0], "point_y_mm": point[1], "point_z_mm": None}
        )
    setup_of_cmm = '\n[[setups]]\nid = "cmm"\nreading = "point"\nstandard_uncertainty_um = 2.0\n'
    campaign = read_campaign(chain.write(tmp_path / "plate", setup_of_cmm, rows))
    answer = explain(
        campaign, campaign_method(campaign).problem_of(campaign), "instruments", rng=np.random.default_rng(1)
    )
    assert {effect.effect for effect in answer.missing} == {"EXX:poly2", "EXX:poly3"}
