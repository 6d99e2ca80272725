"""A slip in one key of ``campaign.toml`` is one fault: nothing that is right is blamed for it."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from monitor.exceptions import CampaignError
from monitor.readers import read_campaign

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
#: A campaign of every method.
FOLDERS = (
    "cold-cold",
    "load-cell",
    "free-form-pocket",
    "r-test",
    "l-shape",
    "tilting-table",
    "tracked-robot",
)


def faults(folder: Path, pattern: str, written: str, tmp_path: Path) -> list[str]:
    """The faults of a copy whose ``campaign.toml`` has something else in the place of the first match."""
    copy = Path(shutil.copytree(folder, tmp_path / folder.name))
    toml = copy / "campaign.toml"
    text, count = re.subn(pattern, written, toml.read_text("utf-8"), count=1, flags=re.MULTILINE)
    assert count == 1
    toml.write_text(text, "utf-8")
    with pytest.raises(CampaignError, match="was refused") as refusal:
        read_campaign(copy)
    return [str(fault) for fault in refusal.value.faults]


@pytest.mark.parametrize("name", FOLDERS)
def test_a_misspelt_method_is_one_fault(name: str, tmp_path: Path) -> None:
    (fault,) = faults(EXAMPLES / name, r'^method = "(.*)."$', r'method = "\1"', tmp_path)
    method = read_campaign(EXAMPLES / name).method
    assert f"column method: method '{method[:-1]}' is not known; did you mean '{method}'?" in fault


@pytest.mark.parametrize("name", FOLDERS)
def test_a_method_that_is_like_none_is_one_fault(name: str, tmp_path: Path) -> None:
    """Columns that another method needs were missing or unknown."""
    (fault,) = faults(EXAMPLES / name, r'^method = ".*"$', 'method = "volumetric"', tmp_path)
    assert "method 'volumetric' is not known; the methods are free-form" in fault


@pytest.mark.parametrize("name", FOLDERS)
def test_a_decimal_comma_in_toml_is_one_fault(name: str, tmp_path: Path) -> None:
    (fault,) = faults(EXAMPLES / name, r"^format = 1$", "format = 1,5", tmp_path)
    assert fault.startswith("campaign.toml, line ")
    assert fault.endswith(": 1,5 has a decimal comma, and TOML has decimal points: write 1.5")


def test_faults_that_every_method_has_are_said_beside_an_unknown_one(tmp_path: Path) -> None:
    copy = Path(shutil.copytree(EXAMPLES / "cold-cold", tmp_path / "copy"))
    for file, old, new in (
        ("campaign.toml", '"samba"', '"volumetric"'),
        ("probings.csv", "sequence", "order"),
        ("runs.csv", "started_at", "started"),
    ):
        text = (copy / file).read_text("utf-8")
        (copy / file).write_text(text.replace(old, new, 1), "utf-8")
    with pytest.raises(CampaignError, match="3 faults") as refusal:
        read_campaign(copy)
    assert [(fault.file, fault.column) for fault in refusal.value.faults] == [
        ("campaign.toml", "method"), ("runs.csv", "started_at"), ("probings.csv", "sequence"),
    ]  # fmt: skip
