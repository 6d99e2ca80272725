"""An angle sensor that scans an L-shaped standard piece: exact rays, Li et al., Appl. Sci. 9 (2019) 2701, Eq. (1).

Nothing here knows of the package. The machine is the paper's: X carries Y carries Z carries the sensor. Error motions
are given as polynomials of the axis readings (mm and rad, mm), the squareness as the paper's three angles.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

F_MM, K2_MM = 100.0, 57.0
PLANES = {"XY": (0, 1), "XZ": (0, 2), "YZ": (1, 2)}


@dataclass
class Machine:
    """``motion`` maps 'X', 'Y', 'Z' to six polynomials (dx, dy, dz, rotations about x, y, z), lowest power first."""

    motion: dict[str, list[np.ndarray]] = field(default_factory=dict)
    xy: float = 0.0
    xz: float = 0.0
    yz: float = 0.0

    def _error(self, axis: str, q: float) -> np.ndarray:
        six = [np.polynomial.polynomial.polyval(q, c) for c in self.motion.get(axis, [np.zeros(1)] * 6)]
        return _frame(_rotation(*six[3:]), six[:3])

    def pose(self, reading: np.ndarray) -> np.ndarray:
        """The frame of the sensor carrier (4, 4), Eq. (1) without the nominal motion's order changed."""
        found = np.eye(4)
        square = {"X": np.eye(3), "Y": _rotation(0, 0, self.xy), "Z": _rotation(self.yz, self.xz, 0)}
        for number, axis in enumerate("XYZ"):
            shift = np.zeros(3)
            shift[number] = reading[number]
            found = (
                found
                @ _frame(square[axis], np.zeros(3))
                @ _frame(np.eye(3), shift)
                @ self._error(axis, reading[number])
            )
        return found


def _rotation(a: float, b: float, c: float) -> np.ndarray:
    ca, sa, cb, sb, cc, sc = np.cos(a), np.sin(a), np.cos(b), np.sin(b), np.cos(c), np.sin(c)
    rx = np.array([[1, 0, 0], [0, ca, -sa], [0, sa, ca]])
    ry = np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]])
    rz = np.array([[cc, -sc, 0], [sc, cc, 0], [0, 0, 1]])
    return rz @ ry @ rx


def _frame(rotation: np.ndarray, shift: np.ndarray) -> np.ndarray:
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = rotation, shift
    return found


@dataclass
class Piece:
    """Modules by name: (a, b) mm along the arms; ``off`` the true deviation of each (place u, v mm, tilt u, v rad)."""

    modules: dict[str, tuple[float, float]]
    off: dict[str, tuple[float, float, float, float]] = field(default_factory=dict)


def straight_arms(pitch: float = 50.0, count: int = 4) -> Piece:
    """The paper's piece: a module at the corner and ``count`` on each arm."""
    modules = {"M0": (0.0, 0.0)}
    modules |= {f"A{k}": (k * pitch, 0.0) for k in range(1, count + 1)}
    modules |= {f"B{k}": (0.0, k * pitch) for k in range(1, count + 1)}
    return Piece(modules)


@dataclass
class Setup:
    """How the piece lies in truth: corner readings, shift (u, v) mm, turn rad, tilt (u, v) rad of sensor to piece."""

    plane: str
    corner: tuple[float, float, float]
    shift: tuple[float, float] = (0.0, 0.0)
    turn: float = 0.0
    tilt: tuple[float, float] = (0.0, 0.0)


