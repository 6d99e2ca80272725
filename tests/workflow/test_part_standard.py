"""`standards` of parts that the machine cut: a circle-diamond-square and a cone frustum, from points of a CMM.

Machine, cutting and measuring come from the simulator of homogeneous matrices. What the figures should be follows from
the errors that were put in, by closed forms.
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
from tests.workflow.test_interpolation_standard import machine, readings_of

#: X and Y are out of square by this, rad; Y has a gain.
SQUARE, GAIN = 60e-6, 100e-6
THREE_AXES = SimulatedChain(
    (
        SimulatedAxis("X", "linear", (1.0, 0.0, 0.0), errors=(0.0, 0.0, 0.0, 0.0, 0.0, SQUARE)),
        SimulatedAxis("Z", "linear", (0.0, 0.0, 1.0)),
    ),
    work=(
        SimulatedAxis(
            "Y", "linear", (0.0, 1.0, 0.0), sign=-1, motion=lambda q: (0.0, GAIN * q, 0.0, 0.0, 0.0, 0.0)
        ),
    ),
)
SETUP = """
[[setups]]
id = "cmm"
reading = "point"
standard_uncertainty_um = 0.2
instrument = "CMM"
known = ["targets"]
tool_point_mm = [0.0, 0.0, -100.0]
"""
TOOL = np.array([0.0, 0.0, -100.0])
#: How the part lies on the CMM, and the radius of the tool, mm.
ON_CMM = Rotation.from_euler("zyx", [25.0, 0.5, -0.3], degrees=True)
PLACE, CUTTER = np.array([300.0, 150.0, 40.0]), 8.0


def path(points: np.ndarray) -> list[np.ndarray]:
    return list(points)


def side(start: tuple[float, float], end: tuple[float, float], z: float) -> np.ndarray:
    along = np.linspace(0.0, 1.0, 9)[:, None]
    return np.hstack([np.array(start) + along * (np.array(end) - np.array(start)), np.full((9, 1), z)])


def circle(centre: tuple[float, float], radius: float, z: float) -> np.ndarray:
    around = np.deg2rad(np.arange(0.0, 360.0, 10.0))
    return np.column_stack(
        [centre[0] + radius * np.cos(around), centre[1] + radius * np.sin(around), np.full(len(around), z)]
    )


def circle_diamond_square() -> dict[str, np.ndarray]:
    """Programmed paths of the tool's centre on the part: the square first, whose first side is the datum."""
    h, d = 80.0, 60.0
    corners = [(-h, -h), (h, -h), (h, h), (-h, h)]
    diamond = [(0.0, -d), (d, 0.0), (0.0, d), (-d, 0.0)]
    elements = {
        f"square-{number + 1}": side(corners[number], corners[(number + 1) % 4], 0.0) for number in range(4)
    }
    elements |= {
        f"diamond-{number + 1}": side(diamond[number], diamond[(number + 1) % 4], 10.0) for number in range(4)
    }
    elements["bore"] = circle((0.0, 0.0), 15.0, 5.0)
    elements["circle"] = circle((0.0, 0.0), 55.0, 20.0)
    elements["hole"] = circle((60.0, 60.0), 12.0, 0.0)
    return elements


def cut(chain: SimulatedChain, readings: dict[str, float]) -> np.ndarray:
    """Where the tool's centre was on the part."""
    return (chain.seen(readings) @ [*TOOL, 1.0])[:3]


def rows_of(
    chain: SimulatedChain, elements: dict[str, np.ndarray], noise: float = 0.0, *, z: bool = True
) -> list[dict]:
    rng, rows = np.random.default_rng(4), []
    for name, points in elements.items():
        middle = points.mean(axis=0)
        for point in points:
            readings = readings_of(chain, {}, point, TOOL)
            outward = point - middle
            if name.startswith(("square", "diamond")):
                outward = middle - (middle @ (points[-1] - points[0])) * (points[-1] - points[0]) / (
                    np.sum((points[-1] - points[0]) ** 2)
                )
                outward[2] = 0.0
            # The wall is the tool's radius further in.
            wall = cut(chain, readings) - CUTTER * outward / np.linalg.norm(outward)
            seen = ON_CMM.apply(wall) + PLACE + rng.normal(0.0, 1e-3 * noise, 3)
            cells = dict(zip(("point_x_mm", "point_y_mm", "point_z_mm"), seen, strict=True))
            if not z:
                cells["point_z_mm"] = None
            rows.append({"setup": "cmm", **readings, "target": name, **cells})
    return rows


def answer_of(folder: Path, chain: SimulatedChain, rows: list[dict], setup: str = SETUP) -> StandardsAnswer:
    campaign = read_campaign(chain.write(folder / "shop", setup, rows))
    with Database(folder / "shop.duckdb") as db:
        import_campaign(db, campaign)
        return standards(db, StandardsRequest("shop", figures=folder / "plots", csv=folder / "figures.csv"))


def values(answer: StandardsAnswer) -> dict[tuple[str, str], tuple[float, float]]:
    (test,) = answer.tests
    return {(figure.symbol, figure.name): (figure.value, figure.u) for figure in test.figures}


