"""`standards` of axes that move together (ISO 10791-6) on a trunnion machine, against closed forms and plain loops.

The machine, its errors and the readings come from the simulator of homogeneous matrices; what the figures should be is
worked out here from the same errors by cosines and sines alone.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from monitor.exceptions import DataError
from monitor.readers import read_campaign
from monitor.store import Database, import_campaign
from monitor.workflow.standards.answer import StandardsAnswer
from monitor.workflow.standards.request import StandardsRequest
from monitor.workflow.standards.standards import standards
from tests.simulator.instruments import SimulatedAxis, SimulatedChain

#: Where the table's axis is off, mm, and how far it is tilted about X, rad.
OFF, TILT = np.array([12e-3, -5e-3, 0.0]), 30e-6
#: A's axis lies 80 mm below the table's origin.
DEPTH = 80.0


def machine(
    off: np.ndarray = OFF, tilt: float = TILT, *, sign: int = -1, head: bool = False
) -> SimulatedChain:
    """A machine with X and Z on the tool's side and Y, A and C on the work's; ``head``: C turns the tool instead."""
    errors = (*off, tilt, 0.0, 0.0)
    c = SimulatedAxis("C", "rotary", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0 if head else DEPTH), sign, errors)
    x, z = SimulatedAxis("X", "linear", (1.0, 0.0, 0.0)), SimulatedAxis("Z", "linear", (0.0, 0.0, 1.0))
    y = SimulatedAxis("Y", "linear", (0.0, 1.0, 0.0), sign=-1)
    a = SimulatedAxis("A", "rotary", (1.0, 0.0, 0.0), (0.0, 0.0, -DEPTH), -1)
    return SimulatedChain((x, z, c), work=(y,)) if head else SimulatedChain((x, z), work=(y, a, c))


def readings_of(chain: SimulatedChain, turns: dict[str, float], point: np.ndarray, tool: np.ndarray) -> dict:
    """Readings of X, Y and Z that bring the ``tool`` point of a machine without errors to a ``point`` of the work."""
    bare = {"X": 0.0, "Y": 0.0, "Z": 0.0, **turns}

    def seen(readings: dict) -> np.ndarray:
        work = chain.side(chain.work, readings, perfect=True)
        return chain.pose(readings, perfect=True) @ [*tool, 1.0] - work @ [*point, 1.0]

    slopes = np.column_stack([seen({**bare, axis: 1.0}) - seen(bare) for axis in "XYZ"])[:3]
    solved = np.linalg.solve(slopes, -seen(bare)[:3])
    return {**bare, **dict(zip("XYZ", solved, strict=True))}


def relative(chain: SimulatedChain, readings: dict, point: np.ndarray, tool: np.ndarray) -> np.ndarray:
    """From the point of the work to that of the tool, in the frame of the work."""
    return (chain.seen(readings) @ [*tool, 1.0])[:3] - point


VECTOR = """
[[setups]]
id = "{id}"
reading = "vector"
standard_uncertainty_um = 0.1
frame = "{frame}"
tool_point_mm = {tool}
work_point_mm = {work}
"""
BAR = """
[[setups]]
id = "{id}"
reading = "distance"
standard_uncertainty_um = 0.1
length_mm = 100.0
length_standard_uncertainty_um = 0.2
tool_point_mm = [0.0, 0.0, -100.0]
work_point_mm = {work}
"""
TOOL, SPHERE = np.array([0.0, 0.0, -100.0]), np.array([70.0, 20.0, 40.0])
#: Where the axis is off at the height of the sphere.
AT_SPHERE = OFF - [0.0, TILT * SPHERE[2], 0.0]


def answer_of(folder: Path, chain: SimulatedChain, setups: str, rows: list[dict]) -> StandardsAnswer:
    campaign = read_campaign(chain.write(folder / "shop", setups, rows))
    with Database(folder / "shop.duckdb") as db:
        import_campaign(db, campaign)
        return standards(db, StandardsRequest("shop", figures=folder / "plots", csv=folder / "figures.csv"))


def values(answer: StandardsAnswer, setup: str) -> dict[str, float]:
    (test,) = [test for test in answer.tests if test.setup == setup]
    return {figure.symbol: figure.value for figure in test.figures}


@pytest.mark.parametrize("frame", ["tool", "work"])
@pytest.mark.parametrize("sign", [-1, 1])
def test_bk2_by_an_r_test_shows_an_axis_that_lies_off_by_twice_as_much(
    tmp_path: Path, frame: str, sign: int
) -> None:
    """The program follows the sphere where it was met at 0 degrees. With the axis off by d and tilted by t about X the
    sphere then goes astray by (1 - R) d across, and by t times the way in Y in Z."""
    chain = machine(sign=sign)
    angles = [*np.arange(0.0, 361.0, 15.0), *np.arange(345.0, -1.0, -15.0)]
    rows, expected = [], []
    for angle in angles:
        readings = readings_of(chain, {"A": 0.0, "C": float(angle)}, SPHERE, TOOL)
        r = relative(chain, readings, SPHERE, TOOL)
        turn = Rotation.from_euler("z", sign * angle, degrees=True).as_matrix()
        # Where the sphere was met: off the nominal place by what the machine is off at 0 degrees.
        met = relative(chain, readings_of(chain, {"A": 0.0, "C": 0.0}, SPHERE, TOOL), SPHERE, TOOL)
        r = r - met if frame == "work" else turn @ (r - met)
        rows.append(
            {"setup": "r-test", **readings, **dict(zip(("dx_um", "dy_um", "dz_um"), 1e3 * r, strict=True))}
        )
        arm = turn @ SPHERE - SPHERE
        expected.append([*(turn @ AT_SPHERE - AT_SPHERE)[:2], TILT * arm[1]])
    setup = VECTOR.format(id="r-test", frame=frame, tool=TOOL.tolist(), work=SPHERE.tolist())
    answer = answer_of(tmp_path, chain, setup, rows)
    (test,) = answer.tests
    assert (test.test, test.of) == ("interpolation", "C Y X")
    assert test.figures[0].standard == "ISO 10791-6:2014"
    figures = values(answer, "r-test")
    # Products of errors are below 1 nm.
    across = 1e3 * np.ptp(np.array(expected), axis=0)
    assert [figures[name] for name in "XYZ"] == pytest.approx(across.tolist(), abs=2e-3)
    # Seen from the table the same circle: of a diameter of twice what the axis is off.
    for name in ("radial", "tangential"):
        assert figures[name] == pytest.approx(2e3 * np.hypot(*AT_SPHERE[:2]), rel=0.01), name
    assert figures["axial"] == pytest.approx(figures["Z"], abs=1e-6)
    assert figures["X+"] == pytest.approx(figures["X-"], abs=1e-9)
    assert len(answer.files) == 3
    assert test.notes == ()


def test_bk2_by_three_bars_reads_radial_tangential_and_axial(tmp_path: Path) -> None:
    """Bars that turn with the table read what the sphere does along them; the tilt is what the axial one sees."""
    chain = machine(sign=1)
    height = SPHERE[2]
    radial = np.array([SPHERE[0], SPHERE[1], 0.0]) / np.hypot(*SPHERE[:2])
    bars = {
        "radial": radial,
        "tangential": np.cross([0.0, 0.0, 1.0], radial),
        "axial": np.array([0.0, 0.0, 1.0]),
    }
    rows, expected, setups = [], {}, ""
    for name, along in bars.items():
        setups += BAR.format(id=name, work=SPHERE.tolist())
        seen = []
        for angle in np.arange(0.0, 361.0, 15.0):
            readings = readings_of(chain, {"A": 0.0, "C": float(angle)}, SPHERE + 100.0 * along, TOOL)
            length = np.linalg.norm(relative(chain, readings, SPHERE, TOOL))
            rows.append({"setup": name, **readings, "reading_um": 1e3 * (length - 100.0)})
            turn = Rotation.from_euler("z", angle, degrees=True).as_matrix()
            # The tool is right and the sphere of the work is where the axis carried it.
            sphere = OFF + Rotation.from_euler("x", TILT).as_matrix() @ (turn @ SPHERE)
            seen.append(-(turn @ along) @ (sphere - turn @ SPHERE))
        expected[name] = 1e3 * np.ptp(seen)
    answer = answer_of(tmp_path, chain, setups, rows)
    for name, wanted in expected.items():
        (figure,) = [
            figure
            for test in answer.tests
            if test.setup == name
            for figure in test.figures
            if figure.symbol == name
        ]
        assert figure.value == pytest.approx(wanted, abs=2e-3)
        # The range of readings of 0.1 um over a wave: its ends are two readings, of which the largest of several.
        assert 0.05 < figure.u < 0.2
        (test,) = [test for test in answer.tests if test.setup == name]
        assert "C turned in one sense" in str(test.notes[0])
    assert height == 40.0


@pytest.mark.parametrize(("head", "cosine"), [(False, 1.0), (True, 1.0)])
def test_an_axis_in_the_head_is_followed_as_one_in_the_table(
    tmp_path: Path, head: bool, cosine: float
) -> None:
    """C in the head turns the tool (test AK): a tool point 60 mm off its axis goes astray by (R - 1) d."""
    chain = machine(np.array([8e-3, 0.0, 0.0]), 0.0, sign=1, head=head)
    tool = np.array([60.0, 0.0, -100.0])
    rows = []
    for angle in np.arange(0.0, 361.0, 30.0):
        turns = {"C": float(angle)} if head else {"A": 0.0, "C": float(angle)}
        readings = readings_of(chain, turns, SPHERE, tool)
        r = relative(chain, readings, SPHERE, tool)
        rows.append(
            {"setup": "r-test", **readings, **dict(zip(("dx_um", "dy_um", "dz_um"), 1e3 * r, strict=True))}
        )
    setup = VECTOR.format(id="r-test", frame="work", tool=tool.tolist(), work=SPHERE.tolist())
    figures = values(answer_of(tmp_path, chain, setup, rows), "r-test")
    if head:
        # In the head the offset keeps its direction in the machine: nothing moves but what is constant.
        assert [figures[name] for name in ("X", "Y", "Z")] == pytest.approx([0.0, 0.0, 0.0], abs=1e-3)
    else:
        assert [figures[name] for name in ("X", "Y")] == pytest.approx([16.0 * cosine, 16.0], rel=1e-2)


def cone(chain: SimulatedChain, lean: float, degrees: np.ndarray) -> list[dict]:
    """Rows of a bar on the circle of a cone, whose axis leans by ``lean`` about X on the table; both axes turn."""
    base = Rotation.from_euler("x", lean, degrees=True)
    rows = []
    for angle in degrees:
        bar = base.apply([np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle)), 0.0])
        point = SPHERE + 100.0 * bar
        turns = {"A": 8.0 * float(np.sin(np.deg2rad(angle))), "C": float(angle) + 20.0}
        readings = readings_of(chain, turns, point, TOOL)
        length = np.linalg.norm(relative(chain, readings, SPHERE, TOOL))
        rows.append({"setup": "cone", **readings, "reading_um": 1e3 * (length - 100.0)})
    return rows


def test_bk4_by_a_bar_around_a_cone_has_the_circular_deviation_of_a_plain_fit(tmp_path: Path) -> None:
    """A least-squares circle by scipy in the plane of the path; a centre that is set 20 um off changes nothing."""
    degrees = np.concatenate([np.arange(0.0, 361.0, 6.0), np.arange(354.0, -1.0, -6.0)])
    rows = cone(machine(), 15.0, degrees)
    answer = answer_of(tmp_path, machine(), BAR.format(id="cone", work=SPHERE.tolist()), rows)
    (test,) = answer.tests
    assert (test.test, test.of, test.figures[0].standard) == ("circle", "C A Y X Z", "ISO 10791-6:2014")
    figures = {figure.symbol: figure.value for figure in test.figures}
    read = np.array([row["reading_um"] for row in rows])
    angle = np.deg2rad(degrees)
    columns = np.column_stack([np.ones_like(angle), np.cos(angle), np.sin(angle)])
    left = read - columns @ np.linalg.lstsq(columns, read, rcond=None)[0]
    assert figures["G(b)"] == pytest.approx(np.ptp(left), abs=2e-3)
    assert figures["G(b)"] > 1.0
    assert figures["H"] == pytest.approx(0.0, abs=1e-2)
    moved = np.array([0.02, -0.01, 0.005])
    off = [
        {
            **row,
            "reading_um": row["reading_um"]
            - 1e3 * moved @ Rotation.from_euler("x", 15.0, degrees=True).apply([np.cos(a), np.sin(a), 0.0]),
        }
        for row, a in zip(rows, angle, strict=True)
    ]
    again = answer_of(tmp_path / "off", machine(), BAR.format(id="cone", work=SPHERE.tolist()), off)
    assert {figure.symbol: figure.value for figure in again.tests[0].figures}["G(b)"] == pytest.approx(
        figures["G(b)"], abs=2e-3
    )


def test_bk4_by_three_sensors_has_the_ranges_of_the_machines_directions(tmp_path: Path) -> None:
    """Both axes turn at once while the tool keeps to a sphere: no radial direction, and the first reading is zero."""
    chain = machine()
    rows, seen = [], []
    for angle in np.arange(0.0, 361.0, 10.0):
        turns = {"A": 20.0 * float(np.sin(np.deg2rad(angle))), "C": float(angle)}
        readings = readings_of(chain, turns, SPHERE, TOOL)
        work = chain.side(chain.work, readings)
        r = work[:3, :3] @ relative(chain, readings, SPHERE, TOOL)
        seen.append(r)
        # Sensors in the spindle, with a zero of their own.
        cells = dict(zip(("dx_um", "dy_um", "dz_um"), 1e3 * r + [5.0, 7.0, -3.0], strict=True))
        rows.append({"setup": "r-test", **readings, **cells})
    setup = VECTOR.format(id="r-test", frame="tool", tool=TOOL.tolist(), work=SPHERE.tolist())
    figures = values(answer_of(tmp_path, chain, setup, rows), "r-test")
    assert list(figures) == ["X", "Y", "Z"]
    assert list(figures.values()) == pytest.approx(1e3 * np.ptp(seen, axis=0), abs=2e-3)


def test_a_grid_of_poses_is_no_test_of_axes_that_move_together(tmp_path: Path) -> None:
    chain, rows = machine(), []
    for number in range(12):
        readings = {"X": 10.0 * number, "Y": 0.0, "Z": 5.0, "A": 0.0, "C": 30.0 * number}
        rows.append({"setup": "r-test", **readings, "dx_um": 1.0, "dy_um": 2.0, "dz_um": 3.0})
    setup = VECTOR.format(id="r-test", frame="work", tool=TOOL.tolist(), work=SPHERE.tolist())
    with pytest.raises(DataError, match="a point or a bar that linear axes keep to while a rotary one turns"):
        answer_of(tmp_path, chain, setup, rows)


def test_u_of_a_range_is_the_scatter_of_tests_made_again() -> None:
    from monitor.statistics.standards.interpolation import followed

    rng = np.random.default_rng(11)
    angle = np.deg2rad(np.arange(0.0, 361.0, 10.0))
    wave = 5.0 * np.cos(angle)
    again = [
        followed(angle, wave + rng.normal(0.0, 0.3, len(angle)), u_reading=0.3, rng=np.random.default_rng(1))
        for _ in range(200)
    ]
    scatter = np.std([each.whole for each in again])
    # The scatter of 200 is known to 5 %; noise is laid on readings that have it already.
    assert 0.8 < np.mean([each.u["whole"] for each in again]) / scatter < 1.25
    assert np.isnan(again[0].backward)