def scan(machine: Machine, piece: Piece, setups: list[Setup], tip=(0.0, 0.0, 0.0)) -> dict[str, np.ndarray]:
    """Columns of probings.csv without noise: module, placement (from 1), readings, four spots in µm."""
    rows: dict[str, list] = {key: [] for key in ("target", "placement", "x", "y", "z", "spots")}
    for number, setup in enumerate(setups, 1):
        first, second = PLANES[setup.plane]
        u, v = np.eye(3)[first], np.eye(3)[second]
        w = np.cross(u, v)
        for name, (a, b) in piece.modules.items():
            reading = np.array(setup.corner) + a * u + b * v
            pose = machine.pose(reading)
            point = (pose @ np.array([*tip, 1.0]))[:3]
            off = piece.off.get(name, (0.0,) * 4)
            cos, sin = np.cos(setup.turn), np.sin(setup.turn)
            x, y = a + off[0], b + off[1]
            centre = np.array(setup.corner) + np.array(tip)
            centre = (
                centre + (cos * x - sin * y + setup.shift[0]) * u + (sin * x + cos * y + setup.shift[1]) * v
            )
            beam = pose[:3, :3] @ w
            # The face's normal, tilted by the module and by how the piece was laid down.
            normal = w + (off[2] + setup.tilt[0]) * u + (off[3] + setup.tilt[1]) * v
            spots = [*_spots(beam, normal, u, v)]
            # Where the beam (against w) meets the paraboloid z = r^2 / 2 k^2 of the module's own frame.
            across = point - centre
            hit = np.array([across @ u, across @ v])
            curved = normal - hit[0] / K2_MM * u - hit[1] / K2_MM * v
            # A concave face sends the spot the other way than a convex one: the paper's turns with Eq. (13) upwards.
            spots += [*_spots(beam, curved, u, v)]
            for key, value in zip(("target", "placement", "spots"), (name, number, spots), strict=True):
                rows[key].append(value)
            for key, value in zip("xyz", reading, strict=True):
                rows[key].append(value)
    found = {key: np.array(value) for key, value in rows.items()}
    found["spots"] = found["spots"] * 1e3
    return found


def _spots(beam: np.ndarray, normal: np.ndarray, u: np.ndarray, v: np.ndarray) -> tuple[float, float]:
    """Eq. (9): f tan 2a, a the angle of the face's normal against the beam, along u and v."""
    beam, normal = beam / np.linalg.norm(beam), normal / np.linalg.norm(normal)
    angles = [np.arcsin((normal - beam) @ axis) for axis in (u, v)]
    return tuple(F_MM * np.tan(2.0 * angle) for angle in angles)


def paper_machine() -> Machine:
    """Tables 2 and 3 of the paper and its squareness from the printed slopes (70.85 seconds of arc)."""
    arcsec = np.pi / 180.0 / 3600.0
    none = np.zeros(4)
    eps_y_x = np.array([0.0, -1.01e-2, 2.59e-5, -6.50e-8]) * arcsec
    eps_x_y = np.array([0.0, -3.29e-3, 1.44e-4, -4.53e-7]) * arcsec
    d_x_x = np.array([0.0, -1.18e-2, -3.99e-4, 1.95e-6]) * 1e-3
    d_y_x = np.array([0.0, 1.42e-1, -1.19e-3, 2.48e-6]) * 1e-3
    d_y_y = np.array([0.0, 8.60e-3, -1.42e-3, 8.42e-6]) * 1e-3
    d_x_y = np.array([0.0, 9.47e-2, -2.01e-3, 9.46e-6]) * 1e-3
    return Machine(
        motion={
            "X": [d_x_x, d_y_x, none, none, eps_y_x, none],
            "Y": [d_x_y, d_y_y, none, eps_x_y, none, none],
            "Z": [none] * 6,
        },
        xy=343.506e-6,
    )


def random_machine(rng: np.random.Generator) -> Machine:
    """All 21 errors: some 4 µm and 10 µrad over 200 mm, squareness of some 50 µrad; no first order of straightness."""
    motion = {}
    for number, axis in enumerate("XYZ"):
        shifts = [np.array([0.0, *(rng.normal(size=3) * [2e-5, 1e-7, 5e-10])]) for _ in range(3)]
        turns = [np.array([0.0, *(rng.normal(size=3) * [5e-8, 2e-10, 1e-12])]) for _ in range(3)]
        for other in range(3):
            if other != number:
                shifts[other][1] = 0.0
        motion[axis] = [*shifts, *turns]
    xy, xz, yz = rng.normal(size=3) * 5e-5
    return Machine(motion, float(xy), float(xz), float(yz))