def test_a_circle_diamond_square_shows_the_squareness_and_the_gain_that_cut_it(tmp_path: Path) -> None:
    answer = answer_of(tmp_path, THREE_AXES, rows_of(THREE_AXES, circle_diamond_square()))
    (test,) = answer.tests
    assert (test.test, test.figures[0].standard) == ("part", "ISO 10791-7")
    figures = {name: value for name, (value, _) in values(answer).items()}
    # Sides along Y lean by the squareness against those along X, over 160 mm; sides along X stay parallel.
    assert figures["square-2", "perpendicularity to square-1"] == pytest.approx(
        1e3 * SQUARE * 160.0, abs=0.02
    )
    assert figures["square-3", "parallelism to square-1"] == pytest.approx(0.0, abs=0.02)
    # Seen from X, which turned by the squareness s, a point is at (x + s y, (1 + g) y): sides of the diamond turn by
    # g/2 + s/2 against the datum, up or down, over a length of 84.9 mm. A least-squares circle leaves (g^2 + s^2)^0.5.
    lean = {figures[f"diamond-{number}", "angularity to square-1"] for number in range(1, 5)}
    length = np.hypot(60.0, 60.0)
    wanted = sorted(abs(0.5 * (GAIN + sense * -SQUARE)) * 1e3 * length for sense in (1, -1))
    assert sorted(lean)[::3] == pytest.approx(wanted, abs=0.03)
    size = float(np.hypot(GAIN, SQUARE))
    for name, radius in (("bore", 15.0), ("circle", 55.0), ("hole", 12.0)):
        # Radial deviation r (g sin^2 + s sin cos): half the size of the wave of two, from end to end the whole.
        assert figures[name, "circularity"] == pytest.approx(1e3 * size * radius, rel=0.02), name
        assert figures[name, "circularity, minimum zone"] <= figures[name, "circularity"] + 1e-9
        assert figures[name, "circularity, minimum zone"] == pytest.approx(1e3 * size * radius, rel=0.03)
    assert figures["circle", "concentricity to bore, diameter of the zone"] == pytest.approx(0.0, abs=0.05)
    off = np.array([SQUARE * 60.0, GAIN * 60.0])
    assert figures[
        "hole", "position beside the first circle along square-1, diameter of the zone"
    ] == pytest.approx(2e3 * np.hypot(*off), rel=0.02)
    assert figures["square-1", "straightness"] == pytest.approx(0.0, abs=1e-3)
    assert [Path(file).name for file in answer.files[:2]] == ["cmm-1-part.svg", "cmm-1-part.png"]


def test_two_numbers_a_point_give_the_same_figures(tmp_path: Path) -> None:
    """A CMM whose plane is that of the part writes no z; the part lies flat there."""
    rows = rows_of(THREE_AXES, circle_diamond_square())
    flat = Rotation.from_euler("z", 25.0, degrees=True)
    for row in rows:
        point = ON_CMM.inv().apply(
            np.array([row["point_x_mm"], row["point_y_mm"], row["point_z_mm"]]) - PLACE
        )
        row["point_x_mm"], row["point_y_mm"], row["point_z_mm"] = *flat.apply(point)[:2], None
    figures = values(answer_of(tmp_path, THREE_AXES, rows))
    assert figures["square-2", "perpendicularity to square-1"][0] == pytest.approx(
        1e3 * SQUARE * 160.0, abs=0.02
    )
    assert figures["circle", "circularity"][0] == pytest.approx(1e3 * np.hypot(GAIN, SQUARE) * 55.0, rel=0.02)


@pytest.mark.all_seeds
def test_u_of_a_part_is_the_scatter_of_parts_measured_again(tmp_path: Path) -> None:
    """Twenty parts by one machine with 0.2 um of noise; the scatter of twenty is known to 16 %."""
    from monitor.statistics.standards.parts import Element, part_figures

    elements = circle_diamond_square()
    rng = np.random.default_rng(9)
    names = ("square-1", "square-2", "bore")
    again = []
    for _ in range(60):
        made = []
        for name in names:
            points = elements[name]
            is_circle = name == "bore"
            middle = points.mean(axis=0)
            direction = np.array([0.0, 0.0, 1.0]) if is_circle else (points[-1] - points[0]) / 160.0
            bent = points + 2e-3 * np.outer(np.linspace(-1.0, 1.0, len(points)) ** 2, [1.0, 1.0, 0.0])
            noisy = bent + rng.normal(0.0, 2e-4, points.shape)
            made.append(
                Element(name, is_circle, noisy, points, middle, direction, 15.0 if is_circle else 0.0)
            )
        again.append(part_figures(made, u_reading=2e-4, rng=np.random.default_rng(1)))
    for number, figure in enumerate(again[0]):
        scatter = np.std([each[number].value for each in again])
        ratio = np.mean([each[number].u for each in again]) / scatter
        assert 0.6 < ratio < 1.6, figure.kind


