"""The pages of certificates looked at as pictures: nothing clipped, nothing off the page, no text over other text.

Poppler draws every page and says where each word stands. The last tests break a page on purpose: a look that could not
fail would be none.
"""

from __future__ import annotations

import dataclasses
import html
import re
import shutil
import subprocess
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from monitor.records import Array
from monitor.reporting.certificate.record import CertificateRecord, Person, Replaced
from monitor.reporting.pdf.render import certificate_html, certificate_pdf, pdf_of

pytestmark = pytest.mark.skipif(
    shutil.which("pdftoppm") is None or shutil.which("pdftotext") is None,
    reason="poppler (Debian: poppler-utils) draws the pages",
)

Make = Callable[..., CertificateRecord]
DPI = 80
#: A4 and the margins of the style sheet, in mm; header and footer stand in the upper and lower ones.
WIDTH, HEIGHT, SIDE, EDGE = 210.0, 297.0, 17.0, 6.0
SIXTY = "Präzisionswerkzeugmaschinenbau-Beteiligungsgesellschaft mbH & Co"
CJK_FONT = Path("/usr/share/fonts/opentype/noto/NotoSansCJK-Regular.ttc")
MOMENT = datetime(2026, 3, 3, tzinfo=UTC)


@dataclasses.dataclass(frozen=True)
class Word:
    """A word and where it stands, mm from the page's upper left corner."""

    text: str
    left: float
    top: float
    right: float
    bottom: float

    def shares(self, other: Word) -> float:
        """The part of the smaller of two words that the other one covers."""
        wide = min(self.right, other.right) - max(self.left, other.left)
        high = min(self.bottom, other.bottom) - max(self.top, other.top)
        smaller = min((one.right - one.left) * (one.bottom - one.top) for one in (self, other))
        return wide * high / smaller if wide > 0.0 and high > 0.0 and smaller > 0.0 else 0.0


def words_of(pdf: Path) -> list[list[Word]]:
    """Every word of every page."""
    told = subprocess.run(
        ["pdftotext", "-bbox", str(pdf), "-"], check=True, capture_output=True, text=True
    ).stdout
    pages = []
    for page in told.split("<page ")[1:]:
        boxes = re.findall(
            r'<word xMin="([\d.-]+)" yMin="([\d.-]+)" xMax="([\d.-]+)" yMax="([\d.-]+)">(.*?)</word>', page
        )
        pages.append(
            [Word(html.unescape(text), *(float(one) * 25.4 / 72 for one in box)) for *box, text in boxes]
        )
    return pages


def pictures_of(pdf: Path) -> list[Array]:
    """Every page as an array of greys, 1 white."""
    subprocess.run(
        ["pdftoppm", "-r", str(DPI), "-png", "-gray", str(pdf), str(pdf.with_suffix(""))], check=True
    )
    return [matplotlib.image.imread(one) for one in sorted(pdf.parent.glob(f"{pdf.stem}-*.png"))]


