"""The method ``instruments``: measured mounts against an independent least squares, and simulated machines.

What is independent is written here with numpy and scipy alone, or in ``tests/simulator/instruments.py``: neither uses
the package.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from monitor.discovery import explain
from monitor.exceptions import CampaignError, DataError, EffectError
from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.methods.instruments.readings import readings
from monitor.methods.model import Model
from monitor.readers import read_campaign, write_campaign
from monitor.readers.setups.file import FORMATS
from monitor.records import Campaign
from monitor.store import Database, import_campaign
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import trend
from monitor.workflow.uncertainty.evaluation import uncertainty
from monitor.workflow.uncertainty.request import UncertaintyRequest
from tests.simulator.instruments import SimulatedAxis, SimulatedChain, X, Y, Z, small

EXAMPLES = Path(__file__).parents[2] / "examples"
ARCSECOND = np.pi / 648000.0
MMT = ("mount-mmt-2021-08", "mount-mmt-2023-07", "mount-mmt-2023-09", "mount-mmt-2025-03")
GEM = "mount-gem-28"
FLEXURE, REFRACTION = "flexure:tool@gravity", "sight:up:formula(1/tan(elevation))"


def logged(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Readings (n, 2) in rad and unit vectors (n, 3) of an example, read without the package."""
    with (EXAMPLES / name / "probings.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    first, second = ("az_deg", "el_deg") if "az_deg" in rows[0] else ("ha_deg", "dec_deg")
    angles = np.deg2rad([[float(row[first]), float(row[second])] for row in rows])
    stars = np.array([[float(row[f"direction_{axis}"]) for axis in "xyz"] for row in rows])
    return angles, stars / np.linalg.norm(stars, axis=1, keepdims=True)


def independent(name: str, terms: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Least squares with unit weights of an example: values, u from the residuals, and the RMS length in arcseconds.

    Terms: three turns of the first axis, two of the second, collimation, then sag of the tube and a lift by
    1/tan(elevation). Both mounts turn about Z and Y with negative signs and point along X.
    """
    angles, stars = logged(name)
    latitude = np.deg2rad(39.00694)
    down = (
        np.array([-np.cos(latitude), 0.0, -np.sin(latitude)]) if name == GEM else np.array([0.0, 0.0, -1.0])
    )
    plain = Rotation.from_euler("ZY", -angles)
    gravity = plain.inv().apply(down)
    sag = np.cross([1.0, 0.0, 0.0], gravity)
    sine = -gravity[:, 0]
    level = np.cross([1.0, 0.0, 0.0], -gravity)
    level /= np.linalg.norm(level, axis=1, keepdims=True)
    lift = level * (np.sqrt(1.0 - sine**2) / sine)[:, None]
    side = np.cross(stars, -down)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    up = np.cross(side, stars)

    def misses(values: np.ndarray) -> np.ndarray:
        first = Rotation.from_euler("xyz", values[:3]) * Rotation.from_rotvec(-angles[:, :1] * np.array([Z]))
        second = Rotation.from_euler("xyz", [values[3], values[4], 0.0])
        second = first * second * Rotation.from_rotvec(-angles[:, 1:] * np.array([Y]))
        turn = np.tile([0.0, 0.0, values[5]], (len(angles), 1))
        for value, column in zip(values[6:], (sag, lift), strict=False):
            turn = turn + value * column
        pointed = (second * Rotation.from_euler("xyz", turn)).apply([1.0, 0.0, 0.0])
        return np.concatenate([np.einsum("ni,ni->n", way, pointed - stars) for way in (side, up)])

    values = np.zeros(terms)
    for _ in range(8):
        at = misses(values)
        step = 1e-6
        slopes = np.column_stack(
            [
                (misses(values + step * unit) - misses(values - step * unit)) / (2 * step)
                for unit in np.eye(terms)
            ]
        )
        values = values - np.linalg.lstsq(slopes, at, rcond=None)[0]
    at = misses(values)
    variance = float(at @ at) / (len(at) - terms)
    u = np.sqrt(variance * np.diag(np.linalg.inv(slopes.T @ slopes)))
    return values, u, float(np.sqrt(2.0 * np.mean(at**2))) / ARCSECOND


@cache
def example(name: str) -> Campaign:
    """An example campaign."""
    return read_campaign(EXAMPLES / name)


def fitted(name: str, *added: str) -> tuple[dict[str, float], float]:
    """The parameters of an example by name in rad, and the RMS length in arcseconds."""
    campaign = example(name)
    result = campaign_method(campaign).identify(campaign, Model("instruments", added=added))
    run = result.runs[0]
    values = dict(zip(result.parameters, run.estimate.tolist(), strict=True))
    values |= dict(zip(result.added, result.added_estimate.tolist(), strict=True))
    return values, np.sqrt(2.0) * run.rms * 1e-3 / ARCSECOND


@pytest.mark.parametrize(
    ("name", "added", "published"),
    [
        ("mount-mmt-2021-08", (), 3.83),
        ("mount-mmt-2021-08", (FLEXURE,), 1.37),
        ("mount-mmt-2021-08", (FLEXURE, REFRACTION), 0.93),
        ("mount-mmt-2023-07", (), 1.39),
        ("mount-mmt-2023-07", (FLEXURE,), 1.37),
        ("mount-mmt-2023-09", (), 1.27),
        ("mount-mmt-2023-09", (FLEXURE,), 1.21),
        ("mount-mmt-2025-03", (), 1.49),
        ("mount-mmt-2025-03", (FLEXURE,), 1.10),
        (GEM, (), 538.0),
        (GEM, (FLEXURE,), 230.0),
    ],
)
def test_measured_mounts_agree_with_an_independent_least_squares(
    name: str, added: tuple[str, ...], published: float
) -> None:
    values, _, rms = independent(name, 6 + len(added))
    ours, our_rms = fitted(name, *added)
    assert our_rms == pytest.approx(rms, rel=1e-4)
    assert our_rms == pytest.approx(published, abs=0.01 if published < 100.0 else 0.6)
    first, second = ("HA", "DEC") if name == GEM else ("AZ", "EL")
    names = [f"EA0{first}", f"EB0{first}", f"EC0{first}", f"EA0{second}", f"EB0{second}", f"EC{second}:const"]
    # 0.5 % of the largest: the sag is added as a small turn, 1e-2 rad of it on the small mount.
    expected = dict(zip([*names, *added], values, strict=True))
    largest = max(map(abs, values))
    assert ours == {key: pytest.approx(value, abs=0.005 * largest + 1e-8) for key, value in expected.items()}


def test_the_terms_of_the_mmt_agree_with_those_that_the_observatory_published() -> None:
    """pytelpoint's documentation of 2021-08-21: tube flexure 21.41, refraction -2.717, non-perpendicularity -3.472
    arcseconds; the signs are those of our turns."""
    _, u, _ = independent("mount-mmt-2021-08", 8)
    ours, _ = fitted("mount-mmt-2021-08", FLEXURE, REFRACTION)
    assert ours[FLEXURE] == pytest.approx(21.41 * ARCSECOND, abs=u[6])
    assert ours[REFRACTION] == pytest.approx(2.717 * ARCSECOND, abs=u[7])
    assert ours["EA0EL"] == pytest.approx(-3.472 * ARCSECOND, abs=u[3])


def missing(campaign: Campaign) -> list[tuple[str, float, float]]:
    """The missing effects with the RMS length in arcseconds before and after."""
    problem = campaign_method(campaign).problem_of(campaign)
    answer = explain(campaign, problem, "instruments", rng=np.random.default_rng(1))
    scale = np.sqrt(2.0) * 1e-3 / ARCSECOND
    return [(effect.effect, scale * effect.rms_before, scale * effect.rms_after) for effect in answer.missing]


def test_the_search_names_flexure_first_and_then_what_grows_with_the_zenith_distance() -> None:
    findings = missing(example("mount-mmt-2021-08"))
    assert [effect for effect, *_ in findings] == [FLEXURE, REFRACTION]
    assert findings[0][1:] == pytest.approx((3.83, 1.37), abs=0.006)
    assert findings[1][2] == pytest.approx(0.93, abs=0.006)


def test_the_search_finds_nothing_in_the_log_of_2023_07() -> None:
    assert missing(example("mount-mmt-2023-07")) == []


@pytest.mark.all_seeds
def test_flexure_of_the_equatorial_mount_comes_first() -> None:
    first = missing(example(GEM))[0]
    assert first[0] == FLEXURE
    # Large rows may be left out, which are outliers only beside the flexure.
    assert first[1] == pytest.approx(538.0, abs=2.0)
    assert first[2] < 231.0


AltAz = (SimulatedAxis("AZ", "rotary", Z, sign=-1), SimulatedAxis("EL", "rotary", Y, sign=-1))
Equatorial = (SimulatedAxis("HA", "rotary", Z, sign=-1), SimulatedAxis("DEC", "rotary", Y, sign=-1))
AltAlt = (SimulatedAxis("U", "rotary", X), SimulatedAxis("V", "rotary", Y))
SOUTH = (-np.cos(np.deg2rad(39.0)), 0.0, -np.sin(np.deg2rad(39.0)))
MOUNTS = {
    "altaz": (AltAz, (0.0, 0.0, -1.0), X, ((0.0, 360.0), (15.0, 88.0))),
    "equatorial": (Equatorial, SOUTH, X, ((-80.0, 80.0), (-25.0, 80.0))),
    "altalt": (AltAlt, (0.0, 0.0, -1.0), Z, ((-60.0, 60.0), (-60.0, 60.0))),
}
SKY = '\n[[setups]]\nid = "sky"\nreading = "direction"\nstandard_uncertainty_urad = 5.0\ntool_direction = {along}\n'


def mount_campaign(
    kind: str,
    seed: int,
    folder: Path,
    *,
    sag: float = 0.0,
    lift: float = 0.0,
    outer: np.ndarray | None = None,
) -> Campaign:
    """150 stars of a mount with errors of some 100 arcseconds; noise of 5 µrad in each direction across."""
    axes, gravity, along, limits = MOUNTS[kind]
    rng = np.random.default_rng(seed)
    down, tool = np.array(gravity), np.array(along)
    faulty = tuple(
        SimulatedAxis(
            axis.name, axis.kind, axis.about, axis.offset, axis.sign, (0, 0, 0, *rng.normal(0, 3e-4, 3))
        )
        for axis in axes
    )
    constant = rng.normal(0.0, 2e-4, 3)

    def motions(readings: Mapping[str, float], nominal: np.ndarray) -> tuple[float, ...]:
        gravity_here = nominal.T @ down
        level = np.cross(tool, -gravity_here)
        size, sine = float(np.linalg.norm(level)), float(-gravity_here @ tool)
        turn = constant + sag * np.cross(tool, gravity_here) + lift * (size / sine) * level / size
        return (0.0, 0.0, 0.0, *turn)

    chain = SimulatedChain(faulty, gravity=gravity, motions=motions)
    rows: list[dict[str, object]] = []
    while len(rows) < 150:
        readings_ = {
            axis.name: round(float(rng.uniform(*limit)), 5) for axis, limit in zip(axes, limits, strict=True)
        }
        star = chain.pose(readings_)[:3, :3] @ tool
        if -star @ down < np.sin(np.deg2rad(12.0)):
            continue
        star = (np.eye(3) if outer is None else outer) @ star
        noise = rng.normal(0.0, 5e-6, 3)
        star = star + noise - star * (star @ noise)
        star /= np.linalg.norm(star)
        rows.append(
            {
                "setup": "sky",
                **readings_,
                **dict(zip(("direction_x", "direction_y", "direction_z"), star, strict=True)),
            }
        )
    return read_campaign(chain.write(folder / f"{kind}-{seed}", SKY.format(along=list(along)), rows))


@pytest.mark.parametrize("kind", MOUNTS)
@pytest.mark.slow
def test_simulated_mounts_show_what_was_hidden_and_nothing_else(kind: str, tmp_path: Path) -> None:
    campaign = mount_campaign(kind, 3, tmp_path, sag=2e-4, lift=3e-5)
    problem = campaign_method(campaign).problem_of(campaign)
    answer = explain(campaign, problem, "instruments", rng=np.random.default_rng(1))
    assert [effect.effect for effect in answer.missing] == [FLEXURE, REFRACTION]
    for effect, hidden in zip(answer.missing, (2e-4, 3e-5), strict=True):
        assert abs(effect.amplitude - hidden) < 4.0 * effect.u
    assert missing(mount_campaign(kind, 53, tmp_path)) == []


def test_an_outer_frame_that_is_turned_anyhow_is_found(tmp_path: Path) -> None:
    outer = Rotation.from_rotvec([0.5, 2.0, -1.0]).as_matrix()
    turned, plain = (
        mount_campaign("altaz", 7, tmp_path / name, outer=frame)
        for name, frame in (("a", outer), ("b", None))
    )
    results = [campaign_method(campaign).identify(campaign) for campaign in (turned, plain)]
    # The frame takes up the zero and the tilts of the first axis; nothing else depends on it.
    for name in ("EA0EL", "EB0EL", "ECEL:const"):
        first, second = (result.runs[0] for result in results)
        index = results[0].parameters.index(name)
        u = np.sqrt(first.covariance[index, index] + second.covariance[index, index])
        assert abs(first.estimate[index] - second.estimate[index]) < 5.0 * u
    assert results[0].runs[0].chi_square / results[0].runs[0].degrees_of_freedom < 1.3
    names = {taken.parameter: taken.by for taken in results[0].taken_up}
    assert sorted(names["the frame of sky"]) == ["EA0AZ", "EB0AZ", "EC0AZ"]
    assert names["EC0EL"] == ("EC0AZ",)
    assert names["EAEL:const"] == ()


A = SimulatedAxis
LINK = (400.0, 0.0, 0.0)
CHAINS = {
    "axes that meet": ((A("J1", "rotary", Z), A("J2", "rotary", Y)), ((-170, 170), (-80, 80))),
    "a wrist": (
        (A("J1", "rotary", Z), A("J2", "rotary", Y), A("J3", "rotary", X)),
        ((-170, 170), (-80, 80), (-170, 170)),
    ),
    "parallel axes": ((A("J1", "rotary", Z), A("J2", "rotary", Z, LINK)), ((-120, 120), (-140, 140))),
    "SCARA": (
        (A("J1", "rotary", Z), A("J2", "rotary", Z, LINK), A("Z", "linear", Z, (300.0, 0.0, 0.0))),
        ((-120, 120), (-140, 140), (0, 150)),
    ),
    "cartesian": ((A("X", "linear", X), A("Y", "linear", Y), A("Z", "linear", Z)), ((0, 500), (0, 400), (0, 300))),
    "plate": ((A("X", "linear", X), A("Y", "linear", Y)), ((0, 500), (0, 400))),
}  # fmt: skip


def points_campaign(
    name: str, folder: Path, *, flat: bool, constant: float | None = None, targets: int = 1
) -> Campaign:
    """150 poses seen in a frame metres away; two numbers a row where ``flat``, or a third one that is ``constant``."""
    axes, limits = CHAINS[name]
    rng = np.random.default_rng(len(name))
    chain = SimulatedChain(
        tuple(
            A(a.name, a.kind, a.about, a.offset, 1, (*rng.normal(0, 0.05, 3), *rng.normal(0, 2e-4, 3)))
            for a in axes
        )
    )
    places = rng.uniform(-150.0, 150.0, (targets, 3))
    turn = Rotation.from_rotvec([0, 0, 2.0] if flat else rng.normal(0.0, 1.5, 3)).as_matrix()
    shift = rng.uniform(-3000.0, 3000.0, 3)
    rows: list[dict[str, object]] = []
    for _ in range(150):
        at = {a.name: round(float(rng.uniform(*limit)), 4) for a, limit in zip(axes, limits, strict=True)}
        pose = chain.pose(at)
        for number, place in enumerate(places):
            point = turn @ (pose[:3, :3] @ place + pose[:3, 3]) + shift + rng.normal(0.0, 5e-3, 3)
            third = constant if flat else point[2]
            rows.append(
                {
                    "setup": "camera",
                    **at,
                    "target": f"T{number}",
                    "point_x_mm": point[0],
                    "point_y_mm": point[1],
                    "point_z_mm": third,
                }
            )
    setups = '\n[[setups]]\nid = "camera"\nreading = "point"\nstandard_uncertainty_um = 5.0\n'
    return read_campaign(chain.write(folder / "points", setups, rows))


@pytest.mark.parametrize("flat", [False, True])
@pytest.mark.parametrize("name", CHAINS)
def test_points_in_an_unknown_frame_are_fitted_to_their_noise(name: str, flat: bool, tmp_path: Path) -> None:
    """The residual of N numbers with r unknowns is chi-square with N - r: 5 standard deviations of it."""
    campaign = points_campaign(name, tmp_path, flat=flat, targets=1 if flat else 2)
    problem = campaign_method(campaign).problem_of(campaign)
    solution = solve_problem(problem)
    run = campaign_method(campaign).identify(campaign, solve=lambda _: solution).runs[0]
    numbers = 150 * (2 if flat else 6)
    assert run.degrees_of_freedom == numbers - int(solution.rank[0])
    assert abs(run.chi_square - run.degrees_of_freedom) < 5.0 * np.sqrt(2.0 * run.degrees_of_freedom)


@pytest.mark.parametrize("known", [("frame",), ("targets",), ("frame", "targets")])
def test_known_frames_and_places_leave_their_errors_to_the_machine(
    known: tuple[str, ...], tmp_path: Path
) -> None:
    """A wrist of three axes that meet: with all known its location errors are those of every axis."""
    axes, limits = CHAINS["a wrist"]
    rng = np.random.default_rng(8)
    errors = [(*rng.normal(0, 0.02, 3), *rng.normal(0, 1e-4, 3)) for _ in axes]
    chain = SimulatedChain(
        tuple(A(a.name, a.kind, a.about, errors=six) for a, six in zip(axes, errors, strict=True))
    )
    rows: list[dict[str, object]] = []
    for _ in range(150):
        readings_ = {
            a.name: round(float(rng.uniform(*limit)), 4) for a, limit in zip(axes, limits, strict=True)
        }
        pose = chain.pose(readings_)
        point = pose[:3, :3] @ [20.0, -10.0, -100.0] + pose[:3, 3] + rng.normal(0.0, 5e-3, 3)
        named = zip(("point_x_mm", "point_y_mm", "point_z_mm"), point, strict=True)
        rows.append({"setup": "camera", **readings_, **dict(named)})
    setups = '\n[[setups]]\nid = "camera"\nreading = "point"\nstandard_uncertainty_um = 5.0\n'
    setups += f"tool_point_mm = [20.0, -10.0, -100.0]\nknown = {list(known)}\n".replace("'", '"')
    campaign = read_campaign(chain.write(tmp_path / "points", setups, rows))
    run = campaign_method(campaign).identify(campaign).runs[0]
    assert abs(run.chi_square - run.degrees_of_freedom) < 5.0 * np.sqrt(2.0 * run.degrees_of_freedom)


def test_a_third_number_that_is_the_same_in_all_rows_is_no_reading(tmp_path: Path) -> None:
    empty = points_campaign("plate", tmp_path / "empty", flat=True)
    written = points_campaign("plate", tmp_path / "written", flat=True, constant=12.5)
    first, second = (campaign_method(campaign).identify(campaign).runs[0] for campaign in (empty, written))
    assert second.degrees_of_freedom == first.degrees_of_freedom == 300 - 6
    assert second.chi_square == pytest.approx(first.chi_square, rel=1e-9)


def six(**errors: float) -> tuple[float, ...]:
    """Six numbers by the letters of their directions."""
    return tuple(errors.get(letter, 0.0) for letter in "XYZABC")


TABLE = A("C", "rotary", Z, sign=-1, errors=six(X=0.02, Y=-0.01, A=50e-6, B=-30e-6))
MACHINE = SimulatedChain(
    (
        A("X", "linear", X),
        A("Y", "linear", Y, errors=six(C=40e-6)),
        A("Z", "linear", Z, errors=six(A=-25e-6, B=30e-6)),
    ),
    work=(TABLE,),
)
TOOL, BALL = np.array([0.0, 0.0, -120.0]), np.array([60.0, 30.0, 50.0])
OFF = np.array([0.01, -0.02, 0.005])


def at(**readings_: float) -> dict[str, float]:
    """Readings of the machine, zero where none is named."""
    return {"X": 0.0, "Y": 0.0, "Z": 0.0, "C": 0.0, **readings_}


def tool_point(readings_: Mapping[str, float]) -> np.ndarray:
    """The tool point seen from the table."""
    pose = MACHINE.seen(readings_)
    return pose[:3, :3] @ TOOL + pose[:3, 3]


def vectors(rng: np.random.Generator) -> list[dict[str, object]]:
    rows = []
    for angle in rng.uniform(-180.0, 180.0, 40):
        place = Rotation.from_rotvec([0, 0, -np.deg2rad(angle)]).apply(BALL) - TOOL
        readings_ = at(X=place[0], Y=place[1], Z=place[2], C=angle)
        moved = 1e3 * (tool_point(readings_) - (BALL + OFF)) + rng.normal(0.0, 0.5, 3)
        rows.append({**readings_, **dict(zip(("dx_um", "dy_um", "dz_um"), moved, strict=True))})
    return rows


def lengths(rng: np.random.Generator) -> list[dict[str, object]]:
    rows = []
    for _ in range(120):
        around, up = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(-1.2, 1.2)
        place = (
            150.0 * np.array([np.cos(around) * np.cos(up), np.sin(around) * np.cos(up), np.sin(up)]) - TOOL
        )
        readings_ = at(X=place[0], Y=place[1], Z=place[2])
        length = np.linalg.norm(tool_point(readings_) - [0.03, 0.02, -0.04]) - 150.004
        rows.append({**readings_, "reading_um": 1e3 * length + rng.normal(0.0, 0.5)})
    return rows


def along_x(rng: np.random.Generator) -> list[dict[str, object]]:
    beam = np.array([1.0, 4e-4, -7e-4])
    beam /= np.linalg.norm(beam)
    places = [at(X=x) for x in np.linspace(0.0, 600.0, 40)]
    shown = np.array([tool_point(place) @ beam for place in places]) + rng.normal(0.0, 5e-4, 40)
    return [
        {**place, "reading_um": 1e3 * (value - shown[0])} for place, value in zip(places, shown, strict=True)
    ]


def across_y(rng: np.random.Generator) -> list[dict[str, object]]:
    """A straightedge that lies askew by 0.2 mm/m."""
    rows = []
    for y in np.linspace(0.0, 400.0, 40):
        shown = tool_point(at(Y=y))[0] + 0.3 + 2e-4 * y
        rows.append({**at(Y=y), "reading_um": 1e3 * shown + rng.normal(0.0, 0.5)})
    return rows


def tilts(
    turn_of: Callable[[dict[str, float], Rotation], float],
) -> Callable[[np.random.Generator], list[dict[str, object]]]:
    def rows(rng: np.random.Generator) -> list[dict[str, object]]:
        return [
            {
                **at(C=c),
                "reading_urad": 1e6 * turn_of(at(C=c), Rotation.from_rotvec([0, 0, np.deg2rad(c)]))
                + 5.0
                + rng.normal(),
            }
            for c in np.linspace(-180.0, 170.0, 40)
        ]

    return rows


def polygon(readings_: dict[str, float], nominal: Rotation) -> float:
    return float((Rotation.from_matrix(MACHINE.seen(readings_)[:3, :3]) * nominal.inv()).as_rotvec()[0])


def on_table(readings_: dict[str, float], nominal: Rotation) -> float:
    side = Rotation.from_matrix(SimulatedChain.side(MACHINE.work, readings_)[:3, :3])
    return float((side * nominal).as_rotvec()[1])


def dial(rng: np.random.Generator) -> list[dict[str, object]]:
    """A dial along X on a square that stands on the table, swept along Z."""
    places = [at(Z=z) for z in np.linspace(0.0, 400.0, 40)]
    return [
        {**place, "reading_um": 1e3 * tool_point(place)[0] + 7.0 + rng.normal(0.0, 0.5)} for place in places
    ]


def tracked(rng: np.random.Generator) -> list[dict[str, object]]:
    turn = Rotation.from_rotvec([0.1, 0.4, 2.0]).as_matrix()
    rows = []
    for _ in range(60):
        place = at(
            X=rng.uniform(0, 600), Y=rng.uniform(0, 400), Z=rng.uniform(0, 400), C=rng.uniform(-90, 90)
        )
        point = turn @ tool_point(place) + [2000.0, -1000.0, 300.0] + rng.normal(0.0, 5e-3, 3)
        rows.append({**place, **dict(zip(("point_x_mm", "point_y_mm", "point_z_mm"), point, strict=True))})
    return rows


def pointed(rng: np.random.Generator) -> list[dict[str, object]]:
    """A beam along the tool, seen on the table by a camera."""
    rows = []
    for angle in rng.uniform(-180.0, 180.0, 60):
        place = at(C=angle)
        way = MACHINE.seen(place)[:3, :3] @ np.array([0.6, 0.0, 0.8]) + rng.normal(0.0, 1e-6, 3)
        way /= np.linalg.norm(way)
        rows.append({**place, **dict(zip(("direction_x", "direction_y", "direction_z"), way, strict=True))})
    return rows


LENGTH = "standard_uncertainty_um = 0.5\ntool_point_mm = [0.0, 0.0, -120.0]"
SETUPS = {
    "nest": ("vector", f"{LENGTH}\nwork_point_mm = [60.0, 30.0, 50.0]", vectors),
    "bar": ("distance", f"{LENGTH}\nlength_mm = 150.0", lengths),
    "laser": ("displacement", f'{LENGTH}\ndirection = "X"', along_x),
    "edge": ("offset", f'{LENGTH}\ndirection = "X"\nalong = "Y"', across_y),
    "polygon": ("angle", 'standard_uncertainty_urad = 1.0\ndirection = "X"', tilts(polygon)),
    "level": ("level", 'standard_uncertainty_urad = 1.0\ndirection = "Y"\nside = "work"', tilts(on_table)),
    "dial": ("component", f'{LENGTH}\ndirection = "X"', dial),
    "tracker": ("point", "standard_uncertainty_um = 5.0\ntool_point_mm = [0.0, 0.0, -120.0]", tracked),
    "beam": ("direction", "standard_uncertainty_urad = 1.0\ntool_direction = [0.6, 0.0, 0.8]", pointed),
}
#: Six that together leave nothing open of this machine but where the table stands.
SIX = ("nest", "bar", "laser", "edge", "polygon", "level")


def machine_campaign(folder: Path, *names: str, seed: int = 3) -> Campaign:
    """The machine measured in these setups."""
    rng = np.random.default_rng(seed)
    text, rows = "", []
    for name in names:
        kind, keys, made = SETUPS[name]
        text += f'\n[[setups]]\nid = "{name}"\nreading = "{kind}"\n{keys}\n'
        rows += [{"setup": name, **row} for row in made(rng)]
    return read_campaign(MACHINE.write(folder / "machine", text, rows))


@pytest.mark.parametrize("name", SETUPS)
def test_each_kind_of_reading_is_fitted_to_its_noise(name: str, tmp_path: Path) -> None:
    campaign = machine_campaign(tmp_path, name)
    run = campaign_method(campaign).identify(campaign).runs[0]
    assert abs(run.chi_square - run.degrees_of_freedom) < 5.0 * np.sqrt(2.0 * run.degrees_of_freedom)


def test_six_instruments_together_tell_what_none_tells_alone(tmp_path: Path) -> None:
    """What is identified lies within 4 u of what was simulated; squareness of X is that of Y and C seen from X."""
    campaign = machine_campaign(tmp_path, *SIX)
    result = campaign_method(campaign).identify(campaign)
    run = result.runs[0]
    truth = dict.fromkeys(("EXX", "EYY", "EZZ"), 0.0) | {
        "EX0C": 0.02, "EY0C": -0.01, "EB0X": 30e-6, "EA0Y": -50e-6, "EC0Y": 40e-6, "EA0Z": -25e-6, "EB0Z": 30e-6,
    }  # fmt: skip
    values = dict(zip(result.parameters, run.estimate, strict=True))
    u = dict(zip(result.parameters, np.sqrt(np.diag(run.covariance)), strict=True))
    assert {name for name in values if np.isfinite(values[name])} == set(truth)
    off = {name: (values[name] - true) / u[name] for name, true in truth.items()}
    assert max(map(abs, off.values())) < 4.0, off


@pytest.mark.parametrize("words", ["ball bar", "three bars"])
def test_the_length_of_one_bar_is_one_unknown_in_all_its_planes(words: str) -> None:
    """A bar of 100 mm that is 0.3 µm too long makes every gain 3 µm/m wrong, in however many planes it is swung; three
    bars of their own make their mean wrong by 3 / sqrt(3) µm/m."""
    campaign = example("ball-bar")
    if words == "three bars":
        setups = tuple(replace(setup, instrument=setup.id) for setup in campaign.artefact.setups)
        campaign = replace(campaign, artefact=replace(campaign.artefact, setups=setups))
    result = campaign_method(campaign).identify(campaign)
    gains = [result.parameters.index(name) for name in ("EXX", "EYY", "EZZ")]
    covariance = result.runs[0].covariance[np.ix_(gains, gains)]
    expected = 3.0 if words == "ball bar" else 3.0 / np.sqrt(3.0)
    assert 1e6 * np.sqrt(covariance.sum()) / 3.0 == pytest.approx(expected, rel=0.02)


def test_what_is_written_reads_back_the_same(tmp_path: Path) -> None:
    campaign = machine_campaign(tmp_path, *SETUPS)
    again = read_campaign(write_campaign(campaign, tmp_path / "again"))
    assert (again.artefact, again.probe, again.machine) == (
        campaign.artefact,
        campaign.probe,
        campaign.machine,
    )
    assert again.probings.channels.keys() == campaign.probings.channels.keys()
    for name, values in campaign.probings.channels.items():
        np.testing.assert_array_equal(again.probings.channels[name], values)


def test_a_weight_of_each_row_counts(tmp_path: Path) -> None:
    source = EXAMPLES / "mount-mmt-2023-07"
    lines = (source / "probings.csv").read_text(encoding="utf-8").splitlines()
    folder = tmp_path / "weighted"
    folder.mkdir()
    for name in ("campaign.toml", "runs.csv"):
        text = (source / name).read_text(encoding="utf-8")
        (folder / name).write_text(text.replace("standard_uncertainty_urad = 5.0\n", ""), encoding="utf-8")
    u = ["u_urad", *("5.0" if number % 2 else "50.0" for number in range(len(lines) - 1))]
    (folder / "probings.csv").write_text(
        "\n".join(f"{line},{cell}" for line, cell in zip(lines, u, strict=True)) + "\n", encoding="utf-8"
    )
    problem = campaign_method(example("mount-mmt-2023-07")).problem_of(read_campaign(folder))
    np.testing.assert_allclose(problem.sigma[:2], [[0.05, 0.05], [0.005, 0.005]])


def test_the_reader_and_the_method_know_the_same_kinds_of_readings() -> None:
    assert set(readings()) == set(FORMATS)
    for name, kind in readings().items():
        assert (kind.columns, kind.angular, set(kind.holdable)) == (
            FORMATS[name].columns, FORMATS[name].angular, set(FORMATS[name].holdable)
        )  # fmt: skip


def damaged(folder: Path, *changes: tuple[str, str, str]) -> Path:
    """A copy of an example with texts of its files replaced."""
    source = EXAMPLES / "mount-mmt-2021-08"
    folder.mkdir()
    for name in ("campaign.toml", "runs.csv", "probings.csv"):
        text = (source / name).read_text(encoding="utf-8")
        for file, before, after in changes:
            assert file != name or before in text
            text = text.replace(before, after, 1) if file == name else text
        (folder / name).write_text(text, encoding="utf-8")
    return folder


TOML, ROWS = "campaign.toml", "probings.csv"
FAULTS = (
    (TOML, '"direction"', '"driection"', "'driection' is no kind of reading; did you mean 'direction'?"),
    (TOML, "uncertainty_urad", "uncertainty_um", "the reading is an angle: write standard_uncertainty_urad"),
    (
        TOML,
        "standard_uncertainty_urad = 5.0\n",
        "",
        "nothing states the standard uncertainty of this reading",
    ),
    (TOML, "tool_direction", "axis", "this key is missing; write for example tool_direction"),
    (TOML, "tool_direction", "work_direction", "this key is not known; did you mean 'tool_direction'?"),
    (TOML, "tool_direction", 'known = ["zero"]\ntool_direction', "'zero' is no unknown of this reading"),
    (ROWS, ",stars,", ",moon,", "there is no setup 'moon'; the setups are stars"),
    (ROWS, "0.213922902", "0.313922902", "the direction has length 1.0"),
    (ROWS, "0.213922902", "", "the cell is empty; setup 'stars' reads direction_x, direction_y, direction_z"),
)


@pytest.mark.parametrize(("file", "before", "after", "words"), FAULTS)
def test_a_folder_with_a_fault_is_refused_with_what_would_be_right(
    file: str, before: str, after: str, words: str, tmp_path: Path
) -> None:
    with pytest.raises(CampaignError, match=re.escape(words)):
        read_campaign(damaged(tmp_path / "damaged", (file, before, after)))


def test_a_mount_with_a_wrong_sign_is_refused(tmp_path: Path) -> None:
    folder = damaged(
        tmp_path / "damaged", ("campaign.toml", 'about = "Y"\nsign = -1', 'about = "Y"\nsign = 1')
    )
    campaign = read_campaign(folder)
    with pytest.raises(DataError, match="contradict the machine file"):
        campaign_method(campaign).identify(campaign)


def test_changes_of_an_artefact_are_refused() -> None:
    with pytest.raises(EffectError, match="is a change of targets that are touched or tracked"):
        fitted("mount-mmt-2023-07", "artefact:expansion@run_time")


def test_a_small_frame_of_the_simulator_is_that_of_the_conventions() -> None:
    """R_C R_B R_A: the last turn comes first."""
    turn = small((0, 0, 0, 0.1, 0.2, 0.3))[:3, :3]
    expected = (
        Rotation.from_rotvec([0, 0, 0.3])
        * Rotation.from_rotvec([0, 0.2, 0])
        * Rotation.from_rotvec([0.1, 0, 0])
    )
    np.testing.assert_allclose(turn, expected.as_matrix(), atol=1e-15)


def test_four_years_of_one_mount_are_one_history(tmp_path: Path) -> None:
    """The tilt of azimuth went from 9.6 over 23.6 to 10.4 arcseconds, the elevation's zero by 11, the collimation from
    5.8 to 0.75."""
    with Database(tmp_path / "mount.duckdb") as db:
        for name in MMT:
            import_campaign(db, example(name))
            identify(db, IdentifyRequest(name))
        history = trend(db, TrendRequest("MMT")).parameters
    assert set(history) == {"EA0AZ", "EB0AZ", "EC0AZ", "EA0EL", "EB0EL", "ECEL:const"}
    values = {name: [fitted(campaign)[0][name] / ARCSECOND for campaign in MMT] for name in history}
    assert values["EA0AZ"] == pytest.approx([9.6, 23.6, 10.4, 12.2], abs=0.1)
    assert values["EB0EL"][0] - values["EB0EL"][3] == pytest.approx(11.4, abs=0.1)
    assert [values["ECEL:const"][index] for index in (0, 3)] == pytest.approx([5.8, 0.75], abs=0.05)
    for name, parameter in history.items():
        assert parameter.mean.latest == pytest.approx(values[name][3] * ARCSECOND * 1e6, rel=1e-6)


def test_the_uncertainty_of_a_mount_is_that_of_the_weights(tmp_path: Path) -> None:
    """GUM framework by rows against the inverse normal matrix of the independent least squares, for 5 µrad.

    The stars are told in another order: as recorded they follow themselves, which is in u beside the weights.
    """
    campaign = example("mount-mmt-2023-07")
    told = campaign.probings
    mixed = told.rows(np.random.default_rng(1).permutation(len(told)))
    mixed = replace(campaign, probings=replace(mixed, sequence=told.sequence, time=told.time))
    request = UncertaintyRequest(campaign.name, method="guf", model_uncertainty=False)
    answers = []
    for number, each in enumerate((mixed, campaign)):
        with Database(tmp_path / f"mount-{number}.duckdb") as db:
            import_campaign(db, each)
            answers.append(uncertainty(db, request))
    answer, recorded = answers
    assert answer.input_covariance_source.neighbours is None
    assert recorded.input_covariance_source.neighbours > 0.1
    _, u, rms = independent("mount-mmt-2023-07", 6)
    readings_ = 2 * len(example("mount-mmt-2023-07").probings)
    from_residuals = rms * ARCSECOND / np.sqrt(2.0) * np.sqrt(readings_ / (readings_ - 6.0))
    expected = u / from_residuals * 5.0
    names = ("EA0AZ", "EB0AZ", "EC0AZ", "EA0EL", "EB0EL", "ECEL:const")
    assert [answer.guf.u[name] for name in names] == pytest.approx(expected, rel=2e-3)
