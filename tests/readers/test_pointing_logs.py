"""Pointing logs of telescopes: angles by their convention become directions, mount readings become axes.

Vectors are written down by hand; refraction is held against rays traced through a model atmosphere; a whole log is that
of a mount simulated by scipy's rotations.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import find_mistakes
from monitor.exceptions import CampaignError
from monitor.methods import campaign_method
from monitor.readers import read_campaign, read_exports
from monitor.readers.foreign_units import sexagesimal
from monitor.readers.mapping.refraction import refraction
from monitor.records import Campaign
from tests.simulator.instruments import SimulatedAxis, SimulatedChain

MOUNT = """\
format = 1
campaign = "night"
method = "instruments"

[machine]
id = "T1"
gravity = [0.0, 0.0, -1.0]

[[machine.tool_chain]]
name = "AZ"
kind = "rotary"
about = "Z"
sign = -1

[[machine.tool_chain]]
name = "EL"
kind = "rotary"
about = "Y"
sign = -1

[[setups]]
id = "stars"
reading = "direction"
standard_uncertainty_urad = 5.0
tool_direction = [1.0, 0.0, 0.0]

[[runs]]
started_at = 2026-03-02T20:00:00+00:00

[[exports]]
file = "night.csv"

[exports.columns]
az_deg = "mount az"
el_deg = "mount el"