def random_setups(rng: np.random.Generator, planes=("XY", "XZ", "YZ")) -> list[Setup]:
    """Placements laid down by hand: 20 µm, 200 µrad in the plane, 300 µrad of tilt."""
    corners = {"XY": (10.0, 20.0, -30.0), "XZ": (0.0, 5.0, 10.0), "YZ": (5.0, 10.0, 0.0)}
    return [
        Setup(
            plane,
            corners[plane],
            tuple(rng.normal(size=2) * 0.02),
            float(rng.normal() * 2e-4),
            tuple(rng.normal(size=2) * 3e-4),
        )
        for plane in planes
    ]


def rows_of(
    machine: Machine,
    piece: Piece,
    setups: list[Setup],
    rng: np.random.Generator,
    *,
    noise_um: float = 0.2,
    passes: int = 2,
    tip=(0.0, 0.0, -50.0),
) -> dict[str, np.ndarray]:
    """Scans there and back, with white noise on every spot."""
    once = scan(machine, piece, setups, tip)
    found = {key: np.concatenate([once[key]] * passes) for key in once}
    found["spots"] = found["spots"] + rng.normal(size=found["spots"].shape) * noise_um
    return found


def calibrated(piece: Piece, rng: np.random.Generator, place_um: float, tilt_urad: float) -> Piece:
    """A piece whose modules (the corner aside) deviate from their calibration by its uncertainty."""
    u = np.array([place_um * 1e-3] * 2 + [tilt_urad * 1e-6] * 2)
    off = {name: tuple(rng.normal(size=4) * u) for name in piece.modules if name != "M0"}
    return Piece(piece.modules, off)


def write_folder(
    folder,
    name: str,
    runs: list[dict[str, np.ndarray]],
    piece: Piece,
    setups: list[Setup],
    *,
    noise_um: float = 0.2,
    place_um: float = 0.1,
    tilt_urad: float = 0.2,
    machine_id: str = "CMM-7",
    tip=(0.0, 0.0, -50.0),
    days: list[int] | None = None,
):
    """A campaign folder, format 1, of the method l-shape."""
    folder.mkdir(parents=True, exist_ok=True)
    text = [
        "format = 1",
        f'campaign = "{name}"',
        'method = "l-shape"',
        "",
        "[machine]",
        f'id = "{machine_id}"',
    ]
    text += [
        'topology = "w b X Y Z t"',
        "",
        "[probe]",
        'id = "angle-sensor-1"',
        'model = "micro-angle sensor"',
    ]
    text += [f"standard_uncertainty_um = {noise_um}", f"tip_mm = {list(map(float, tip))}", "", "[artefact]"]
    text += [
        'id = "L-200"',
        "",
        "[artefact.l_shape]",
        f"focal_length_mm = {F_MM}",
        f"paraboloid_mm = {K2_MM}",
    ]
    text += [f"place_standard_uncertainty_um = {place_um}", f"tilt_standard_uncertainty_urad = {tilt_urad}"]
    for module, centre in piece.modules.items():
        text += ["", "[[artefact.l_shape.modules]]", f'id = "{module}"', f"centre_mm = {list(centre)}"]
    for setup in setups:
        text += ["", "[[artefact.l_shape.placements]]", f'plane = "{setup.plane}"']
        text += [f"corner_mm = {list(setup.corner)}"]
    (folder / "campaign.toml").write_text("\n".join(text) + "\n", encoding="utf-8")
    days = days or [k // 2 + 1 for k in range(len(runs))]
    lines = ["run,started_at,day,warm_up,ambient_degC"]
    for number, day in enumerate(days, 1):
        hour = 8 + 4 * (number % 2 == 0)
        lines.append(f"{number},2026-03-{day:02d}T{hour:02d}:00:00+01:00,{day},false,20.0")
    (folder / "runs.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    head = "run,sequence,time_s,target,x_mm,y_mm,z_mm,placement,plane_u_um,plane_v_um,paraboloid_u_um,paraboloid_v_um"
    lines = [head]
    for number, rows in enumerate(runs, 1):
        for k in range(len(rows["target"])):
            place = ",".join(f"{rows[axis][k]:.4f}" for axis in "xyz")
            spots = ",".join(f"{value:.3f}" for value in rows["spots"][k])
            lines.append(
                f"{number},{k + 1},{20.0 * k:.1f},{rows['target'][k]},{place},{rows['placement'][k]},{spots}"
            )
    (folder / "probings.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder
