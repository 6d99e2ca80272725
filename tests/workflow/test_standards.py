"""`standards`: simulated laser and ball-bar tests, whose figures follow from the errors that were put in."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.exceptions import DataError, NotFoundError
from monitor.readers import read_campaign
from monitor.store import Database, import_campaign
from monitor.workflow.standards.answer import StandardTest
from monitor.workflow.standards.request import StandardsRequest
from monitor.workflow.standards.standards import standards
from tests.methods.test_instruments import A, X, Y, Z, six
from tests.simulator.instruments import SimulatedChain

#: Y is on the work side with the sign of ISO 841, X and Z on the tool's; X and Y are 40 µrad out of square.
MACHINE = SimulatedChain(
    (A("X", "linear", X, errors=six(C=-40e-6)), A("Z", "linear", Z)), work=(A("Y", "linear", Y, sign=-1),)
)
SETUPS = """
[[setups]]
id = "laser-Y"
reading = "displacement"
standard_uncertainty_um = 0.1
direction = "Y"

[[setups]]
id = "diagonal"
reading = "displacement"
standard_uncertainty_um = 0.1
direction = [0.6, 0.8, 0.0]

[[setups]]
id = "bar"
reading = "distance"
standard_uncertainty_um = 0.1
length_mm = 150.0
length_standard_uncertainty_um = 0.2

