"""The measured series of NIST as curve folders, as a user would hand them to `monitor import`.

Columns and values are those of the published files (tests/references); nothing is left out or changed but
blank lines and headers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

REFERENCES = Path(__file__).resolve().parents[1] / "references"
CASES, STRD = REFERENCES / "nist-cases", REFERENCES / "nist-strd"


@dataclass(frozen=True)
class Series:
    """One series: its base model, its columns as printed, and further keys of [curve]."""

    name: str
    title: str
    base: str
    columns: Mapping[str, Sequence[str]]
    keys: str = ""


def rows(path: Path, skip: int) -> list[list[str]]:
    """The cells of every line after a header of ``skip`` lines."""
    return [cells for line in path.read_text().splitlines()[skip:] if (cells := line.split())]


def _flat(name: str) -> list[str]:
    return [cell for cells in rows(CASES / f"nist_{name}.DAT", 25) for cell in cells]


def _number(cell: str) -> str:
    """A label of a gauge study: 138. is wafer 138."""
    return cell.rstrip(".")


def _series(name: str, title: str, unit: str = "") -> Series:
    return Series(name.lower(), title, f"y{unit} ~ 1", {f"y{unit}": _flat(name)})


def _gauge(name: str, title: str) -> Series:
    # The data begin at line 26; the header of the columns stands below the instructions.
    found = [cells for cells in rows(CASES / "nist_MPC61.DAT", 25) if len(cells) == 9 and cells[0] in "12"]
    run, wafer, probe, month, day, operator, temperature, average, _ = zip(*found, strict=True)
    return Series(
        name,
        title,
        "resistivity ~ 1",
        {
            "resistivity": average,
            "run": run,
            "wafer": [_number(cell) for cell in wafer],
            "probe": [_number(cell) for cell in probe],
            "day": [f"{_number(m)}-{_number(d)}" for m, d in zip(month, day, strict=True)],
            "operator": [_number(cell) for cell in operator],
            "temperature_degC": temperature,
        },
        'groups = ["run", "wafer", "probe", "day", "operator"]\n',
    )


def _mpc62() -> Series:
    """One check standard and one probe: every value is the mean of six readings, whose scatter is printed with it."""
    found = [cells for cells in rows(CASES / "nist_MPC62.DAT", 50) if cells[0] == "51939"]
    columns = list(zip(*found, strict=True))
    assert set(columns[8]) == {"2362"}
    assert set(columns[12]) == {"5"}
    pooled = math.sqrt(sum(float(s) ** 2 for s in columns[11]) / len(found))
    return Series(
        "mpc62",
        "check standard of resistivity, one probe",
        "resistivity ~ 1",
        {
            "resistivity": columns[10],
            "date": [f"1995-{m}-{d}T{h}:{s}" for m, d, h, s in zip(*columns[2:6], strict=True)],
            "day": [f"{m}-{d}" for m, d in zip(*columns[2:4], strict=True)],
            "operator": columns[6],
            "humidity_percent": columns[7],
            "temperature_degC": columns[9],
        },
        f'groups = ["day", "operator"]\nstandard_uncertainty = {pooled / math.sqrt(6.0):.5f}\n',
    )


def _mpc633() -> Series:
    """Five wafers on six days in two runs, with the readings of two wirings of one probe."""
    found = rows(CASES / "nist_MPC633K.DAT", 0)
    columns: dict[str, list[str]] = {"resistivity": [], "wafer": [], "run": [], "wiring": [], "day": []}
    for number, cells in enumerate(found):
        for run in (0, 1):
            for wiring in (0, 1):
                columns["resistivity"].append(cells[2 + 4 * run + 2 * wiring])
                columns["wafer"].append(_number(cells[0]))
                columns["run"].append(str(run + 1))
                columns["wiring"].append("ab"[wiring])
                columns["day"].append(f"{run + 1}-{number % 6 + 1}")
    return Series("mpc633", "five wafers, two runs, two wirings of a probe", "resistivity ~ 1", columns,
                  'groups = ["wafer", "run", "wiring", "day"]\n')  # fmt: skip


def _dziuba1() -> Series:
    found = rows(CASES / "nist_DZIUBA1.DAT", 25)
    return Series(
        "dziuba1",
        "standard resistor over five years",
        "resistance_ohm ~ 1",
        {
            "date": [f"19{year}-{int(month):02d}-{int(day):02d}" for month, day, year, _ in found],
            "resistance_ohm": [value for *_, value in found],
        },
    )


def _mlco2mon() -> Series:
    found = [cells for cells in rows(CASES / "nist_MLCO2MON.DAT", 25) if len(cells) == 4]
    return Series(
        "mlco2mon",
        "carbon dioxide on Mauna Loa by month",
        "co2_ppm ~ 1 + time_year",
        {"time_year": [cells[1] for cells in found], "co2_ppm": [cells[0] for cells in found]},
    )


def _two_columns(
    name: str, title: str, path: Path, skip: int, base: str, names: tuple[str, str], keys: str = ""
) -> Series:
    found = rows(path, skip)
    return Series(name, title, base, {names[0]: [c[0] for c in found], names[1]: [c[1] for c in found]}, keys)


def series() -> dict[str, Series]:
    """All series, by name."""
    found = [
        _two_columns(
            "pontius", "load cell, deflection over load", CASES / "nist_PONTIUS.DAT", 25,
            "deflection ~ 1 + load", ("deflection", "load"),
        ),
        _two_columns(
            "loadcell", "load cell, response over load, three times each", CASES / "nist_LOADCELL.DAT", 25,
            "response ~ 1 + load", ("load", "response"),
        ),
        _dziuba1(),
        _mlco2mon(),
        _two_columns(
            "enso", "air pressure between Easter Island and Darwin by month", STRD / "nonlinear" / "ENSO.dat", 60,
            "pressure ~ 1 + time_month:sin12", ("pressure", "time_month"),
        ),
        _series("LEW", "steel-concrete beam under periodic pressure"),
        _mpc62(),
        _gauge("mpc61", "gauge study: wafers, probes, runs, days"),
        _mpc633(),
        _series("RANDN", "normal random numbers"),
        _series("RANDU", "uniform random numbers"),
        _series("ZARR13", "heat flow meter, calibration factor"),
        _series("SOULEN", "Josephson junction, counts"),
    ]  # fmt: skip
    return {one.name: one for one in found}


def write(one: Series, folder: Path) -> Path:
    """The campaign folder of a series."""
    folder.mkdir(parents=True)
    response = one.base.partition("~")[0].strip()
    (folder / "campaign.toml").write_text(
        f'format = 1\ncampaign = "{one.name}"\nmethod = "curve"\n\n[curve]\nresponse = "{response}"\n'
        f'base = "{one.base}"\n{one.keys}'
    )
    lines = [",".join(one.columns), *(",".join(row) for row in zip(*one.columns.values(), strict=True))]
    (folder / "data.csv").write_text("\n".join(lines) + "\n")
    return folder
