"""Free-form self-calibration: layouts of points, an exact touch along the normal, and the literal Eqs. (7) to (15).

Own code for the tests; nothing of the product. The touch is solved on 4x4 matrices (``chain.py``): the stylus tip
moves along the normal of the nominal point until it meets the surface that the machine with all its errors carries.
``design_matrix`` is the paper's A_normal as printed, with E_CC right-handed (erratum E22) and the errors of an X axis
that the Y axis carries.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta, timezone
from pathlib import Path

import numpy as np

from .chain import branch_matrix, carried, read_topology

JAPAN = timezone(timedelta(hours=9))
PROBING_U_UM = 1.38  # section 6
CASE_1_ANGLES = (0.0, 75.0, 130.0, 210.0)  # Eq. (19)
CASE_2_ANGLES = (0.0, 31.0, 83.0, 137.0, 191.0, 227.0, 257.0, 313.0)  # Eq. (20)
GRID_1 = tuple(np.arange(-110.0, 111.0, 22.0))  # 11 nodes (erratum E20)
GRID_2 = tuple(np.arange(-400.0, 401.0, 80.0))


@dataclass(frozen=True)
class Layout:
    """Points (n, 2) mm where the centre of the stylus sphere meets the surface, unit normals (n, 2), names."""

    name: str
    points: np.ndarray
    normals: np.ndarray
    names: tuple[str, ...]
    grid: tuple[float, ...]

    def keep(self, prefix: str) -> Layout:
        """The points whose name begins with a prefix."""
        chosen = np.array([name.startswith(prefix) for name in self.names])
        return Layout(
            self.name,
            self.points[chosen],
            self.normals[chosen],
            tuple(n for n, k in zip(self.names, chosen, strict=True) if k),
            self.grid,
        )


def _round(
    centre: tuple[float, float], radius: float, count: int, first: float
) -> tuple[np.ndarray, np.ndarray]:
    angle = first + 2 * np.pi * np.arange(count) / count
    out = np.column_stack([np.cos(angle), np.sin(angle)])
    return np.array(centre) + radius * out, out


def cross_pocket(
    arm: float = 100.0, spheres: Sequence[tuple[float, float]] = ((66.0, 66.0), (-66.0, -66.0))
) -> Layout:
    """Case study 1: a cross-shaped pocket 36 mm wide, 76 points, two spheres of 25.4 mm with 8 points each.

    Figure 8 does not print the points: the arms' length and the spheres' places are ours.
    """
    stylus, half = 3.0, 18.0
    points, normals = [], []
    for quarter in range(4):
        turn = np.pi / 2 * quarter
        rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        for x in np.linspace(half + 4.0, arm - 4.0, 8):
            for side in (1.0, -1.0):
                points.append(rotation @ [x, side * (half - stylus)])
                normals.append(rotation @ [0.0, -side])
        for y in (-10.0, 0.0, 10.0):
            points.append(rotation @ [arm - stylus, y])
            normals.append(rotation @ [-1.0, 0.0])
    names = [f"W{k}" for k in range(1, len(points) + 1)]
    for number, centre in enumerate(spheres, 1):
        place, out = _round(centre, 12.7 + stylus, 8, 0.2)
        points += list(place)
        normals += list(out)
        names += [f"S{number}-{k}" for k in range(1, 9)]
    return Layout("cross-shaped pocket", np.array(points), np.array(normals), tuple(names), GRID_1)


def pin_ring(spheres: Sequence[tuple[float, float]] = ((330.0, 60.0), (-80.0, 330.0))) -> Layout:
    """Case study 2: 18 pins of 12 mm on a circle of 400 mm, 4 points each, two spheres of 30 mm with 8: 88 (E21).

    Figure 15 does not print where the spheres stand: their places are ours.
    """
    stylus = 3.0
    points: list[np.ndarray] = []
    normals: list[np.ndarray] = []
    names: list[str] = []
    for pin in range(18):
        angle = np.radians(20.0 * pin)
        place, out = _round((200.0 * np.cos(angle), 200.0 * np.sin(angle)), 6.0 + stylus, 4, angle)
        points += list(place)
        normals += list(out)
        names += [f"P{pin + 1}-{k}" for k in range(1, 5)]
    for number, centre in enumerate(spheres, 1):
        place, out = _round(centre, 15.0 + stylus, 8, 0.2)
        points += list(place)
        normals += list(out)
        names += [f"S{number}-{k}" for k in range(1, 9)]
    return Layout("ring of 18 pins", np.array(points), np.array(normals), tuple(names), GRID_2)


def scattered(count: int, radius: float, rng: np.random.Generator) -> Layout:
    """Points spread over a disc, with normals of any direction."""
    angle, out = rng.uniform(0, 2 * np.pi, (2, count))
    distance = radius * np.sqrt(rng.uniform(0, 1, count))
    points = distance[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    normals = np.column_stack([np.cos(out), np.sin(out)])
    return Layout("scattered", points, normals, tuple(f"W{k}" for k in range(1, count + 1)), GRID_1)


@dataclass(frozen=True)
class Truth:
    """Errors on the grid of a layout, mm and rad: tables (nodes,), squareness, table errors by angle (3, angles).

    ``squareness`` turns the X axis against the Y axis that carries it: minus the paper's E_C(0X)Y. ``table`` holds
    EX0C, EY0C and ECC. All eleven boundary conditions hold but for ``length``, the error EXX at the last node.
    """

    tables: Mapping[str, np.ndarray]
    squareness: float
    table: np.ndarray
    shape: np.ndarray
    length: float = 0.0
    location: Mapping[str, float] = field(default_factory=dict)


def draw_truth(
    layout: Layout, angles: Sequence[float], rng: np.random.Generator, scale: float = 1.0
) -> Truth:
    """An ordinary machine and workpiece: some micrometres everywhere, smooth from node to node."""
    nodes = np.array(layout.grid)
    size = len(nodes)
    zero = int(np.argmin(np.abs(nodes)))

    def smooth(size_mm: float) -> np.ndarray:
        walk = np.cumsum(rng.normal(0.0, 1.0, size))
        wave = np.convolve(np.pad(walk, 1, mode="edge"), [0.25, 0.5, 0.25], mode="valid")
        return scale * size_mm * (wave - wave[zero]) / np.sqrt(size)

    tables = {name: smooth(4e-3) for name in ("EXX", "EYX", "EXY", "EYY")}
    tables["ECY"] = smooth(4e-3) / 110.0
    for name in ("EYX", "EXY"):  # end-point lines: zero at 0 and at the last node
        tables[name] = tables[name] - tables[name][-1] * nodes / nodes[-1]
    table = scale * np.array([[5e-3], [5e-3], [40e-6]]) * rng.normal(0.0, 1.0, (3, len(angles)))
    table[:, 0] = 0.0
    shape = scale * 6e-3 * rng.normal(0.0, 1.0, len(layout.points))
    return Truth(tables, scale * 43.4e-6, table, shape, float(tables["EXX"][-1]))


def probe(
    layout: Layout,
    angles: Sequence[float],
    truth: Truth,
    rng: np.random.Generator,
    noise_um: float = PROBING_U_UM,
    topology: str = "w C A b Y X Z (C1) t",
) -> dict[str, np.ndarray]:
    """Readings of one run: every point at every angle. Returns target, x, y (mm), c (deg), index of the point."""
    chain = read_topology(topology)
    count, rows = len(layout.points), len(layout.points) * len(angles)
    place = np.tile(np.arange(count), len(angles))
    which = np.repeat(np.arange(len(angles)), count)
    c = np.radians(np.array(angles))[which]
    points, normals = layout.points[place], layout.normals[place]
    sign = chain.axis("C").sign
    cosine, sine = np.cos(sign * c), np.sin(sign * c)
    turn = np.stack([np.stack([cosine, -sine], -1), np.stack([sine, cosine], -1)], -2)
    start = (turn @ points[:, :, None])[:, :, 0]
    along = (turn @ normals[:, :, None])[:, :, 0]
    surface = np.column_stack([points + truth.shape[place][:, None] * normals, np.zeros(rows)])
    out = np.column_stack([normals, np.zeros(rows)])
    nodes = np.array(layout.grid)

    def gap(travel: np.ndarray) -> np.ndarray:
        x, y = (start + travel[:, None] * along).T
        readings = {a.name: np.zeros(rows) for a in chain.axes}
        readings |= {"X": x, "Y": y, "C": c}
        motion = {name: np.zeros((rows, 6)) for name in ("X", "Y", "C")}
        location = {name: np.zeros((rows, 6)) for name in ("X", "C")}
        for name, values in truth.tables.items():
            at = x if name[2] == "X" else y
            motion[name[2]][:, "XYZABC".index(name[1])] = np.interp(at, nodes, values)
        location["X"][:, 5] = truth.squareness
        location["C"][:, :2] = truth.table[:2, which].T
        motion["C"][:, 5] = truth.table[2, which]
        work = branch_matrix(chain.work, readings, location, motion, rows)
        tool = branch_matrix(chain.tool, readings, location, motion, rows)
        tip = carried(np.linalg.inv(work) @ tool, np.zeros((rows, 3)))
        return ((tip - surface) * out).sum(1)

    travel = np.zeros(rows)
    for _ in range(30):
        left = gap(travel)
        if np.abs(left).max() < 1e-11:
            break
        travel = travel - left  # the gap falls by the travel, to a part in 1e-4
    travel = travel + noise_um * 1e-3 * rng.standard_normal(rows)
    x, y = (start + travel[:, None] * along).T
    return {"point": place, "x": x, "y": y, "c": np.degrees(c), "which": which, "off": travel}


def design_matrix(layout: Layout, angles: Sequence[float]) -> tuple[np.ndarray, list[str]]:
    """A_normal of Eq. (15), every row one probing, angle by angle, and the names of its unknowns."""
    nodes = np.array(layout.grid)
    step = nodes[1] - nodes[0]
    names = [f"{t}({v:g})" for t in ("EXX", "EYX", "EXY", "EYY", "ECY") for v in nodes] + ["EC0XY"]
    names += [f"G({n})" for n in layout.names]
    names += [f"{t}({a:g})" for a in angles for t in ("EXC", "EYC", "ECC")]
    column = {name: k for k, name in enumerate(names)}
    rows = []
    for angle in angles:
        c = np.radians(angle)
        turn = np.array([[np.cos(-c), -np.sin(-c)], [np.sin(-c), np.cos(-c)]])  # Eq. (2)
        for name, point, normal in zip(layout.names, layout.points, layout.normals, strict=True):
            (x, y), (nx, ny) = turn @ point, turn @ normal
            row = np.zeros(len(names))
            for node in nodes:
                at_x, at_y = max(0.0, 1 - abs(x - node) / step), max(0.0, 1 - abs(y - node) / step)
                row[column[f"EXX({node:g})"]] = -nx * at_x
                row[column[f"EYX({node:g})"]] = -ny * at_x
                row[column[f"EXY({node:g})"]] = -nx * at_y
                row[column[f"EYY({node:g})"]] = -ny * at_y
                row[column[f"ECY({node:g})"]] = -ny * x * at_y
            row[column["EC0XY"]] = nx * y
            row[column[f"G({name})"]] = 1.0
            row[column[f"EXC({angle:g})"]] = nx
            row[column[f"EYC({angle:g})"]] = ny
            row[column[f"ECC({angle:g})"]] = -nx * y + ny * x  # R(90) p . n
            rows.append(row)
    return np.array(rows), names


def write_folder(
    folder: Path,
    name: str,
    layout: Layout,
    runs: Sequence[dict[str, np.ndarray]],
    length_um: float = 0.0,
    conditions: Sequence[str] = (),
    topology: str = "w C A b Y X Z (C1) t",
    noise_um: float = PROBING_U_UM,
    machine: str = "V1",
    runs_a_day: int = 2,
) -> Path:
    """A campaign folder of format 1, two runs a day, three hours apart."""
    folder.mkdir(parents=True, exist_ok=True)
    nodes = "[" + ", ".join(f"{node:g}.0" for node in layout.grid) + "]"
    chosen = (
        ""
        if not conditions
        else f"conditions = [{', '.join(repr(c) for c in conditions)}]\n".replace("'", '"')
    )
    (folder / "campaign.toml").write_text(
        f'format = 1\ncampaign = "{name}"\nmethod = "free-form"\n\n'
        f'[machine]\nid = "{machine}"\ntopology = "{topology}"\n\n'
        f'[probe]\nid = "probe-1"\nmodel = "touch-trigger probe"\nstandard_uncertainty_um = {noise_um or 1.0}\n\n'
        f'[artefact]\nid = "{layout.name}"\n\n[artefact.self_calibration]\n{chosen}\n'
        f"[artefact.self_calibration.nodes_mm]\nX = {nodes}\nY = {nodes}\n\n"
        f'[artefact.self_calibration.length]\nparameter = "EXX({layout.grid[-1]:g})"\nerror_um = {length_um!r}\n'
        'standard_uncertainty_um = 0.5\ncertificate = "simulated step gauge"\n',
        encoding="utf-8",
    )
    with (folder / "runs.csv").open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["run", "started_at", "day", "warm_up", "ambient_degC"])
        for k in range(len(runs)):
            day, place = divmod(k, runs_a_day)
            at = datetime(2026, 4, 6, 8, tzinfo=JAPAN) + timedelta(days=day, hours=3 * place)
            out.writerow([k + 1, at.isoformat(), day + 1, "false", f"{21.0 + 0.1 * place:.1f}"])
    axes = [a for a in read_topology(topology).axes if a.name not in ("X", "Y", "C")]
    with (folder / "probings.csv").open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["run", "sequence", "time_s", "target", "x_mm", "y_mm", "c_deg", *(a.column for a in axes),
                      "nominal_x_mm", "nominal_y_mm", "normal_x", "normal_y"])  # fmt: skip
        for number, run in enumerate(runs, 1):
            for k, point in enumerate(run["point"]):
                out.writerow(
                    [number, k + 1, f"{9.0 * k:.1f}", layout.names[point], f"{run['x'][k]:.6f}",
                     f"{run['y'][k]:.6f}", f"{run['c'][k]:.9g}", *("0" for _ in axes),
                     *(f"{v:.6f}" for v in layout.points[point]), *(f"{v:.9f}" for v in layout.normals[point])]
                )  # fmt: skip
    return folder


def by_name(layout: Layout, angles: Sequence[float], truth: Truth) -> dict[str, float]:
    """The truth by the names of a campaign's parameters."""
    found = {
        f"{symbol}({node:g})": float(value)
        for symbol, values in truth.tables.items()
        for node, value in zip(layout.grid, values, strict=True)
    }
    found["EC0X"] = truth.squareness
    for row, symbol in enumerate(("EX0C", "EY0C", "ECC")):
        found |= {f"{symbol}({a:g})": float(v) for a, v in zip(angles, truth.table[row], strict=True)}
    return found | {f"shape({n})": float(v) for n, v in zip(layout.names, truth.shape, strict=True)}


def write_examples(folder: Path) -> None:
    """The two campaigns of the project's examples: both case studies of the paper, on machines of our own."""
    for name, layout, angles, topology, machine, runs, seed in (
        ("free-form-pocket", cross_pocket(), CASE_1_ANGLES, "w C B b Y X Z (C1) t", "V300-T", 4, 1),
        ("free-form-pins", pin_ring(), CASE_2_ANGLES, "w C A b Y X Z (C1) t", "V800-T", 2, 2),
    ):
        rng = np.random.default_rng(seed)
        truth = draw_truth(layout, angles, rng)
        told = [probe(layout, angles, truth, rng, topology=topology) for _ in range(runs)]
        # The direct measurement of the length has its own error of half a micrometre.
        length_um = round(truth.length * 1e3 + rng.normal(0.0, 0.5), 2)
        write_folder(folder / name, name, layout, told, length_um, (), topology, machine=machine)