def faults_of(pdf: bytes, folder: Path) -> list[str]:
    """What a careful reader would find wrong with the look of the pages."""
    place = folder / "pages.pdf"
    place.write_bytes(pdf)
    faults = []
    for number, (words, picture) in enumerate(zip(words_of(place), pictures_of(place), strict=True), start=1):
        assert len(words) > 20, f"page {number} is nearly empty"
        ink = picture < 0.85

        def part(left: float, top: float, right: float, bottom: float, ink: Array = ink) -> Array:
            rows = slice(max(0, round(top / 25.4 * DPI)), round(bottom / 25.4 * DPI) + 1)
            return ink[rows, max(0, round(left / 25.4 * DPI)) : round(right / 25.4 * DPI) + 1]

        for name, box in {
            "left": (0.0, 0.0, SIDE - 1, HEIGHT), "right": (WIDTH - SIDE + 1, 0.0, WIDTH, HEIGHT),
            "upper": (0.0, 0.0, WIDTH, EDGE), "lower": (0.0, HEIGHT - EDGE, WIDTH, HEIGHT),
        }.items():  # fmt: skip
            if part(*box).any():
                faults.append(f"page {number}: ink in the {name} margin")
        for word in words:
            if (
                word.left < SIDE - 0.5
                or word.right > WIDTH - SIDE + 0.5
                or word.bottom > HEIGHT
                or word.top < 0
            ):
                faults.append(f"page {number}: '{word.text}' is off the page's text area")
            elif re.search(r"\w", word.text) and word.right - word.left > 1.5:  # not a subscript
                # All of a word's length shows ink: what is clipped has none where its letters should be. One that reads
                # upwards ends at its top.
                high, wide = word.bottom - word.top, word.right - word.left
                turned = high > 1.5 * wide if len(word.text) > 1 else wide > 1.4 * high
                shown = part(word.left, word.top, word.right, word.bottom).any(axis=1 if turned else 0)
                along = shown[::-1] if turned else shown
                if along.mean() < 0.5 or not along[-max(3, len(along) // 4) :].any():
                    faults.append(f"page {number}: '{word.text}' is not to be seen")
        for at, word in enumerate(words):
            for other in words[at + 1 :]:
                if word.shares(other) > 0.3:
                    faults.append(f"page {number}: '{word.text}' stands on '{other.text}'")
    return faults


def crowded(record: CertificateRecord) -> CertificateRecord:
    """Long names, three alphabets, three who sign, a replaced certificate with a long reason."""
    assert record.customer is not None
    assert len(SIXTY) >= 60
    return dataclasses.replace(
        record,
        number="K-2026-0042-" + "9" * 30,
        customer=dataclasses.replace(
            record.customer, name=SIXTY, address=("Οδός Παραδείγματος 1", "ул. Примерная, 2", "Łódź ąęß ñ Ű")
        ),
        place="W" * 90,
        authorised_by=tuple(Person(f"{SIXTY} {place}", "head of laboratory") for place in range(3)),
        replaces=Replaced(
            "K-2026-0041", record.issued_on, "the address of the customer was wrong " * 4, "0" * 64
        ),
    )


def test_usual_certificate_looks_right(make_record: Make, tmp_path: Path) -> None:
    assert faults_of(certificate_pdf(make_record()), tmp_path) == []


@pytest.mark.parametrize("language", [pytest.param("en", marks=pytest.mark.slow), "de"])
def test_thirty_parameters_long_names_three_alphabets_and_a_map_look_right(
    make_record: Make, tmp_path: Path, language: str
) -> None:
    record = crowded(make_record(30, language=language, maps=1))
    pdf = certificate_pdf(record)
    assert faults_of(pdf, tmp_path) == []
    place = tmp_path / "pages.pdf"
    text = subprocess.run(
        ["pdftotext", "-layout", str(place), "-"], check=True, capture_output=True, text=True
    ).stdout
    joined = "".join(text.split())
    for part in (SIXTY, "Οδός Παραδείγματος 1", "ул. Примерная, 2", "Łódź ąęß ñ Ű"):
        assert "".join(part.split()) in joined


@pytest.mark.skipif(not CJK_FONT.is_file(), reason=f"no {CJK_FONT} (Debian: fonts-noto-cjk)")
def test_chinese_and_japanese_letters_are_drawn_with_a_font_that_is_given(
    make_record: Make, tmp_path: Path
) -> None:
    record = make_record()
    assert record.customer is not None
    name = "三井精機工業株式会社 精密测量"
    pdf = certificate_pdf(
        dataclasses.replace(record, customer=dataclasses.replace(record.customer, name=name)), [CJK_FONT]
    )
    assert faults_of(pdf, tmp_path) == []
    joined = "".join(word.text for page in words_of(tmp_path / "pages.pdf") for word in page)
    assert name.replace(" ", "") in joined


@pytest.mark.parametrize(
    ("style", "fault"),
    [
        (".results { width: 230mm; }", "is off the page's text area"),
        pytest.param(".results { width: 230mm; }", "ink in the right margin", marks=pytest.mark.slow),
        pytest.param(
            "dl > div { height: 1.2mm; overflow: hidden; }", "is not to be seen", marks=pytest.mark.slow
        ),
        pytest.param(
            "h1 { white-space: nowrap; overflow: hidden; width: 55mm; }",
            "'certificate' is not to be seen",
            marks=pytest.mark.slow,
        ),
        ("h2 { color: white; }", "is not to be seen"),
        (".statements dd { margin-left: -45mm; }", "stands on"),
    ],
)
def test_the_look_finds_what_is_broken_on_purpose(
    make_record: Make, tmp_path: Path, style: str, fault: str
) -> None:
    page = certificate_html(make_record()).replace("</style>", f"{style}</style>", 1)
    faults = faults_of(pdf_of(page, identifier="x", moment=MOMENT), tmp_path)
    assert any(fault in one for one in faults), faults


def test_figures_keep_their_order_on_a_grey_printer(make_record: Make, tmp_path: Path) -> None:
    """What carries meaning on the map is drawn without colour, and in at least four greys apart."""
    place = tmp_path / "map.pdf"
    place.write_bytes(certificate_pdf(make_record(13, maps=1)))
    subprocess.run(["pdftoppm", "-r", "60", "-png", str(place), str(tmp_path / "colour")], check=True)
    pages = [matplotlib.image.imread(one) for one in sorted(tmp_path.glob("colour-*.png"))]
    texts = [" ".join(word.text for word in page) for page in words_of(place)]
    (number,) = [at for at, text in enumerate(texts) if "Volumetric error, as found" in text]
    words = words_of(place)[number]
    top = next(word.bottom for word in words if word.text == "Volumetric")
    bottom = next(word.top for word in words if word.text == "Statements")
    rows = slice(round((top + 3) / 25.4 * 60), round((bottom - 3) / 25.4 * 60))
    region = pages[number][rows]
    assert float(np.max(np.abs(region[..., 0] - region[..., 2]))) < 0.12  # the ink's own tint
    share = np.histogram(region[..., 0], bins=np.linspace(0.55, 0.99, 12))[0] / region[..., 0].size
    assert np.count_nonzero(share > 0.002) >= 4