[exports.direction]
"""
FROM_NORTH = """\
azimuth_deg = "az"
azimuth_from = "north through east"
elevation_deg = "el"
refraction = "applied"
"""
#: Zenith distance as seen, and refraction: rays traced through a model atmosphere at 1005 hPa, 280.15 K, humidity 80 %,
#: 0.574 µm (Hohenkerk and Sinclair, NAO Technical Note 63 (1985), as the notes of ERFA's refco quote them).
TRACED = {10: 10.27, 20: 21.19, 30: 33.61, 40: 48.82, 45: 58.16, 50: 69.28, 55: 82.97, 60: 100.51, 65: 124.23,
          70: 158.63, 72: 177.32, 74: 200.35, 76: 229.45, 78: 267.44, 80: 319.13}  # fmt: skip


def log(folder: Path, direction: str, header: str, *rows: str) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "mapping.toml").write_text(MOUNT + direction, encoding="utf-8")
    (folder / "night.csv").write_text("\n".join((header, *rows)) + "\n", encoding="utf-8")
    return folder


def directions(campaign: Campaign) -> np.ndarray:
    return np.column_stack([campaign.probings.channels[f"direction_{axis}"] for axis in "xyz"])


def refused(folder: Path) -> str:
    with pytest.raises(CampaignError, match="was refused, nothing of it was kept") as caught:
        read_campaign(folder)
    return str(caught.value)


HALF, ROOT = 0.5, np.sqrt(0.75)
#: Where every line of sight points, by hand: x north (or meridian and equator), y west (or east), z up (or the pole).
BY_HAND: dict[str, tuple[str, str, list[tuple[str, tuple[float, float, float]]]]] = {
    "from north through east": (
        FROM_NORTH, "az [deg],el [deg]",
        [("0,0", (1, 0, 0)), ("90,0", (0, -1, 0)), ("270,60", (0, HALF, ROOT)), ("360,30", (ROOT, 0, HALF))],
    ),
    "from south through west, zenith distance": (
        'azimuth_deg = "az"\nazimuth_from = "south through west"\nzenith_distance_deg = "zd"\nrefraction = "applied"\n',
        "az [deg],zd [deg]",
        [("0,90", (-1, 0, 0)), ("90,90", (0, 1, 0)), ("180,60", (ROOT, 0, HALF)), ("-90,30", (0, -HALF, ROOT))],
    ),
    "from north through west, in radians and minutes": (
        'azimuth_deg = "az"\nazimuth_from = "north through west"\nelevation_deg = "el"\nrefraction = "applied"\n',
        "az [rad],el [arcmin]",
        [("0.0,0", (1, 0, 0)), ("1.5707963267948966,0", (0, 1, 0)), ("0.0,1800", (ROOT, 0, HALF))],
    ),
    "from south through east": (
        'azimuth_deg = "az"\nazimuth_from = "south through east"\nelevation_deg = "el"\nrefraction = "applied"\n',
        "az [deg],el [deg]",
        [("0,0", (-1, 0, 0)), ("90,0", (0, -1, 0)), ("30,0", (-ROOT, -HALF, 0))],
    ),
    "hour angle in hours, minutes, seconds": (
        'hour_angle_deg = "ha"\ndeclination_deg = "dec"\nrefraction = "applied"\n',
        "ha [h:m:s],dec [d:m:s]",
        [
            ("00:00:00,00:00:00", (1, 0, 0)),
            ("06:00:00,+00:00:00", (0, -1, 0)),
            ("-02:00:00.0,00:00:00.0", (ROOT, HALF, 0)),
            ("00:00:00,-30:00:00", (ROOT, 0, -HALF)),
            ("00:00:00,-00:30:00", (np.cos(np.pi / 360), 0, -np.sin(np.pi / 360))),
            ("18:00:00,60:00:00", (0, HALF, ROOT)),
        ],
    ),
    "hour angle in hours, from the pole": (
        'hour_angle_deg = "ha"\npole_distance_deg = "pd"\nrefraction = "applied"\n',
        "ha [h],pd [deg]",
        [("6.0,90", (0, -1, 0)), ("0.0,60", (ROOT, 0, HALF)), ("12.0,120", (-ROOT, 0, -HALF))],
    ),
}  # fmt: skip


@pytest.mark.parametrize("convention", BY_HAND)
def test_angles_become_the_directions_that_were_computed_by_hand(convention: str, tmp_path: Path) -> None:
    direction, header, rows = BY_HAND[convention]
    lines = [f"{angles},{number},{number + 1}" for number, (angles, _) in enumerate(rows)]
    campaign = read_campaign(
        log(tmp_path / "log", direction, f"{header},mount az [deg],mount el [deg]", *lines)
    )
    assert isinstance(campaign, Campaign)
    np.testing.assert_allclose(directions(campaign), [vector for _, vector in rows], atol=1e-12)


def test_readings_of_the_mount_may_be_written_as_angles_are(tmp_path: Path) -> None:
    header = "az [deg],el [deg],mount az [d:m:s],mount zd [deg]"
    folder = log(tmp_path / "log", FROM_NORTH, header, "10,40,10:30:36.0,50.25", "20,50,-00:00:36,39.5")
    mapping = folder / "mapping.toml"
    counted = 'el_deg = { column = "mount zd", sign = -1, offset = 90.0 }'
    mapping.write_text(
        mapping.read_text(encoding="utf-8").replace('el_deg = "mount el"', counted), encoding="utf-8"
    )
    campaign = read_campaign(folder)
    assert isinstance(campaign, Campaign)
    np.testing.assert_allclose(np.rad2deg(campaign.probings.readings["AZ"]), [10.51, -0.01], atol=1e-13)
    np.testing.assert_allclose(np.rad2deg(campaign.probings.readings["EL"]), [39.75, 50.5], atol=1e-13)


@pytest.mark.parametrize(
    ("cell", "unit", "size"),
    [
        ("-00:30:00", "deg", "-0.5"), ("+12:20:42,0", "deg", "12.345"), ("5 30", "deg", "5.5"),
        ("05h12m36.0s", "hours of angle", "5.21"), ("05d 12' 36\"", "deg", "5.21"), ("12°20′42″", "deg", "12.345"),
        ("05h12m36s", "deg", None), ("05d12m36s", "hours of angle", None), ("12:60:00", "deg", None),
        ("12:00:60", "deg", None), ("12.5:30", "deg", None), ("1234", "deg", None), ("", "deg", None),
    ],
)  # fmt: skip
def test_minutes_and_seconds_of_an_angle(cell: str, unit: str, size: str | None) -> None:
    number = sexagesimal(cell, unit)
    assert (None if number is None else float(number)) == (None if size is None else float(size))


def test_refraction_is_that_of_rays_traced_through_the_air() -> None:
    seen = np.deg2rad(list(map(float, TRACED)))
    traced = np.deg2rad(np.array(list(TRACED.values())) / 3600.0)
    count = np.ones(len(seen))
    np.testing.assert_allclose(refraction(seen + traced, 1005.0 * count, 7.0 * count), traced, rtol=2.5e-3)


def test_refraction_lifts_towards_the_zenith_in_either_frame(tmp_path: Path) -> None:
    """40 degrees from the zenith in the south: the elevation grows by 48.8 arcseconds, and so does the declination."""
    lift = np.deg2rad(48.82 / 3600.0)
    weather = 'pressure_hPa = 1005.0\ntemperature_degC = "T"\nrefraction = "not applied"\n'
    mount = "T [degC],mount az [deg],mount el [deg]"
    south = FROM_NORTH.replace('refraction = "applied"\n', weather)
    folder = log(tmp_path / "horizon", south, f"az [deg],el [deg],{mount}", "180,50,7,0,0", "90,90,7,0,0")
    campaign = read_campaign(folder)
    assert isinstance(campaign, Campaign)
    at, zenith = directions(campaign)
    assert np.arcsin(at[2]) - np.deg2rad(50.0) == pytest.approx(lift, rel=3e-3)
    np.testing.assert_allclose(zenith, [0.0, 0.0, 1.0], atol=1e-12)
    equator = 'hour_angle_deg = "ha"\ndeclination_deg = "dec"\nlatitude_deg = 40.0\n' + weather
    folder = log(tmp_path / "equator", equator, f"ha [h],dec [deg],{mount}", "0,0,7,0,0", "0,40,7,0,0")
    campaign = read_campaign(folder)
    assert isinstance(campaign, Campaign)
    at, zenith = directions(campaign)
    assert np.arcsin(at[2]) == pytest.approx(lift, rel=3e-3)
    np.testing.assert_allclose(zenith, [np.cos(np.deg2rad(40)), 0.0, np.sin(np.deg2rad(40))], atol=1e-12)


def test_the_answer_shows_what_was_understood(tmp_path: Path) -> None:
    header = "az [d:m:s],el [deg],mount az [deg],mount el [deg]"
    folder = log(tmp_path / "log", FROM_NORTH, header, "10:30:00,40,10.51,40.0", "20:00:00,50,20.0,50.1")
    (file,) = read_exports(folder / "mapping.toml", [folder / "night.csv"]).files
    columns = {column.column: column for column in file.columns}
    assert columns["azimuth_deg"].source == "column az in deg"
    assert (columns["azimuth_deg"].smallest, columns["azimuth_deg"].largest) == (10.5, 20.0)
    said = "azimuth from north through east and elevation, as the light is seen"
    assert [columns[f"direction_{axis}"].source for axis in "xyz"] == [said] * 3
    assert columns["az_deg"].source == "column mount az in deg"
    campaign = read_campaign(folder)
    assert isinstance(campaign, Campaign)
    assert sorted(campaign.probings.channels) == ["direction_x", "direction_y", "direction_z", "setup"]


ROW = "10:30:00,40,10.51,40.0"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("10:30:00", "10:61:00", "night.csv, line 2, column az (azimuth_deg): '10:61:00' has minutes or seconds t"),
        ("10:30:00", "10:30:60.00", "'10:30:60.00' has minutes or seconds that are not below 60; write 75.255 or 75"),
        ("10:30:00", "", "night.csv, line 2, column az (azimuth_deg): '' is no finite number; write 75.255 or 75:15:1"),
        ("10:30:00", "10h30m", "night.csv, line 2, column az (azimuth_deg): '10h30m' is no finite number"),
        (",40,", ",95.5,", "line 2, column el (elevation_deg): 95.5 lies beyond -90 to 90 deg; is it elevation_deg, a"),
        ("el [deg],mount", "el,mount", "nothing states the unit of column 'el' of night.csv; write elevation_deg = {"),
        ("el [deg],mount", "el [mm],mount", "column 'el' of night.csv is in mm, which is no angle; elevation_deg take"),
        ('"el"', '"elevation"', "night.csv has no column 'elevation'; "),
        ('azimuth_from = "north through east"\n', "", "azimuth_from: this key is missing; write for example azimuth_"),
        ("north through east", "north thru east", "is not known; did you mean 'north through east'? write one of"),
        ('refraction = "applied"\n', "", "refraction: this key is missing; write for example refraction = "),
        ('"applied"', '"none"', "'none' is not known; write \"applied\" where the angles say where the light is seen"),
        ('"applied"', '"not applied"', "pressure_hPa: this key is missing"),
        ('elevation_deg = "el"\n', "", "one of these keys is missing: elevation_deg, zenith_distance_deg"),
        ("elevation_deg", "declination_deg", "one of these keys is missing: elevation_deg, zenith_distance_deg"),
        ("azimuth_deg = ", 'hour_angle_deg = "el"\nazimuth_deg = ', "only one of these keys is right: azimuth_deg, ho"),
        ('el_deg = "mount el"', 'el_deg = "mount el"\ndirection_x = 1.0', "direction_x is computed from these angles"),
        ('reading = "direction"\nstandard_uncertainty_urad', 'reading = "point"\nstandard_uncertainty_um',
         'belong to a setup with reading = "direction"'),
        (
            'refraction = "applied"',
            'refraction = "not applied"\npressure_hPa = 30.1\ntemperature_degC = 5.0',
            "pressure_hPa: 30.1 lies beyond 400 to 1100 hPa",
        ),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_by_line_and_remedy(tmp_path: Path, old: str, new: str, said: str) -> None:
    header = "az [d:m:s],el [deg],mount az [deg],mount el [deg]"
    folder = log(tmp_path / "log", FROM_NORTH, header, ROW, "20:00:00,50,20.0,50.1")
    for file in folder.iterdir():
        text = file.read_text(encoding="utf-8")
        file.write_text(text.replace(old, new, 1), encoding="utf-8")
    assert said in refused(folder)


def test_refraction_is_not_made_up_near_the_horizon(tmp_path: Path) -> None:
    weather = 'pressure_hPa = 1005.0\ntemperature_degC = 7.0\nrefraction = "not applied"\n'
    direction = FROM_NORTH.replace('refraction = "applied"\n', weather)
    header = "az [deg],el [deg],mount az [deg],mount el [deg]"
    message = refused(log(tmp_path / "log", direction, header, "10,40,0,0", "20,9.5,0,0"))
    assert "night.csv, line 3, column el: lower than 10 degrees above the horizon" in message


def test_a_log_as_an_observatory_writes_it_shows_the_mount_that_was_simulated(tmp_path: Path) -> None:
    """Target: azimuth from south through west and zenith distance without refraction, mount in degrees, minutes and
    seconds; the identified mount is the one that was simulated, and that of the unit vectors of the same night."""
    errors = {"EA0AZ": 60e-6, "EB0AZ": -40e-6, "EA0EL": 80e-6}
    axes = (
        SimulatedAxis("AZ", "rotary", (0.0, 0.0, 1.0), sign=-1, errors=(0, 0, 0, 60e-6, -40e-6, 0)),
        SimulatedAxis("EL", "rotary", (0.0, 1.0, 0.0), sign=-1, errors=(0, 0, 0, 80e-6, 0, 0)),
    )
    chain = SimulatedChain(axes)
    rng = np.random.default_rng(5)
    lines = []
    for _ in range(60):
        azimuth, elevation = np.round(rng.uniform((0.0, 20.0), (360.0, 85.0)) * 36000.0) / 36000.0
        seen = chain.pose({"AZ": azimuth, "EL": elevation})[:3, :3] @ [1.0, 0.0, 0.0] + rng.normal(
            0.0, 5e-6, 3
        )
        seen /= np.linalg.norm(seen)
        zenith = np.arccos(seen[2])
        # Above the air the star is further from the zenith by what the traced rays say.
        above = np.rad2deg(zenith + refraction_by_hand(zenith))
        south = (np.rad2deg(np.arctan2(-seen[1], seen[0])) + 180.0) % 360.0
        lines.append(f"{written(south)};{above:.7f};{written(azimuth)};{written(elevation)}")
    direction = (
        'azimuth_deg = "A"\nazimuth_from = "south through west"\nzenith_distance_deg = "Z"\n'
        'refraction = "not applied"\npressure_hPa = 1005.0\ntemperature_degC = 7.0\n'
    )
    folder = log(tmp_path / "log", direction, "A [d:m:s];Z [deg];mount az [d:m:s];mount el [d:m:s]", *lines)
    campaign = read_campaign(folder)
    assert isinstance(campaign, Campaign)
    result = campaign_method(campaign).identify(campaign)
    (run,) = result.runs
    for name, hidden in errors.items():
        index = result.parameters.index(name)
        assert abs(run.estimate[index] - hidden) < 4.0 * np.sqrt(run.covariance[index, index])
    assert run.chi_square / run.degrees_of_freedom < 1.5


def test_an_azimuth_that_counts_the_other_way_is_named_by_its_key(tmp_path: Path) -> None:
    axes = (
        SimulatedAxis("AZ", "rotary", (0.0, 0.0, 1.0), sign=-1, errors=(0, 0, 0, 60e-6, -40e-6, 0)),
        SimulatedAxis("EL", "rotary", (0.0, 1.0, 0.0), sign=-1, errors=(0, 0, 0, 80e-6, 0, 0)),
    )
    chain, rng = SimulatedChain(axes), np.random.default_rng(7)
    lines = []
    for _ in range(40):
        azimuth, elevation = rng.uniform((0.0, 20.0), (360.0, 85.0))
        seen = chain.pose({"AZ": azimuth, "EL": elevation})[:3, :3] @ [1.0, 0.0, 0.0]
        seen += rng.normal(0.0, 5e-6, 3)
        seen /= np.linalg.norm(seen)
        north = np.rad2deg(np.arctan2(-seen[1], seen[0])) % 360.0
        lines.append(f"{north:.7f},{np.rad2deg(np.arcsin(seen[2])):.7f},{azimuth:.7f},{elevation:.7f}")
    header = "az [deg],el [deg],mount az [deg],mount el [deg]"
    right = read_campaign(log(tmp_path / "right", FROM_NORTH, header, *lines))
    mirrored = FROM_NORTH.replace("north through east", "north through west")
    wrong = read_campaign(log(tmp_path / "wrong", mirrored, header, *lines))
    assert isinstance(right, Campaign)
    assert isinstance(wrong, Campaign)
    method = campaign_method(right)
    ways = [mistake.what for mistake in find_mistakes(wrong, method.problem_of, None)]
    assert ways[0].startswith(
        "the directions were mirrored (`azimuth_from` of their mapping counts the other way"
    )
    # The signs of the axes and the complement of the azimuth are the same mirror, and nothing else is named.
    assert len(ways) == 4
    assert not any("direction_" in way for way in ways[1:])


def refraction_by_hand(zenith: float) -> float:
    """What the traced rays say at a zenith distance as seen, between the tabulated ones by a cubic in tan z."""
    seen = np.deg2rad(list(map(float, TRACED)))
    tangent = np.tan(seen)
    columns = np.column_stack([tangent, tangent**3])
    traced = np.deg2rad(np.array(list(TRACED.values())) / 3600.0)
    first, third = np.linalg.lstsq(columns[:10], traced[:10], rcond=None)[0]
    return float(first * np.tan(zenith) + third * np.tan(zenith) ** 3)


def written(degrees: float) -> str:
    """Degrees, minutes and seconds, to a hundredth of a second."""
    hundredths = round(abs(degrees) * 360000.0)
    seconds, hundredths = divmod(hundredths, 100)
    minutes, seconds = divmod(seconds, 60)
    whole, minutes = divmod(minutes, 60)
    return f"{'-' if degrees < 0 else ''}{whole:03}:{minutes:02}:{seconds:02}.{hundredths:02}"
