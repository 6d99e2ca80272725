"""`standards` of parts with profiles and faces: an S of two arcs, the flank of an S that leans, and a face.

Machine, cutting and measuring come from the simulator of homogeneous matrices; what the figures should be is worked out
here by the distance from the arcs' centres and a search of another kind.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy

from monitor.reporting.standard_tests import ScaleTakenAsExact
from tests.simulator.instruments import SimulatedChain
from tests.workflow.test_interpolation_standard import machine, readings_of
from tests.workflow.test_part_standard import (
    CUTTER,
    GAIN,
    ON_CMM,
    PLACE,
    SQUARE,
    THREE_AXES,
    TOOL,
    answer_of,
    cut,
    rows_of,
    values,
)

#: Radius of the two arcs of the S and the angle of each, mm and rad.
ARC, OPENING = 40.0, np.deg2rad(200.0)
#: A deviation of the wall that no move of the part and no radius takes away, mm, and how often it comes in the S.
WAVE, WAVES = 2e-3, 9.0
PROFILE, ZONE = "profile of the line beside the tool's axis, offset free", "minimum zone"


def s_curve(count: int = 61) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places (n, 2) of the tool's centre, outward normals (n, 2) of the wall and the place (n,) along, 0 to 1."""
    along = np.linspace(0.0, 1.0, 2 * count - 1)
    first = along <= 0.5
    turn = np.where(first, 2.0 * along, 2.0 * (1.0 - along)) * OPENING
    start = np.deg2rad(20.0)
    # The first arc goes around the origin; the second is its image in the point where they meet.
    out = np.column_stack([np.cos(start - turn), np.sin(start - turn)])
    meet = ARC * out[count - 1]
    places = np.where(first[:, None], ARC * out, 2.0 * meet - ARC * out)
    return places, np.where(first[:, None], out, out), along


def of_cmm(points: np.ndarray) -> list[dict]:
    seen = ON_CMM.apply(points) + PLACE
    return [dict(zip(("point_x_mm", "point_y_mm", "point_z_mm"), point, strict=True)) for point in seen]


def flat_s(chain: SimulatedChain, wave: float = 0.0) -> tuple[list[dict], np.ndarray, np.ndarray]:
    """Rows of an S that three axes cut, the wall points (n, 2) on the part and the normals (n, 2)."""
    places, out, along = s_curve()
    rows, walls = [], []
    for place, normal, at in zip(places, out, along, strict=True):
        readings = readings_of(chain, {}, np.array([*place, 5.0]), TOOL)
        off = CUTTER + wave * np.cos(2.0 * np.pi * WAVES * at)
        walls.append(cut(chain, readings) + off * np.array([*normal, 0.0]))
        rows.append({"setup": "cmm", **readings, "target": "S"})
    for row, cells in zip(rows, of_cmm(np.array(walls)), strict=True):
        row |= cells
    return rows, np.array(walls)[:, :2], out


