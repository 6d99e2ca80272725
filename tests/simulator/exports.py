"""The readings of simulated instruments as instruments and controllers write them; ``python -m tests.simulator.exports
examples`` writes ``files-as-they-come`` and ``files-of-a-plate``.

The layouts are those that the readers document; no code is shared with these. The machine is that of
``four_instruments`` without its hidden pitch.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from uuid import NAMESPACE_URL, uuid5

import numpy as np
from scipy.spatial.transform import Rotation

from tests.simulator import four_instruments as shop
from tests.simulator.four_instruments import Row

HEAD = """\
format = 1
campaign = "{name}"
method = "instruments"

[machine]
id = "CENTRE-5"
topology = "w C Y b X Z t"

[dates]
utc_offset = "+01:00"
"""
QIF = "http://qifstandards.org/xsd/qif3"


def rtl(axis: str, rows: Sequence[Row]) -> str:
    """A laser's text with sections: targets, and run by run the deviations in µm there and back."""
    places = np.array([row[axis] for row in rows], dtype=float)
    deviations = np.array([row["reading_um"] for row in rows], dtype=float) - 1e3 * (places - places[0])
    targets = np.unique(places)
    number = np.searchsorted(targets, places) + 1
    run = np.arange(len(rows)) // (2 * len(targets)) + 1
    listed = "".join(
        " ".join(f"{place:.4f}" for place in targets[start : start + 6]) + "\n"
        for start in range(0, len(targets), 6)
    )
    lines = "".join(f"  {r}  {n}  {value:.2f}\n" for r, n, value in zip(run, number, deviations, strict=True))
    return (
        "HEADER::\nFile type: LINEAR\nOwner: simulated\nVersion no: 1\nTARGET DATA::\nFiletype: DISTANCE\n"
        f"Target-count: {len(targets)}\nTargets :\n{listed}Flags: 0\nUSER-TEXT::\nMachine: CENTRE-5\n"
        f"Date: 2026-03-02 20:00\nAxis: {axis}\nRUNS::\nRun-count: {run[-1]}\nDEVIATIONS::\nRun Target Data:\n{lines}"
        "EOF::\n"
    )


def bar(rows: Sequence[Row], step: float = 5.0) -> str:
    """Two circles, one in each sense, each with its head."""
    half = len(rows) // 2
    angles = np.arange(0.0, 360.0 + step / 2.0, step)
    text = ""
    for sense, part, turns in (("CCW", rows[:half], angles), ("CW", rows[half:], angles[::-1])):
        text += (
            f"Date: 2026-03-03 08:00\nMachine: CENTRE-5\nRadius: {shop.BAR:.1f} mm\nFeed rate: 1000 mm/min\n"
            f"Direction: {sense}\n\nAngle (deg)\tDeviation (um)\n"
        )
        text += "".join(
            f"{angle:.1f}\t{float(str(row['reading_um'])):.2f}\n"
            for angle, row in zip(turns, part, strict=True)
        )
    return text


def german(rows: Sequence[Row]) -> bytes:
    """An R-test as a German Windows program writes it: semicolons, decimal commas, Windows-1252."""
    text = "R-Test Prüfung;CENTRE-5\r\nDatum;03.03.2026 10:15\r\n\r\n"
    text += "X [mm];Y [mm];Z [mm];C [°];dX [µm];dY [µm];dZ [µm]\r\n"
    for row in rows:
        cells = [f"{row[name]:.4f}" for name in ("X", "Y", "Z", "C")]
        cells += [f"{row[name]:.2f}" for name in ("dx_um", "dy_um", "dz_um")]
        text += ";".join(cells).replace(".", ",") + "\r\n"
    return text.encode("cp1252")


def printed(rows: Sequence[Row]) -> str:
    """A dial on a square as a macro prints it: Z in mm, D (the dial) in mm."""
    lines = [f"Z{row['Z']:.4f} D{1e-3 * float(str(row['reading_um'])):.5f}\n" for row in rows]
    return "%\nSQUARE ON TABLE DATE 2026-03-03 11:00\nG21\n" + "".join(lines) + "%\n"


