"""``[[sources]]``: every key read, every slip refused with its line and what would be right, written and read alike."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from monitor.exceptions import CampaignError, InputError
from monitor.readers import read_campaign, read_sources_file, write_campaign
from monitor.sources import QUANTITIES, Law, Quantity, Sharing, Source

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"

SOUND = """
[[sources]]
name = "temperature of the bar"
quantity = "standard_temperature"
half_width_K = 1.0
distribution = "rectangular"
shared_by = "a day"
expansion_coefficient_per_K = 11.5e-6
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    shutil.copytree(EXAMPLES / "cold-cold", tmp_path / "campaign")
    return tmp_path / "campaign"


def with_sources(folder: Path, text: str) -> Path:
    file = folder / "campaign.toml"
    file.write_text(file.read_text() + text)
    return folder


def test_a_source_is_read_in_internal_units(folder):
    (source,) = read_campaign(with_sources(folder, SOUND)).sources
    assert source == Source(
        name="temperature of the bar", quantity=Quantity.STANDARD_TEMPERATURE, size=1.0, law=Law.RECTANGULAR,
        shared_by=Sharing.DAY, expansion_coefficient=11.5e-6,
    )  # fmt: skip
    assert source.u == pytest.approx(1.0 / 3.0**0.5)


def test_a_campaign_without_sources_is_read_as_before(folder):
    assert read_campaign(folder).sources == ()


SLIPS = {
    'quantity = "standard_temprature"': "did you mean 'standard_temperature'",
    'quantity = "bar_length"': "has its line from .artefact.scale_bar. standard_uncertainty_mm",
    'quantity = "probe"': "has its line from .probe. standard_uncertainty_um",
    'distribution = "uniform"': "write one of normal, rectangular, triangular, arcsine, t",
    'shared_by = "runs"': "write one of all runs, a day, a run, a probing",
    'shared_by = "a probing"': "has one value in a run",
    "half_width_um = 1.0": "with distribution rectangular is half_width_K",
    "standard_uncertainty_K = 1.0": "with distribution rectangular is half_width_K",
    "half_width_K = -1.0": "must be greater than 0",
    "half_width_K = 1000.0": "is its unit K",
    "degrees_of_freedom = 8": "limits that are taken as known",
    "expansion_coefficient = 1e-5": "this key is not known",
    "axis = \"X\"": "this key is not known",
    "name = \"temperature of the bar \"": "begins or ends with a space",
}  # fmt: skip


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_is_refused_with_its_line_and_what_would_be_right(folder, slip):
    key = slip.partition(" =")[0]
    lines = [line for line in SOUND.splitlines() if line.partition(" =")[0] != key and not (
        key.startswith(("half", "standard_u")) and line.startswith("half_width"))]  # fmt: skip
    before = len((folder / "campaign.toml").read_text().splitlines())
    with pytest.raises(CampaignError, match=SLIPS[slip]) as refused:
        read_campaign(with_sources(folder, "\n".join([*lines, slip]) + "\n"))
    (fault,) = [fault for fault in refused.value.faults if fault.line is not None]
    assert fault.file == "campaign.toml"
    assert fault.line > before
    assert fault.column.startswith("sources[1].")


def test_what_a_quantity_needs_is_asked_for(folder):
    text = '\n[[sources]]\nname = "a"\nquantity = "rotary_readout"\nstandard_uncertainty_urad = 2.0\naxis = "X"\n'
    with pytest.raises(CampaignError, match="none of the machine's axes that turn: C, B, C1"):
        read_campaign(with_sources(folder, text))


def test_an_effect_that_turns_is_stated_as_an_angle(tmp_path):
    file = tmp_path / "sources.toml"
    file.write_text(
        '[[sources]]\nname = "a"\nquantity = "effect"\neffect = "EAX:poly1"\nstandard_uncertainty_um = 2.0\n'
    )
    with pytest.raises(InputError, match="is stated in µrad; end the key in _urad"):
        read_sources_file(file)


def test_two_sources_of_one_name_and_a_file_without_any_are_refused(folder, tmp_path):
    with pytest.raises(CampaignError, match="is listed twice"):
        read_campaign(with_sources(folder, SOUND + SOUND))
    (tmp_path / "none.toml").write_text("# nothing yet\n")
    with pytest.raises(InputError, match="the file has no source"):
        read_sources_file(tmp_path / "none.toml")
    (tmp_path / "t.toml").write_text(
        SOUND.replace('"rectangular"', '"t"').replace("half_width", "standard_uncertainty")
    )
    with pytest.raises(InputError, match="more than 2 of them"):
        read_sources_file(tmp_path / "t.toml")


def every_quantity() -> tuple[Source, ...]:
    keys = {
        "axis": {"axis": "C"},
        "node_spacing_mm": {"node_spacing": (20.0, 50.0)},
        "effect": {"effect": "EYX:poly2"},
        "expansion_coefficient_per_K": {"expansion_coefficient": 1.15e-5},
        "temperature_offset_K": {"temperature_offset": 1.5},
        "along": {"along": "Z"},
    }
    sources = []
    for number, (quantity, rule) in enumerate(QUANTITIES.items()):
        source = Source(
            name=f"source {number}", quantity=quantity, size=1.7e-6 if "per_K" in rule.suffixes else 0.0017
        )
        for key in (*rule.required, *rule.optional):
            source = replace(source, **keys[key])
        if quantity.value.startswith("linear_"):
            source = replace(source, axis="X", law=Law.ARCSINE)
        sources.append(source)
    sources[0] = replace(sources[0], law=Law.STUDENT, degrees_of_freedom=9.5, shared_by=Sharing.RUN)
    return tuple(sources)


def test_every_quantity_is_written_and_read_to_the_last_bit(folder, tmp_path):
    campaign = replace(read_campaign(folder), sources=every_quantity())
    assert read_campaign(write_campaign(campaign, tmp_path / "written")).sources == campaign.sources