def width_by_search(walls: np.ndarray, *, least: bool) -> float:
    """The width of the zone about two arcs, whose ends lie where they should, over shift, turn and radius: squares by
    scipy's least squares, the least width by a search of simplices begun there."""
    places, _, along = s_curve()
    meet = places[len(places) // 2]
    centres = np.where((along <= 0.5)[:, None], 0.0, 2.0 * meet)
    sides = np.where(along <= 0.5, 1.0, -1.0)

    def deviations(x: np.ndarray) -> np.ndarray:
        cosine, sine = np.cos(1e-3 * x[2]), np.sin(1e-3 * x[2])
        moved = walls @ np.array([[cosine, sine], [-sine, cosine]]) + x[:2]
        # Outside the first arc and inside the second.
        return sides * (np.linalg.norm(moved - centres, axis=1) - ARC) - x[3]

    fitted = scipy.optimize.least_squares(deviations, [0.0, 0.0, 0.0, CUTTER], xtol=1e-14, ftol=1e-14)
    if not least:
        return float(np.ptp(deviations(fitted.x)))
    best = fitted.x
    for _ in range(4):
        best = scipy.optimize.minimize(
            lambda x: 1e3 * np.ptp(deviations(x)), best, method="Nelder-Mead",
            options={"xatol": 1e-10, "fatol": 1e-10, "maxiter": 6000, "initial_simplex": best + 3e-3 * np.vstack(
                [np.zeros(4), np.eye(4)])},
        ).x  # fmt: skip
    return float(np.ptp(deviations(best)))


def test_an_s_of_two_arcs_by_three_axes_against_the_distance_from_the_centres(tmp_path: Path) -> None:
    """Squareness and gain leave what no place of the part and no radius of the cutter takes away."""
    rows, walls, _ = flat_s(THREE_AXES)
    figures = {name: value for (_, name), (value, _) in values(answer_of(tmp_path, THREE_AXES, rows)).items()}
    assert figures[PROFILE] == pytest.approx(1e3 * width_by_search(walls, least=False), rel=2e-3)
    assert figures[f"{PROFILE}, {ZONE}"] == pytest.approx(1e3 * width_by_search(walls, least=True), rel=5e-3)
    assert figures[f"{PROFILE}, {ZONE}"] <= figures[PROFILE]
    # Of the size that such errors move points by, so that nothing was fitted away.
    assert figures[PROFILE] > 0.3e3 * np.hypot(SQUARE, GAIN) * ARC


def test_a_wave_of_the_wall_is_the_profile_of_a_machine_without_errors(tmp_path: Path) -> None:
    chain = SimulatedChain(
        tuple(axis.__class__(axis.name, axis.kind, axis.about, sign=axis.sign) for axis in THREE_AXES.axes),
        work=tuple(
            axis.__class__(axis.name, axis.kind, axis.about, sign=axis.sign) for axis in THREE_AXES.work
        ),
    )
    figures = values(answer_of(tmp_path, chain, flat_s(chain, WAVE)[0]))
    assert figures["S", f"{PROFILE}, {ZONE}"][0] == pytest.approx(2e3 * WAVE, rel=0.03)
    (test,) = answer_of(tmp_path / "again", chain, flat_s(chain)[0]).tests
    assert max(figure.value for figure in test.figures) < 0.02
    assert [str(note) for note in test.notes] == [str(ScaleTakenAsExact("CMM"))]


def leaning_s(chain: SimulatedChain, made: SimulatedChain) -> list[dict]:
    """The flank of an S whose wall leans by up to 15 degrees along the way, cut by the side of the tool at two heights:
    as the S-shaped part, a ruled surface."""
    places, _, along = s_curve(31)
    rows, walls = [], []
    for name, height in (("low", 0.0), ("high", 25.0)):
        for place, at in zip(places, along, strict=True):
            tilt = 15.0 * float(np.sin(2.0 * np.pi * at))
            heading = float(360.0 * at)
            readings = readings_of(chain, {"A": tilt, "C": heading}, np.array([*place, 5.0]), TOOL)
            tool = np.linalg.inv(made.side(made.work, readings)) @ made.pose(readings)
            axis, point = tool[:3, 2], (tool @ [*TOOL, 1.0])[:3] + height * tool[:3, 2]
            step = (
                places[min(len(places) - 1, int(at * 60) + 1)] - places[max(0, int(at * 60) - 1)]
            ).tolist()
            normal = np.cross([*step, 0.0], axis)
            off = CUTTER + WAVE * np.cos(2.0 * np.pi * WAVES * at)
            walls.append(point + off * normal / np.linalg.norm(normal))
            rows.append({"setup": "cmm", **readings, "target": name})
    for row, cells in zip(rows, of_cmm(np.array(walls)), strict=True):
        row |= cells
    return rows


def test_the_flank_of_a_ruled_s_has_the_profile_of_its_wall_at_every_height(tmp_path: Path) -> None:
    clean = machine(np.zeros(3), 0.0)
    figures = values(answer_of(tmp_path / "clean", clean, leaning_s(clean, clean)))
    for name in ("low", "high"):
        assert figures[name, f"{PROFILE}, {ZONE}"][0] == pytest.approx(2e3 * WAVE, rel=0.08), name
    off = machine(np.array([20e-3, 0.0, 0.0]), 0.0)
    worse = values(answer_of(tmp_path / "off", off, leaning_s(clean, off)))
    # The table's axis lies 20 µm off: the path turns with the table, so the line is no longer where it should be.
    assert worse["low", f"{PROFILE}, {ZONE}"][0] > 2.0 * 2e3 * WAVE


def test_a_face_is_flat_to_what_a_plane_leaves_of_it(tmp_path: Path) -> None:
    """Z sinks by 5 µm in the middle of X; least squares by normal equations, the least zone by a search."""
    x, y = (grid.ravel() for grid in np.meshgrid(np.linspace(-80.0, 80.0, 9), np.linspace(-50.0, 50.0, 5)))
    # As a face is milled: to and fro.
    order = np.lexsort((np.where(np.round(y / 25.0) % 2 == 0, x, -x), y))
    x, y = x[order], y[order]
    sunk = -5e-3 * (1.0 - (x / 80.0) ** 2) + 2e-3 * np.sin(y / 17.0)
    rows, walls = [], []
    for place in np.column_stack([x, y]):
        rows.append(
            {"setup": "cmm", **readings_of(THREE_AXES, {}, np.array([*place, 20.0]), TOOL), "target": "face"}
        )
    walls = np.column_stack([x, y, 20.0 + sunk])
    for row, cells in zip(rows, of_cmm(walls), strict=True):
        row |= cells
    figures = {name: value for (_, name), (value, _) in values(answer_of(tmp_path, THREE_AXES, rows)).items()}
    columns = np.column_stack([x, y, np.ones(len(x))])
    left = sunk - columns @ np.linalg.solve(columns.T @ columns, columns.T @ sunk)
    assert figures["flatness"] == pytest.approx(1e3 * np.ptp(left), rel=1e-3)
    searched = scipy.optimize.minimize(
        lambda tilt: np.ptp(1e3 * sunk - tilt[0] * x - tilt[1] * y), [0.0, 0.0], method="Nelder-Mead",
        options={"xatol": 1e-9, "fatol": 1e-9},
    )  # fmt: skip
    assert figures["flatness, minimum zone"] == pytest.approx(searched.fun, rel=1e-3)


def test_u_of_a_profile_is_the_scatter_of_parts_measured_again() -> None:
    from monitor.statistics.standards.profiles import profile_of

    places, out, along = s_curve()
    nominal = np.column_stack([places, np.zeros(len(places))])
    normal = np.column_stack([out, np.zeros(len(out))])
    wall = nominal + (CUTTER + WAVE * np.cos(2.0 * np.pi * WAVES * along))[:, None] * normal
    axes, rng = np.tile([0.0, 0.0, 1.0], (len(places), 1)), np.random.default_rng(8)
    widths, u = [], 0.0
    for _ in range(60):
        profile = profile_of(wall + rng.normal(0.0, 2e-4, wall.shape), nominal, axes)
        assert profile is not None
        widths.append(profile.width)
        u += profile.figures("S", 2e-4, 0.0, rng)[0].u / 60
    assert u == pytest.approx(np.std(widths), rel=0.35)


def test_u_of_a_profile_holds_the_scale_of_the_instrument() -> None:
    """By profiles of the same wall in units of length drawn anew."""
    from monitor.statistics.standards.profiles import profile_of

    places, out, along = s_curve()
    nominal = np.column_stack([places, np.zeros(len(places))])
    normal = np.column_stack([out, np.zeros(len(out))])
    wall = nominal + (CUTTER + WAVE * np.cos(2.0 * np.pi * WAVES * along))[:, None] * normal
    axes, rng, scale = np.tile([0.0, 0.0, 1.0], (len(places), 1)), np.random.default_rng(8), 2e-5
    drawn = [profile_of(wall * (1.0 + rng.normal(0.0, scale)), nominal, axes) for _ in range(60)]
    profile = profile_of(wall, nominal, axes)
    assert profile is not None
    u = profile.figures("S", 0.0, scale, rng)[0].u
    assert u == pytest.approx(np.std([each.width for each in drawn if each is not None]), rel=0.35)


@pytest.mark.parametrize("repeated", [0, -1])
def test_a_point_that_is_measured_twice_at_an_end_takes_no_profile_away(repeated: int) -> None:
    from monitor.statistics.standards.profiles import profile_of

    places, out, along = s_curve()
    nominal = np.column_stack([places, np.zeros(len(places))])
    wall = nominal + (CUTTER + WAVE * np.cos(2.0 * np.pi * WAVES * along))[:, None] * np.column_stack(
        [out, np.zeros(len(out))]
    )
    twice = [0, *range(len(nominal))] if repeated == 0 else [*range(len(nominal)), -1]
    once, again = (
        profile_of(wall[rows], nominal[rows], np.tile([0.0, 0.0, 1.0], (len(rows), 1)))
        for rows in (list(range(len(nominal))), twice)
    )
    assert once is not None
    assert again is not None
    assert again.width == pytest.approx(once.width, rel=0.02)


def test_a_path_that_hardly_turns_and_has_no_straight_line_is_named(tmp_path: Path) -> None:
    bent = np.array([[x, 1e-3 * x**2, 0.0] for x in np.linspace(-40.0, 40.0, 21)])
    (test,) = answer_of(tmp_path, THREE_AXES, rows_of(THREE_AXES, {"bent": bent})).tests
    assert test.figures == ()
    assert str(test.notes[0]).startswith("bent: no figure: a profile turns by 30 degrees or more")