def write_instruments(folder: Path, seed: int = 41) -> None:
    """Write laser, ball bar, R-test and dial of one machine with their mapping."""
    rng = np.random.default_rng(seed)
    chain = shop.machine(pitch=0.0)
    folder.mkdir(parents=True)
    parts = [shop.laser(chain, rng, keys=shop.SCALE_KEY)]
    parts += [maker(chain, rng) for maker in (shop.ball_bar, shop.r_test, shop.dial)]
    rows = {}
    for row in (row for _, part in parts for row in shop.rounded(part)):
        rows.setdefault(str(row["setup"]), []).append(row)
    mapping = HEAD.format(name=folder.name) + "".join(text for text, _ in parts)
    for axis in "XYZ":
        (folder / f"laser-{axis}.rtl").write_text(rtl(axis, rows[f"laser-{axis}"]), encoding="ascii")
        columns = dict.fromkeys(("x_mm", "y_mm", "z_mm", "c_deg"), "0.0")
        columns[f"{axis.lower()}_mm"] = '{ column = "position", unit = "mm" }'
        mapping += _entry(
            f"laser-{axis}.rtl", f"laser-{axis}",
            {**columns, "reading_um": '{ column = "deviation", unit = "um", deviation = true }'},
        )  # fmt: skip
    centre = shop.BAR_AT - shop.TOOL
    for name, first, second in (("xy", 0, 1), ("yz", 1, 2), ("zx", 2, 0)):
        (folder / f"bar-{name}.bar").write_text(bar(rows[f"bar-{name}"]), encoding="ascii")
        (third,) = {0, 1, 2} - {first, second}
        mapping += _entry(
            f"bar-{name}.bar", f"bar-{name}", {f"{'xyz'[third]}_mm": repr(float(centre[third])), "c_deg": "0.0"},
            f'axes = ["{"XYZ"[first]}", "{"XYZ"[second]}"]\ncentre_mm = [{centre[first]}, {centre[second]}]\n',
        )  # fmt: skip
    (folder / "r-test.csv").write_bytes(german(rows["r-test"]))
    mapping += _entry("r-test.csv", "r-test", {})
    (folder / "square.prn").write_text(printed(rows["square"]), encoding="ascii")
    mapping += _entry(
        "square.prn", "square",
        {"x_mm": "0.0", "y_mm": "0.0", "c_deg": "0.0", "reading_um": '{ column = "D", unit = "mm" }'},
    )  # fmt: skip
    (folder / "mapping.toml").write_text(mapping, encoding="utf-8")


def _entry(file: str, setup: str, columns: dict[str, str], keys: str = "") -> str:
    lines = "".join(f"{name} = {source}\n" for name, source in columns.items())
    return f'\n[[exports]]\nfile = "{file}"\nsetup = "{setup}"\n{keys}\n[exports.columns]\n{lines}'


#: Where holes are drilled and points measured, X, Y, Z readings in mm.
GRID = np.array(
    [(x, y, z) for z in (0.0, 200.0) for y in (-150.0, 0.0, 150.0) for x in (-200.0, -50.0, 100.0, 250.0)]
)
CMM_U, TRACKER_U, PROBE_U = 1e-3, 5e-3, 1e-3
#: What the setups state of their scales, um/m, and why.
CMM_SCALE = 1.5, "L/400 of its maximum permissible error: 2.5 um/m as a half width, rectangular."
PLATE_SCALE = 1.5, "Calibrated to 0.5 um/m; steel, its temperature known to 0.1 K: 1.2 um/m."
TRACKER_SCALE = 0.5, "0.5 um/m as its maker's limit (0.3 um/m), air known to 0.3 K and 1 hPa (0.3 um/m each)."


def _places(chain: object, rows: np.ndarray, rng: np.random.Generator, u: float) -> np.ndarray:
    """Tool points (n, 3) seen from the table, in a frame that is turned and shifted, with noise."""
    points = np.array([shop.seen(chain, shop.pose(X=x, Y=y, Z=z)) for x, y, z in rows])
    turn = Rotation.from_rotvec([0.0, 0.0, 2e-3])
    return turn.apply(points) + np.array([12.0, -7.0, 3.0]) + rng.normal(0.0, u, points.shape)


