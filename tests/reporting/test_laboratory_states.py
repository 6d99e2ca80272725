"""What a laboratory may state besides: accreditation, mark, standards, temperatures; never what a sample says."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from dataclasses import replace
from datetime import date
from pathlib import Path

import pytest
from PIL import Image

from monitor.exceptions import InputError
from monitor.reporting.certificate.completeness import date_faults, missing_items
from monitor.reporting.certificate.laboratory import read_laboratory
from monitor.reporting.certificate.record import Accreditation, CertificateRecord, NotApplicable, Standard
from monitor.reporting.certificate.samples import TEXTS

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
STANDARD = """
[[standards]]
name = "scale bar"
identification = "SB-17"
certificate = "D-K-1234 2026-01"
issuer = "a national institute"
issued_on = 2026-01-15
valid_until = 2028-01-15
"""
TEMPERATURE = """
[temperature]
machine_degC = 21.2
machine_U_degC = 0.3
standard_degC = 21.0
standard_U_degC = 0.1
reference = "results refer to 20 °C"
"""


@pytest.fixture
def complete(make_record: Callable[..., CertificateRecord]) -> CertificateRecord:
    return make_record(2)


def written(folder: Path, text: str) -> Path:
    path = folder / "laboratory.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_accreditation_standards_and_temperatures_are_read(tmp_path: Path) -> None:
    file = read_laboratory(
        written(tmp_path, '[accreditation]\nbody = "a body"\nnumber = "D-K-1"\n' + STANDARD + TEMPERATURE)
    )
    assert file.accredited == Accreditation("a body", "D-K-1")
    assert file.standards == (
        Standard(
            "scale bar",
            "SB-17",
            "D-K-1234 2026-01",
            "a national institute",
            date(2026, 1, 15),
            date(2028, 1, 15),
        ),
    )
    assert file.temperature["machine_U_degC"] == 0.3


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ('[temperature]\nmachine_degC = 21.0\n', r"\[temperature\] has machine_U_degC missing"),
        (TEMPERATURE.replace("21.2", "294.3"), r"temperature.machine_degC is a temperature in °C between -50 and 100"),
        (TEMPERATURE.replace("0.1", "-0.1"), r"standard_U_degC is an expanded uncertainty \(k = 2\) in °C above 0"),
        (STANDARD.replace("2026-01-15", '"15.1.2026"', 1), r"standards.issued_on is a date without quotes"),
        ("[standards]\nname = 'bar'\n", r"standards is a list of standards: begin each with \[\[standards\]\]"),
        ('[laboratory]\nmark = "mark.svg"\n', r"laboratory.mark is a picture \(.png, .jpg, .jpeg\), but is 'mark.svg'"),
        ('[laboratory]\nmark = "mark.png"\n', r"laboratory.mark: .*mark.png cannot be read"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(tmp_path: Path, text: str, fault: str) -> None:
    with pytest.raises(InputError, match=fault):
        read_laboratory(written(tmp_path, text))


def test_a_mark_is_a_picture_of_its_kind(tmp_path: Path) -> None:
    picture = io.BytesIO()
    Image.new("RGB", (40, 20), "navy").save(picture, "PNG")
    path = written(tmp_path, '[laboratory]\nmark = "mark.png"\n')
    (tmp_path / "mark.png").write_bytes(picture.getvalue())
    assert read_laboratory(path).mark.startswith("data:image/png;base64,iVBOR")
    for wrong in (b"", b"GIF89a", picture.getvalue() + bytes(600_000)):
        (tmp_path / "mark.png").write_bytes(wrong)
        with pytest.raises(InputError, match="is no png picture of at most 512 kB"):
            read_laboratory(path)


@pytest.mark.parametrize("name", ["laboratory.toml", "laboratory-de.toml"])
def test_no_text_of_a_sample_passes_into_a_laboratorys_own_certificate(tmp_path: Path, name: str) -> None:
    sample = (EXAMPLES / name).read_text(encoding="utf-8")
    own = re.sub(r'^name = ".*?"', 'name = "Steel & Sons Metrology"', sample, count=1, flags=re.M)
    with pytest.raises(InputError, match="is still that of the sample file") as refusal:
        read_laboratory(written(tmp_path, own))
    faults = str(refusal.value)
    # Every text that only a sample has is named; the file itself is the list.
    assert (
        faults.count("is still that of the sample file") == len(TEXTS) - 1 + 2
    )  # two lines in both addresses
    for key in TEXTS:
        assert (f"{key} is still" in faults) == (key != "laboratory.name")
    read_laboratory(EXAMPLES / name)  # the demonstration says everywhere that it is one


def test_a_standard_that_is_out_of_date_refuses_the_certificate(complete: CertificateRecord) -> None:
    standard = Standard("bar", "1", "C-1", "an institute", date(2020, 1, 1), date(2099, 1, 1))
    first, last = complete.performed_on
    assert not date_faults(replace(complete, standards=(standard,)))
    assert not date_faults(
        replace(complete, standards=(replace(standard, valid_until=NotApplicable("no end")),))
    )
    for wrong, words in (
        (
            {"valid_until": date(2021, 1, 1)},
            f"was valid until 2021-01-01, which is before the calibration of {last}",
        ),
        ({"issued_on": date(2098, 1, 1)}, f"was issued on 2098-01-01, after the calibration of {first}"),
    ):
        (fault,) = date_faults(replace(complete, standards=(replace(standard, **wrong),)))
        assert words in fault


def test_what_is_stated_is_stated_whole(complete: CertificateRecord) -> None:
    missing = missing_items(replace(complete, accredited=Accreditation("a body", "tbd")))
    assert [str(item) for item in missing] == [
        "accreditation, number: 'tbd' says nothing: write [accreditation] number (ISO/IEC 17025:2017, 8.1 and ILAC P8)"
    ]
    assert not missing_items(complete)
