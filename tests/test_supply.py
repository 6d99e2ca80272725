"""What the project brings along: every pin has the hashes of its files, every package a licence that is listed."""

from __future__ import annotations

import re
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

CHECKOUT = Path(__file__).resolve().parents[1]
#: Extras for developers: what they bring is not passed on.
DEVELOPERS = {"dev", "release", "fuzz", "challenge", "manual"}
#: What a user may install besides: every other extra.
EXTRAS = (
    "",
    *sorted(set(metadata.metadata("machine-health-monitor").get_all("Provides-Extra") or ()) - DEVELOPERS),
)

pytestmark = pytest.mark.skipif(not (CHECKOUT / "constraints.txt").is_file(), reason="files of a checkout")


def pins(path: Path) -> dict[str, str]:
    """Package: version, of the lines ``name==version`` with or without a marker and hashes."""
    lines = re.findall(r"^([A-Za-z0-9._-]+)==([^\s;\\]+)", path.read_text("utf-8"), flags=re.M)
    return {canonicalize_name(name): version for name, version in lines}


def closure(names: set[str]) -> set[str]:
    """All packages that these need here, themselves included; of the project with the extras of users."""
    reached: set[str] = set()
    left = set(names)
    while left:
        name = left.pop()
        reached.add(name)
        extras = EXTRAS if name == "machine-health-monitor" else ("",)
        for line in metadata.requires(name) or ():
            need = Requirement(line)
            if any(need.marker is None or need.marker.evaluate({"extra": extra}) for extra in extras):
                left |= {canonicalize_name(need.name)} - reached
    return reached


def test_the_set_up_compares_every_file_with_a_hash_and_installs_the_pinned_versions() -> None:
    hashed = pins(CHECKOUT / "tests" / "setup" / "hashes.txt")
    pinned = pins(CHECKOUT / "constraints.txt")
    assert len(hashed) > 80
    assert {name for name, version in hashed.items() if pinned.get(name, version) != version} == set()
    entries = re.split(r"\n(?=\S)", (CHECKOUT / "tests" / "setup" / "hashes.txt").read_text("utf-8").strip())
    assert [entry.split("==")[0] for entry in entries if not re.search(r"sha256:[0-9a-f]{64}", entry)] == []
    needed = {
        canonicalize_name(Requirement(line).name)
        for line in metadata.requires("machine-health-monitor") or ()
        if re.search(r"extra == ['\"](dev|sign|token|web|cluster)['\"]|^[^;]*$", line)
    }
    assert needed <= set(hashed), "type: make supply"


def test_the_bill_of_materials_is_that_of_every_extra_that_a_user_may_install() -> None:
    listed = re.findall(
        r'^EXTRAS = "([a-z,]+)"', (CHECKOUT / "tests/setup/supply.py").read_text("utf-8"), flags=re.M
    )
    assert sorted(listed[0].split(",")) == list(EXTRAS[1:])


def test_every_package_that_comes_along_has_its_licence_listed() -> None:
    rows = re.findall(
        r"^\| ([A-Za-z0-9._-]+) \| (.+) \|$",
        (CHECKOUT / "docs" / "licences.md").read_text("utf-8"),
        flags=re.M,
    )
    listed = {canonicalize_name(name) for name, licence in rows if licence.strip() not in ("", "UNKNOWN")}
    assert closure({"machine-health-monitor"}) - {"machine-health-monitor"} <= listed, "type: make supply"