def qif(names: Sequence[str], nominal: np.ndarray, measured: np.ndarray) -> str:
    """Measured points of a plate as QIF 3, valid by the schema of the standard."""
    count, up = len(names), "<Normal>0 0 1</Normal>"
    nominals = "".join(
        f'<PointFeatureNominal id="{100 + i}"><FeatureDefinitionId>9</FeatureDefinitionId><Location>'
        f"{x} {y} {z}</Location>{up}</PointFeatureNominal>" for i, (x, y, z) in enumerate(nominal)
    )  # fmt: skip
    items = "".join(
        f'<PointFeatureItem id="{200 + i}"><FeatureNominalId>{100 + i}</FeatureNominalId><FeatureName>{name}'
        "</FeatureName><DeterminationMode><Checked><CheckDetails><Measured/></CheckDetails></Checked>"
        "</DeterminationMode></PointFeatureItem>" for i, name in enumerate(names)
    )  # fmt: skip
    results = "\n".join(
        f'<PointFeatureMeasurement id="{300 + i}"><FeatureItemId>{200 + i}</FeatureItemId><Location>'
        f"{x:.5f} {y:.5f} {z:.5f}</Location></PointFeatureMeasurement>" for i, (x, y, z) in enumerate(measured)
    )  # fmt: skip
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<QIFDocument xmlns="{QIF}" idMax="999" versionQIF="3.0.0">\n'
        f"<QPId>{uuid5(NAMESPACE_URL, 'plate')}</QPId>\n"
        "<FileUnits><PrimaryUnits><LinearUnit><SIUnitName>meter</SIUnitName><UnitName>mm</UnitName><UnitConversion>"
        "<Factor>0.001</Factor></UnitConversion></LinearUnit></PrimaryUnits></FileUnits>\n"
        '<Features><FeatureDefinitions n="1"><PointFeatureDefinition id="9"/></FeatureDefinitions>\n'
        f'<FeatureNominals n="{count}">{nominals}</FeatureNominals>\n<FeatureItems n="{count}">{items}</FeatureItems>'
        '</Features>\n<Results><MeasurementResultsSet n="1"><MeasurementResults id="299"><ThisResultsInstanceQPId>'
        f"{uuid5(NAMESPACE_URL, 'plate/results')}</ThisResultsInstanceQPId>\n"
        f'<MeasuredFeatures n="{count}">\n{results}\n</MeasuredFeatures><InspectionStatus><InspectionStatusEnum>'
        "PASS</InspectionStatusEnum></InspectionStatus></MeasurementResults></MeasurementResultsSet>"
        "<InspectionTraceability><InspectionStart>2026-03-04T09:30:00+01:00</InspectionStart></InspectionTraceability>"
        "</Results>\n</QIFDocument>\n"
    )


def dfq(names: Sequence[str], nominal: np.ndarray, measured: np.ndarray) -> str:
    """The same as Q-DAS ASCII: a characteristic a coordinate, one line of values."""
    labels = [
        (f"{name}.{letter}", value)
        for name, row in zip(names, nominal, strict=True)
        for letter, value in zip("XYZ", row, strict=True)
    ]
    head = f"K0100 {len(labels)}\nK1001 4711\nK1002 Plate\n" + "".join(
        f"K2002/{i} {label}\nK2101/{i} {value:.3f}\nK2142/{i} mm\n"
        for i, (label, value) in enumerate(labels, start=1)
    )
    cells = [f"{value:.5f}\x140\x1404.03.2026/09:30:00" for value in measured.ravel()]
    return head + "\x0f".join(cells) + "\n"


def protocols(nominal: np.ndarray, actual: np.ndarray) -> str:
    """Holes of a calibrated plate probed by cycle 421: nominal is the calibration, actual where they were met."""
    return "".join(
        "Measuring log for touch probe cycle 421 Hole measuring\n\nDate: 30-06-2026\nTime: 6:55:04\n"
        "Measuring program: TNC:\\PLATE\\CHECK.H\nType of dimension (0 = MM / 1 = INCH): 0\n\nNominal values:\n"
        f"Center in reference axis: {x:.5f}\nCenter in minor axis: {y:.5f}\nDiameter: 12.0000\n\nActual values:\n"
        f"Center in reference axis: {a:.5f}\nCenter in minor axis: {b:.5f}\nDiameter: 12.0031\n\nDeviations:\n"
        f"Center in reference axis: {a - x:.5f}\nCenter in minor axis: {b - y:.5f}\nDiameter: 0.0031\n\n"
        "Further measuring results:\nMeasuring height: -5.0000\nEnd of measuring log\n\n"
        for (x, y), (a, b) in zip(nominal, actual, strict=True)
    )