def test_the_stated_scale_of_a_cmm_is_in_u_of_places_alone(tmp_path: Path) -> None:
    """The hole is 84.9 mm from the bore and off by some micrometres: its place moves by twice the scale's part along
    where it is off, and no form does."""
    elements = {
        name: points for name, points in circle_diamond_square().items() if not name.startswith("diamond")
    }
    made = rows_of(THREE_AXES, elements)
    scaled = SETUP.replace(
        'instrument = "CMM"', 'instrument = "CMM"\nscale_standard_uncertainty_um_per_m = 30.0'
    )
    answers = {}
    for name, setup in (("exact", SETUP), ("scaled", scaled)):
        (tmp_path / name).mkdir()
        (answers[name],) = answer_of(tmp_path / name, THREE_AXES, made, setup).tests
    u = {name: {f"{f.symbol} {f.name}": f.u for f in answer.figures} for name, answer in answers.items()}
    values = {f"{f.symbol} {f.name}": f.value for f in answers["exact"].figures}
    (place,) = [name for name in values if name.startswith("hole position")]
    by_unit = 2.0 * 30e-3 * np.hypot(60.0, 60.0)
    assert 0.3 * by_unit < np.sqrt(u["scaled"][place] ** 2 - u["exact"][place] ** 2) < 1.1 * by_unit
    for name in values:
        if name != place and "concentricity" not in name:
            assert u["scaled"][name] == pytest.approx(u["exact"][name], rel=0.15), name
    assert any("the scale of CMM is taken as exact" in str(note) for note in answers["exact"].notes)
    assert not any("scale" in str(note) for note in answers["scaled"].notes)


def test_a_cone_frustum_of_five_axes_shows_its_angle_its_circles_and_how_they_lie(tmp_path: Path) -> None:
    """The table's axis is off by d: what the tool misses turns with the part, so that circles of the cone shift."""
    chain = machine(np.array([10e-3, 0.0, 0.0]), 0.0)
    half, lean = np.deg2rad(15.0), Rotation.from_euler("y", 10.0, degrees=True)
    base, rows = np.array([40.0, 0.0, 30.0]), []
    clean, cone_rows = machine(np.zeros(3), 0.0), {}
    for which, made in (("clean", clean), ("off", chain)):
        rows = []
        for name, height in (("lower", 0.0), ("upper", 25.0)):
            radius = 50.0 - height * np.tan(half)
            for degrees in np.arange(0.0, 360.0, 10.0):
                angle = np.deg2rad(degrees)
                local = np.array([radius * np.cos(angle), radius * np.sin(angle), height])
                point = base + lean.apply(local)
                turns = {"A": 10.0 * float(np.cos(angle)), "C": degrees}
                readings = readings_of(made, turns, point, TOOL)
                at = cut(made, readings)
                # Half an angle wider by 20 urad and an ellipse of 3 um, as a tool that bends would leave.
                out = lean.apply([np.cos(angle), np.sin(angle), 0.0])
                wall = at + (-20e-6 * height + 1.5e-3 * np.cos(2.0 * angle) - CUTTER) * out
                cells = dict(
                    zip(("point_x_mm", "point_y_mm", "point_z_mm"), ON_CMM.apply(wall) + PLACE, strict=True)
                )
                rows.append({"setup": "cmm", **readings, "target": name, **cells})
        cone_rows[which] = rows
    figures = values(answer_of(tmp_path / "clean", clean, cone_rows["clean"]))
    assert figures["upper", "circularity"][0] == pytest.approx(3.0, abs=0.05)
    assert figures["upper", "circularity, minimum zone"][0] == pytest.approx(3.0, abs=0.05)
    assert figures["upper", "concentricity to lower, diameter of the zone"][0] == pytest.approx(0.0, abs=0.01)
    angle = figures["upper", "half apex angle of the cone with lower, less the programmed one"]
    # The radius falls by 20e-6 more a mm of height: by cos^2 of the half angle in the angle.
    assert angle[0] == pytest.approx(20.0 * np.cos(half) ** 2, abs=0.1)
    assert angle[1] > 0.0
    off = values(answer_of(tmp_path / "off", chain, cone_rows["off"]))
    # An axis that is off shifts both circles alike to first order, with waves of A's turn: forms change.
    assert abs(off["upper", "circularity"][0] - 3.0) > 0.1


def test_points_whose_targets_are_unknown_are_no_part(tmp_path: Path) -> None:
    rows = rows_of(THREE_AXES, {"square-1": circle_diamond_square()["square-1"]})
    with pytest.raises(DataError, match="points of a part whose targets are known"):
        answer_of(tmp_path, THREE_AXES, rows, SETUP.replace('known = ["targets"]\n', ""))


def test_circles_side_by_side_without_a_side_have_no_position(tmp_path: Path) -> None:
    elements = circle_diamond_square()
    rows = rows_of(THREE_AXES, {name: elements[name] for name in ("bore", "hole")})
    (test,) = answer_of(tmp_path, THREE_AXES, rows).tests
    assert "no straight side was measured" in str(test.notes[0])
    assert not any("position" in figure.name for figure in test.figures)