[[setups]]
id = "edge"
reading = "offset"
standard_uncertainty_um = 0.1
direction = "X"
along = "Y"
"""


def row(setup: str, x: float, y: float, reading: float) -> dict[str, object]:
    return {"setup": setup, "X": x, "Y": y, "Z": 0.0, "reading_um": reading}


def rows() -> list[dict[str, object]]:
    """Y plays by 3 µm and has a gain of 20 µm/m; the circle and the diagonal see the squareness alone."""
    made = []
    for _ in range(3):
        for way in (1, -1):
            for y in np.linspace(0.0, 400.0, 9)[::way]:
                made.append(row("laser-Y", 0.0, y, 1e3 * y + 20e-3 * y - 1.5 * (1 - way)))
    for way in (1, -1):
        for s in np.linspace(0.0, 500.0, 6)[::way]:
            made.append(row("diagonal", 0.6 * s, 0.8 * s, 1e3 * s + 5e-3 * s))
    for degrees in [*range(0, 361, 5), *range(360, -1, -5)]:
        a = np.deg2rad(degrees)
        x, y = 150.0 * np.cos(a), 150.0 * np.sin(a)
        seen = MACHINE.seen({"X": x, "Y": y, "Z": 0.0})[:3, 3]
        made.append(row("bar", x, y, 1e3 * (np.linalg.norm(seen) - 150.0)))
    return made + [row("edge", 0.0, y, 0.0) for y in np.linspace(0.0, 400.0, 9)]


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory):
    folder = tmp_path_factory.mktemp("standards")
    with Database(folder / "shop.duckdb") as db:
        import_campaign(db, read_campaign(MACHINE.write(folder / "shop", SETUPS, rows())))
        yield db


def figures(test: StandardTest) -> dict[str, float]:
    return {figure.symbol: figure.value for figure in test.figures}


def test_every_test_is_recognised_and_has_the_figures_that_were_put_in(db: Database, tmp_path: Path) -> None:
    answer = standards(db, StandardsRequest("shop", csv=tmp_path / "figures.csv"))
    tests = {test.setup: test for test in answer.tests}
    assert [(test.test, test.of) for test in answer.tests] == [
        ("positioning", "Y"), ("diagonal", "Y X"), ("circle", "XY"),
    ]  # fmt: skip
    assert answer.left_out == ("edge",)
    laser = figures(tests["laser-Y"])
    # Readings that grow with Y forward; backward 3 µm less: B = +3 µm, E from 0 to 8 less -3.
    assert laser["B"] == pytest.approx(3.0, abs=1e-9)
    assert laser["B mean"] == pytest.approx(3.0, abs=1e-9)
    assert (laser["M"], laser["E"]) == pytest.approx((8.0, 11.0), abs=1e-9)
    assert figures(tests["diagonal"])["M"] == pytest.approx(2.5, abs=1e-9)
    circle = figures(tests["bar"])
    assert circle["G(b)"] == pytest.approx(6.0, abs=0.02)
    assert circle["H"] == pytest.approx(0.0, abs=1e-6)
    assert "5 runs in each direction; the fewest here are 3" in str(tests["laser-Y"].notes[0])
    lines = (tmp_path / "figures.csv").read_text(encoding="utf-8").splitlines()
    assert len(lines) == 1 + sum(len(test.figures) for test in answer.tests)


def test_the_same_seed_gives_the_same_uncertainties(db: Database) -> None:
    assert str(standards(db, StandardsRequest("shop"))) == str(standards(db, StandardsRequest("shop")))


def answered(folder: Path, setups: str, made: list[dict[str, object]]) -> dict[str, StandardTest]:
    folder.mkdir()
    with Database(folder / "shop.duckdb") as db:
        import_campaign(db, read_campaign(MACHINE.write(folder / "shop", setups, made)))
        return {test.setup: test for test in standards(db, StandardsRequest("shop")).tests}


def test_the_stated_scale_of_a_laser_is_in_u_of_its_axis_and_of_its_diagonal(tmp_path: Path) -> None:
    """Its share is by how much the figures move where all readings are off by the stated 2 um/m."""
    scale = "scale_standard_uncertainty_um_per_m = 2.0"
    stated_setups = SETUPS.replace('direction = "Y"', f'direction = "Y"\n{scale}').replace(
        "direction = [0.6", f"{scale}\ndirection = [0.6"
    )
    longer = [
        {**each, "reading_um": (1.0 + 2e-6) * float(str(each["reading_um"]))}
        if each["setup"] in ("laser-Y", "diagonal")
        else each
        for each in rows()
    ]
    exact = answered(tmp_path / "exact", SETUPS, rows())
    stated = answered(tmp_path / "stated", stated_setups, rows())
    moved = figures(answered(tmp_path / "moved", SETUPS, longer)["laser-Y"])
    for setup, travel in (("laser-Y", 400.0), ("diagonal", 500.0)):
        u = {figure.symbol: figure.u for figure in stated[setup].figures}
        without = {figure.symbol: figure.u for figure in exact[setup].figures}
        for symbol in ("M", "E"):
            assert u[symbol] == pytest.approx(np.hypot(without[symbol], 2e-3 * travel), rel=0.12), symbol
        assert u["B mean"] == pytest.approx(without["B mean"], rel=1e-9, abs=1e-12)
    assert moved["M"] - figures(exact["laser-Y"])["M"] == pytest.approx(0.8, abs=1e-3)


def test_a_scale_that_is_taken_as_exact_is_said_unless_it_holds_by_definition(tmp_path: Path) -> None:
    known = SETUPS.replace('direction = "Y"', 'direction = "Y"\nknown = ["scale"]')
    notes = {
        name: [str(note) for note in test.notes]
        for name, test in answered(tmp_path / "a", known, rows()).items()
    }
    said = "the scale of {} is taken as exact: u does not say how well it is known"
    assert not any(said.format("laser-Y") in note for note in notes["laser-Y"])
    assert any(said.format("diagonal") in note for note in notes["diagonal"])
    assert not any("scale" in note for note in notes["bar"])


def test_the_stated_scale_of_a_bar_is_in_u_of_its_radial_deviations(tmp_path: Path) -> None:
    scaled = SETUPS.replace(
        "length_mm = 150.0", "length_mm = 150.0\nscale_standard_uncertainty_um_per_m = 10.0"
    )
    u = {figure.symbol: figure.u for figure in answered(tmp_path / "a", scaled, rows())["bar"].figures}
    without = {figure.symbol: figure.u for figure in answered(tmp_path / "b", SETUPS, rows())["bar"].figures}
    assert u["F_XY max"] == pytest.approx(np.hypot(without["F_XY max"], 1.5), rel=1e-9)
    assert u["G(b)"] == without["G(b)"]


def test_a_setup_that_no_standard_evaluates_is_refused_and_a_wrong_name_too(db: Database) -> None:
    with pytest.raises(DataError, match="no setup of edge is a test of ISO 230-2, -4, -6, -7"):
        standards(db, StandardsRequest("shop", setup="edge"))
    with pytest.raises(NotFoundError, match="has no setup 'laser'; did you mean 'laser-Y'"):
        standards(db, StandardsRequest("shop", setup="laser"))


def test_the_plots_are_drawn(db: Database, tmp_path: Path) -> None:
    answer = standards(db, StandardsRequest("shop", setup="bar", figures=tmp_path / "plots"))
    assert [Path(file).name for file in answer.files] == ["bar-1.svg", "bar-1.png"]
    assert "<svg" in (tmp_path / "plots" / "bar-1.svg").read_text(encoding="utf-8")