def write_plate(folder: Path, seed: int = 42) -> None:
    """Write a drilled plate measured twice on a CMM, a calibrated one that was probed, and a tracker's points."""
    rng = np.random.default_rng(seed)
    chain = shop.machine(pitch=0.0)
    folder.mkdir(parents=True)
    names = [f"H{number}" for number in range(1, len(GRID) + 1)]
    mapping = HEAD.format(name=folder.name).replace("[dates]\n", '[dates]\norder = "day-month-year"\n')
    for file, writer in (("plate.qif", qif), ("plate.dfq", dfq)):
        (folder / file).write_bytes(writer(names, GRID, _places(chain, GRID, rng, CMM_U)).encode("ascii"))
        setup = file.replace(".", "-")
        mapping += _point(setup, "coordinate measuring machine", CMM_U, *CMM_SCALE)
        columns = {f"{letter}_mm": f'"nominal_{letter}"' for letter in "xyz"}
        columns |= {f"point_{letter}_mm": f'"{letter}"' for letter in "xyz"}
        mapping += _entry(file, setup, {**columns, "c_deg": "0.0"})
    flat = GRID[GRID[:, 2] == 0.0]
    # The plate's calibrated places are what the machine's tool sees there; the control reads where it stood.
    calibrated = _places(chain, flat, rng, PROBE_U)[:, :2]
    (folder / "TCHPR421.TXT").write_text(protocols(calibrated, flat[:, :2]), encoding="ascii")
    mapping += _point("plate-probed", "calibrated plate, probed", PROBE_U, *PLATE_SCALE)
    mapping += _entry(
        "TCHPR421.TXT", "plate-probed",
        {
            "x_mm": '"Actual values/Center in reference axis"', "y_mm": '"Actual values/Center in minor axis"',
            "z_mm": "0.0", "c_deg": "0.0", "point_x_mm": '"Nominal values/Center in reference axis"',
            "point_y_mm": '"Nominal values/Center in minor axis"',
        },
        'format = "probing log"\n',
    )  # fmt: skip
    points = _places(chain, GRID, rng, TRACKER_U) / 1e3
    tracker = "Tracker export\nDate: 05 Mar 2026 13:20\nname x y z\n" + "".join(
        f"{name} {x:.6f} {y:.6f} {z:.6f}\n" for name, (x, y, z) in zip(names, points, strict=True)
    )
    poses = "target,x_mm,y_mm,z_mm\n" + "".join(
        f"{name},{x},{y},{z}\n" for name, (x, y, z) in zip(names, GRID, strict=True)
    )
    (folder / "tracker.txt").write_text(tracker, encoding="ascii")
    (folder / "tracker-poses.csv").write_text(poses, encoding="ascii")
    mapping += _point("tracker", "laser tracker", TRACKER_U, *TRACKER_SCALE)
    metres = {f"point_{letter}_mm": f'{{ column = "{letter}", unit = "m" }}' for letter in "xyz"}
    mapping += _entry(
        "tracker.txt",
        "tracker",
        {**metres, "target": '"name"', "c_deg": "0.0"},
        'positions = "tracker-poses.csv"\n',
    )
    (folder / "mapping.toml").write_text(mapping, encoding="utf-8")


def _point(setup: str, instrument: str, u: float, scale: float, why: str) -> str:
    return (
        f'\n[[setups]]\nid = "{setup}"\nreading = "point"\ninstrument = "{instrument}"\n'
        f'standard_uncertainty_um = {1e3 * u:g}\ntool_point_mm = {shop.TOOL.tolist()}\nknown = ["targets"]\n'
        f"# {why}\nscale_standard_uncertainty_um_per_m = {scale}\n"
    )


README = """\
# Samples

No files of instruments: made from simulated readings by `python -m tests.simulator.exports examples`.

"""
SAMPLES = {
    "files-as-they-come": """\
- `.rtl` has the sections that public readers of such laser files take: HEADER::, TARGET DATA::, RUNS::, DEVIATIONS::.
- `.bar` is a head of keys and a table of angle and deviation for each circle; no document of a maker was at hand.
- `r-test.csv` is a table as a German Windows program writes it.
- `square.prn` is what DPRNT prints (operator's manuals of Haas mills, macros, formatted output).
""",
    "files-of-a-plate": """\
- `plate.qif` has the elements of QIF 3 (ISO 23952) that hold measured points; it is valid by the published schema.
- `plate.dfq` has the K-fields of the Q-DAS ASCII transfer format.
- `TCHPR421.TXT` is the log of touch probe cycle 421 as the HEIDENHAIN manuals print it.
- `tracker.txt` is a table in metres; no document of a maker was at hand.
""",
}


def write_examples(folder: Path) -> None:
    """Write both folders of files, and what they are."""
    write_instruments(folder / "files-as-they-come")
    write_plate(folder / "files-of-a-plate")
    for name, text in SAMPLES.items():
        (folder / name / "README.md").write_text(README + text, encoding="utf-8")


if __name__ == "__main__":
    write_examples(Path(sys.argv[1]))
