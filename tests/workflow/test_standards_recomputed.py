"""ISO 230-6, ISO 10791-6 and ISO 10791-7: every figure recomputed from the files, by other code, on drawn machines.

Machine, program and readings are made here with matrices of their own; what `standards` reports is compared with plain
loops over the rows as the files have them (ISO 230-2:2014, clause 3, along a diagonal; ranges along the machine's
directions and those of the rotary axis; zones of ISO 1101 with forms of least squares by scipy and minimum zones by
linear programmes). No text of ISO 10791-6 and -7 was at hand: the definitions are those of docs/instruments.md.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares, linprog
from scipy.spatial.transform import Rotation

from monitor.readers import read_campaign
from monitor.store import Database, import_campaign
from monitor.workflow.standards.answer import StandardTest
from monitor.workflow.standards.request import StandardsRequest
from monitor.workflow.standards.standards import standards

HEAD = (
    'format = 1\ncampaign = "shop"\nmethod = "instruments"\n\n[machine]\nid = "M"\ntopology = "{topology}"\n'
)
Rows = list[dict[str, float | str]]


def evaluated(folder: Path, topology: str, setups: str, rows: Rows) -> tuple[dict[str, StandardTest], Rows]:
    """The tests by their setups, and the rows as the file has them."""
    folder.mkdir()
    (folder / "campaign.toml").write_text(HEAD.format(topology=topology) + setups, encoding="utf-8")
    (folder / "runs.csv").write_text(
        "run,started_at,day,warm_up,ambient_degC\n1,2026-03-02T08:00:00+00:00,1,false,\n", encoding="utf-8"
    )
    columns = list(dict.fromkeys(name for row in rows for name in row))
    with (folder / "probings.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["run", "sequence", "time_s", *columns])
        for number, row in enumerate(rows, start=1):
            cells = [row.get(name, "") for name in columns]
            writer.writerow([1, number, 10.0 * number, *cells])
    with (folder / "probings.csv").open(encoding="utf-8") as file:
        read = [
            {name: cell if name in ("setup", "target") else float(cell) for name, cell in row.items() if cell}
            for row in csv.DictReader(file)
        ]
    with Database(folder / "shop.duckdb", threads=1) as db:
        import_campaign(db, read_campaign(folder))
        return {test.setup: test for test in standards(db, StandardsRequest("shop")).tests}, read


def figures(test: StandardTest) -> dict[str, float]:
    """Values by symbol."""
    return {figure.symbol: figure.value for figure in test.figures}


# ISO 230-6: the terms of ISO 230-2 along a diagonal.


def along_a_diagonal(
    places: Sequence[int], travel: Sequence[float], read_um: Sequence[float]
) -> dict[str, float]:
    """Clause 3 of ISO 230-2, target by target, of readings that count from the first one: the numbers of the targets in
    the order of measuring, where the machine was told to be (mm), and what was read."""
    deviations: dict[tuple[int, int], list[float]] = {}
    for number, (place, value) in enumerate(zip(places, read_um, strict=True)):
        before = [other for other in places[:number][::-1] if other != place]
        behind = [other for other in places[number + 1 :] if other != place]
        same = number > 0 and places[number - 1] == place
        # A target that is measured again was left beyond it and is approached as the next one is.
        way = np.sign(behind[0] - place) if (same or not before) and behind else np.sign(place - before[0])
        deviations.setdefault((place, int(way)), []).append(value - 1e3 * (travel[number] - travel[0]))
    targets = sorted({place for place, _ in deviations})
    mean = {key: sum(values) / len(values) for key, values in deviations.items()}
    s = {
        key: (sum((value - mean[key]) ** 2 for value in values) / (len(values) - 1)) ** 0.5
        for key, values in deviations.items()
    }
    up, down = [(place, 1) for place in targets], [(place, -1) for place in targets]
    reversal = [mean[a] - mean[b] for a, b in zip(up, down, strict=True)]
    middle = [(mean[a] + mean[b]) / 2.0 for a, b in zip(up, down, strict=True)]

    def band(keys: Sequence[tuple[int, int]]) -> float:
        return max(mean[k] + 2.0 * s[k] for k in keys) - min(mean[k] - 2.0 * s[k] for k in keys)

    def width(values: Sequence[float]) -> float:
        return max(values) - min(values)

    return {
        "B": max(abs(each) for each in reversal),
        "B mean": sum(reversal) / len(reversal),
        "R+": max(4.0 * s[key] for key in up),
        "R-": max(4.0 * s[key] for key in down),
        "R": max(
            max(2.0 * s[a] + 2.0 * s[b] + abs(mean[a] - mean[b]), 4.0 * s[a], 4.0 * s[b])
            for a, b in zip(up, down, strict=True)
        ),
        "E+": width([mean[key] for key in up]),
        "E-": width([mean[key] for key in down]),
        "E": width([mean[key] for key in up + down]),
        "M": width(middle),
        "A+": band(up),
        "A-": band(down),
        "A": band(up + down),
    }


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_iso_230_6_of_four_body_diagonals_of_a_drawn_machine(tmp_path: Path, seed: int) -> None:
    """Scales, squareness, play and scatter are drawn; Y carries the work, so that its reading counts the other way."""
    rng = np.random.default_rng([230, seed])
    strokes = rng.uniform(200.0, 700.0, 3).round(1)
    gains, square, play = (
        rng.normal(0.0, 40e-6, 3),
        rng.normal(0.0, 60e-6, 3),
        np.abs(rng.normal(0.0, 2e-3, 3)),
    )
    setups, rows = "", []
    diagonals = [(1, 1, 1), (1, 1, -1), (1, -1, 1), (-1, 1, 1)]
    for number, signs in enumerate(diagonals):
        span = np.array(signs) * strokes
        begin = np.where(span > 0.0, 0.0, strokes)
        way = span / np.linalg.norm(span)
        setups += f'\n[[setups]]\nid = "d{number}"\nreading = "displacement"\nstandard_uncertainty_um = 0.3\n'
        setups += f"direction = {way.tolist()}\n"
        places = np.linspace(0.0, 1.0, 8)
        visits = [*places, *places[::-1]] * 5
        zero: float | None = None
        for index, part in enumerate(visits):
            at = begin + part * span
            towards = np.sign(part - visits[index - 1]) if index and part != visits[index - 1] else None
            if towards is None:
                towards = np.sign(visits[index + 1] - part) if index + 1 < len(visits) else 1.0
            lag = np.where(towards * np.array(signs) < 0, play, 0.0)
            x, y, z = at * (1.0 + gains) + lag
            true = np.array([x - square[0] * y + square[1] * z, y - square[2] * z, z])
            value = 1e3 * float(true @ way) + rng.normal(0.0, 1.0)
            zero = value if zero is None else zero
            rows.append(
                {"setup": f"d{number}", "x_mm": round(at[0], 4), "y_mm": round(at[1], 4), "z_mm": round(at[2], 4),
                 "reading_um": round(value - zero, 2)}
            )  # fmt: skip
    tests, read = evaluated(tmp_path / "shop", "w Y b X Z t", setups, rows)
    for number, signs in enumerate(diagonals):
        mine = [row for row in read if row["setup"] == f"d{number}"]
        span = np.array(signs) * strokes
        begin = np.where(span > 0.0, 0.0, strokes)
        there = [
            float((np.array([row["x_mm"], row["y_mm"], row["z_mm"]]) - begin) @ span / np.linalg.norm(span))
            for row in mine
        ]
        level = [round(place / float(np.linalg.norm(span)) * 7.0) for place in there]
        expected = along_a_diagonal(level, there, [float(row["reading_um"]) for row in mine])
        test = tests[f"d{number}"]
        assert (test.test, set(test.of.split()), test.figures[0].standard) == (
            "diagonal", {"X", "Y", "Z"}, "ISO 230-6:2002, clause 3",
        )  # fmt: skip
        assert figures(test) == pytest.approx(expected, abs=1e-3), signs


# ISO 10791-6: BK2 of a table C on A, by a sphere that linear axes follow.


@pytest.mark.parametrize("frame", ["tool", "work"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_iso_10791_6_bk2_of_a_drawn_machine_with_scatter(tmp_path: Path, frame: str, seed: int) -> None:
    """C lies off and tilted, wobbles once and twice a turn, and plays; the program begins anywhere and turns back."""
    rng = np.random.default_rng([10791, seed])
    off, tilt = rng.normal(0.0, 12e-3, 3), rng.normal(0.0, 40e-6, 2)
    sphere, tool = rng.uniform(40.0, 90.0, 3), np.array([0.0, 0.0, -100.0])
    begin = float(rng.uniform(0.0, 90.0))
    angles = begin + np.array([*np.arange(0.0, 361.0, 10.0), *np.arange(350.0, -1.0, -10.0)])

    def carried(angle: float, *, ideal: bool, backwards: bool) -> np.ndarray:
        """The sphere in the frame of the bed: the table turns by minus the reading (ISO 841)."""
        turn = Rotation.from_euler("z", -angle, degrees=True)
        if ideal:
            return turn.apply(sphere)
        wave = 2e-3 * np.array([np.cos(2.0 * np.deg2rad(angle)), 0.0, np.sin(np.deg2rad(angle))])
        lag = Rotation.from_euler("z", 20e-6 if backwards else 0.0)
        return off + wave + Rotation.from_rotvec([*tilt, 0.0]).apply((lag * turn).apply(sphere))

    setups = (
        '\n[[setups]]\nid = "sphere"\nreading = "vector"\nstandard_uncertainty_um = 0.5\n'
        f'frame = "{frame}"\ntool_point_mm = {tool.tolist()}\nwork_point_mm = {sphere.tolist()}\n'
    )
    rows: Rows = []
    for number, angle in enumerate(angles):
        x, y, z = carried(float(angle), ideal=True, backwards=False) - tool
        seen = np.array([x, y, z]) + tool - carried(float(angle), ideal=False, backwards=number > 36)
        seen = seen + rng.normal(0.0, 5e-4, 3)
        if frame == "work":
            seen = Rotation.from_euler("z", float(angle), degrees=True).apply(seen)
        cells = dict(zip(("dx_um", "dy_um", "dz_um"), (1e3 * seen).round(3).tolist(), strict=True))
        # X and Z carry the tool, Y the work: its reading grows the other way.
        rows.append({"setup": "sphere", "x_mm": x, "y_mm": y, "z_mm": z, "c_deg": float(angle), **cells})
    tests, read = evaluated(tmp_path / "shop", "w C Y b X Z t", setups, rows)
    (test,) = tests.values()
    assert (test.test, test.figures[0].standard) == ("interpolation", "ISO 10791-6:2014")
    directions: dict[str, list[float]] = {
        name: [] for name in ("X", "Y", "Z", "radial", "tangential", "axial")
    }
    first = np.array([read[0][name] for name in ("dx_um", "dy_um", "dz_um")], dtype=float)
    for row in read:
        deviation = np.array([row[name] for name in ("dx_um", "dy_um", "dz_um")], dtype=float) - first
        angle = -float(row["c_deg"])
        if frame == "work":
            # Read in the table's frame, with the first reading as zero there.
            deviation = Rotation.from_euler("z", angle, degrees=True).apply(deviation)
        where = Rotation.from_euler("z", angle, degrees=True).apply(sphere)
        radial = np.array([where[0], where[1], 0.0]) / np.hypot(where[0], where[1])
        for name, along in {
            "X": np.array([1.0, 0.0, 0.0]), "Y": np.array([0.0, 1.0, 0.0]), "Z": np.array([0.0, 0.0, 1.0]),
            "radial": radial, "tangential": np.array([-radial[1], radial[0], 0.0]), "axial": np.array([0.0, 0.0, 1.0]),
        }.items():  # fmt: skip
            directions[name].append(float(deviation @ along))
    expected = {}
    for name, values in directions.items():
        up, down = values[:37], values[36:]
        expected |= {
            name: max(values) - min(values),
            f"{name}+": max(up) - min(up),
            f"{name}-": max(down) - min(down),
        }
    assert figures(test) == pytest.approx(expected, abs=2e-3)


# ISO 10791-7: a circle-diamond-square on a CMM.


def line_zone(along: np.ndarray, across: np.ndarray) -> float:
    """The width of the narrowest strip between parallel lines: a linear programme."""
    scale = np.abs(along).max()
    a, b = along / scale, across
    up = np.column_stack([a, np.ones(len(a)), -np.ones(len(a))])
    down = np.column_stack([-a, -np.ones(len(a)), -np.ones(len(a))])
    solved = linprog(
        [0.0, 0.0, 1.0], np.vstack([up, down]), np.concatenate([b, -b]), bounds=[(None, None)] * 3
    )
    return 2.0 * float(solved.fun)


def circle_zone(points: np.ndarray, middle: np.ndarray) -> float:
    """The smallest ring between concentric circles, to first order in the centre's shift: a linear programme."""
    off = points - middle
    length = np.linalg.norm(off, axis=1)
    out = off / length[:, None]
    # low <= length - out . shift <= high
    upper = np.column_stack([-out, np.zeros(len(out)), -np.ones(len(out))])
    lower = np.column_stack([out, np.ones(len(out)), np.zeros(len(out))])
    solved = linprog(
        [0.0, 0.0, -1.0, 1.0],
        np.vstack([upper, lower]),
        np.concatenate([-length, length]),
        bounds=[(None, None)] * 4,
    )
    return float(solved.fun)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_iso_10791_7_of_a_drawn_part_with_scatter(tmp_path: Path, seed: int) -> None:
    """Square, diamond, two circles about one axis and a hole, cut with drawn errors, measured with 1 um."""
    rng = np.random.default_rng([791, seed])
    gain, square = rng.normal(0.0, 80e-6, 2), float(rng.normal(0.0, 80e-6))
    tool, cutter = np.array([0.0, 0.0, -100.0]), 6.0
    on_cmm, place = (
        Rotation.from_euler("zyx", [*rng.uniform(-40.0, 40.0, 1), 0.4, -0.3], degrees=True),
        [250.0, 90.0, 30.0],
    )
    h, d = 70.0, 55.0
    corners = {"square": [(-h, -h), (h, -h), (h, h), (-h, h)], "diamond": [(0, -d), (d, 0), (0, d), (-d, 0)]}
    paths: dict[str, np.ndarray] = {}
    for kind, ends in corners.items():
        for number in range(4):
            share = np.linspace(0.05, 0.95, 11)[:, None]
            begin, end = np.array(ends[number], dtype=float), np.array(ends[(number + 1) % 4], dtype=float)
            level = 0.0 if kind == "square" else 8.0
            paths[f"{kind}-{number + 1}"] = np.hstack(
                [begin + share * (end - begin), np.full((11, 1), level)]
            )
    around = np.deg2rad(np.arange(0.0, 360.0, 12.0))
    for name, middle, radius, level in (
        ("bore", (0, 0), 14.0, 4.0),
        ("circle", (0, 0), 50.0, 15.0),
        ("hole", (55, 48), 9.0, 0.0),
    ):
        ring = np.column_stack([middle[0] + radius * np.cos(around), middle[1] + radius * np.sin(around)])
        paths[name] = np.hstack([ring, np.full((len(ring), 1), level)])
    rows: Rows = []
    for name, points in paths.items():
        outward = points[:, :2] - points[:, :2].mean(axis=0)
        if name[:6] in ("square", "diamon"):
            side = points[-1, :2] - points[0, :2]
            normal = np.array([side[1], -side[0]]) / np.linalg.norm(side)
            outward = np.tile(normal, (len(points), 1))
        outward /= np.linalg.norm(outward, axis=1)[:, None]
        wave = 2e-3 * np.cos(3.0 * np.linspace(0.0, 2.0 * np.pi, len(points)))
        for point, out, more in zip(points, outward, wave, strict=True):
            x, y, z = point - tool
            cut = np.array([(1 + gain[0]) * point[0] - square * point[1], (1 + gain[1]) * point[1], point[2]])
            wall = cut - (cutter - more) * np.array([*out, 0.0])
            seen = on_cmm.apply(wall) + place + rng.normal(0.0, 1e-3, 3)
            cells = dict(zip(("point_x_mm", "point_y_mm", "point_z_mm"), seen.round(6).tolist(), strict=True))
            rows.append({"setup": "cmm", "x_mm": x, "y_mm": y, "z_mm": z, "target": name, **cells})
    setups = (
        '\n[[setups]]\nid = "cmm"\nreading = "point"\nstandard_uncertainty_um = 1.0\nknown = ["targets"]\n'
        f"tool_point_mm = {tool.tolist()}\n"
    )
    tests, read = evaluated(tmp_path / "shop", "w Y b X Z t", setups, rows)
    (test,) = tests.values()
    got = {(figure.symbol, figure.name): figure.value for figure in test.figures}

    # The part is brought where it was programmed, by least squares over heights and then in the plane.
    nominal = np.array([[row["x_mm"], row["y_mm"], row["z_mm"]] for row in read], dtype=float) + tool
    measured = np.array([[row[f"point_{axis}_mm"] for axis in "xyz"] for row in read], dtype=float)

    def laid(unknown: np.ndarray) -> np.ndarray:
        return Rotation.from_rotvec(unknown[:3]).apply(measured - measured.mean(axis=0)) + unknown[3:]

    about, _ = Rotation.align_vectors(nominal - nominal.mean(axis=0), measured - measured.mean(axis=0))
    start = np.concatenate([about.as_rotvec(), nominal.mean(axis=0)])
    lying = least_squares(
        lambda unknown: (laid(unknown) - nominal).ravel(), start, x_scale=[1e-3] * 3 + [1.0] * 3
    ).x
    # Level by the heights alone: what the walls do in the plane does not tilt the part.
    level = laid(lying)
    columns = np.column_stack([nominal[:, :2], np.ones(len(nominal))])
    slope = np.linalg.lstsq(columns, level[:, 2] - nominal[:, 2], rcond=None)[0]
    level = Rotation.from_rotvec([-slope[1], slope[0], 0.0]).apply(level)
    of = {name: level[[row["target"] == name for row in read]][:, :2] for name in paths}

    lines = [name for name in paths if name[:6] in ("square", "diamon")]
    direction = {}
    for name in lines:
        points = of[name] - of[name].mean(axis=0)
        programmed = (paths[name][-1] - paths[name][0])[:2]
        axis = np.linalg.svd(points)[2][0]
        direction[name] = axis * np.sign(axis @ programmed)
    datum = direction[lines[0]]
    for name in lines:
        points = of[name] - of[name].mean(axis=0)
        along, normal = points @ direction[name], np.array([-direction[name][1], direction[name][0]])
        assert got[name, "straightness"] == pytest.approx(1e3 * np.ptp(points @ normal), abs=0.02)
        assert got[name, "straightness, minimum zone"] == pytest.approx(
            1e3 * line_zone(along, points @ normal), abs=0.02
        )
        if name == lines[0]:
            continue
        programmed = (paths[name][-1] - paths[name][0])[:2]
        angle = np.arctan2(programmed[1], programmed[0])
        # ISO 1101: a strip that lies to the datum as drawn; its normal is the datum's turned by the drawn angle.
        turned = Rotation.from_euler("z", angle).as_matrix()[:2, :2] @ datum
        word = {0: "parallelism", 90: "perpendicularity"}.get(
            round(abs(np.rad2deg(angle))) % 180, "angularity"
        )
        zone = np.ptp(points @ np.array([-turned[1], turned[0]]))
        assert got[name, f"{word} to {lines[0]}"] == pytest.approx(1e3 * zone, abs=0.02), name
    centres = {}
    for name in ("bore", "circle", "hole"):
        points = of[name]
        fit = least_squares(
            lambda c, p=points: np.linalg.norm(p - c[:2], axis=1) - c[2],
            [*points.mean(axis=0), 10.0],
            xtol=1e-15,
            ftol=1e-15,
        )
        centres[name] = fit.x[:2]
        assert got[name, "circularity"] == pytest.approx(1e3 * np.ptp(fit.fun), abs=0.02)
        assert got[name, "circularity, minimum zone"] == pytest.approx(
            1e3 * circle_zone(points, fit.x[:2]), abs=0.02
        )
    apart = 2e3 * np.linalg.norm(centres["circle"] - centres["bore"])
    assert got["circle", "concentricity to bore, diameter of the zone"] == pytest.approx(apart, abs=0.02)
    # The hole beside the bore in the frame of the datum side.
    back = np.arctan2(datum[1], datum[0])
    turned = Rotation.from_euler("z", -back).as_matrix()[:2, :2] @ (centres["hole"] - centres["bore"])
    place_off = 2e3 * np.linalg.norm(turned - [55.0, 48.0])
    symbol = f"position beside the first circle along {lines[0]}, diameter of the zone"
    assert got["hole", symbol] == pytest.approx(place_off, abs=0.05)
