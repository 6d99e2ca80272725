"""The certificate on paper: two pages, all that it must say, our own fonts, the same bytes, nothing clipped."""

from __future__ import annotations

import dataclasses
import gc
import io
import json
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import pypdf
import pytest
from jinja2 import UndefinedError

from monitor.documents import to_document
from monitor.exceptions import InputError
from monitor.reporting.certificate.record import CertificateRecord, MeasuredCondition, Person
from monitor.reporting.numbers import written_correlation
from monitor.reporting.pdf.render import UnprintableError, certificate_html, certificate_pdf, html_of, pdf_of
from monitor.reporting.refused import RefusedParameters
from monitor.reporting.resources import FONT_FILES, report_folder

Make = Callable[..., CertificateRecord]
#: A4 and the side margins of the style sheet, in points.
WIDTH, HEIGHT, MARGIN, EDGE = (length / 25.4 * 72 for length in (210, 297, 17, 6))
LONG_NAME = "Precision Engineering and Calibration Services of Nowhere Ltd"


@pytest.fixture(scope="module")
def usual(make_record: Make) -> bytes:
    return certificate_pdf(make_record())


def pages_of(pdf: bytes) -> list[str]:
    return [" ".join(page.extract_text().split()) for page in pypdf.PdfReader(io.BytesIO(pdf)).pages]


def spans_of(pdf: bytes) -> list[tuple[float, float, float, float, str]]:
    """Left, right, upper and lower end of every word, as poppler places it; pypdf does not follow drawings."""
    if shutil.which("pdftotext") is None:
        pytest.skip("poppler (Debian: poppler-utils) says where words stand")
    told = subprocess.run(["pdftotext", "-bbox", "-", "-"], input=pdf, check=True, capture_output=True).stdout
    return [
        (float(left), float(right), float(top), float(bottom), word)
        for left, top, right, bottom, word in re.findall(
            r'<word xMin="([-0-9.]+)" yMin="([-0-9.]+)" xMax="([-0-9.]+)" yMax="([-0-9.]+)">(.*?)</word>',
            told.decode("utf-8"),
        )
    ]


def assert_inside_the_margins(pdf: bytes) -> None:
    spans = spans_of(pdf)
    assert len(spans) > 100
    outside = [
        span
        for span in spans
        if span[0] < MARGIN - 1
        or span[1] > WIDTH - MARGIN + 1
        or not EDGE < span[2] < span[3] < HEIGHT - EDGE
    ]
    assert outside == []


def test_17025_7_8_2_1_d_two_pages_each_with_number_and_count_and_a_clear_end(usual: bytes) -> None:
    pages = pages_of(usual)
    assert len(pages) == 2
    for count, page in enumerate(pages, start=1):
        assert "Certificate K-2026-0042" in page
        assert f"Page {count} of 2" in page
        assert "Not to be reproduced except in full." in page
    assert pages[1].count("End of certificate K-2026-0042") == 1
    assert "End of certificate" not in pages[0]


def test_17025_every_text_of_the_record_is_printed(usual: bytes, make_record: Make) -> None:
    # Lines are broken anywhere, so the texts are compared without spaces.
    whole = "".join("".join(pages_of(usual)).split())

    def texts(value: object) -> list[str]:
        if isinstance(value, str):
            return [value]
        if isinstance(value, tuple):
            return [text for part in value for text in texts(part)]
        if isinstance(value, MeasuredCondition):
            return []  # for the digital certificate: the page has it in words
        if dataclasses.is_dataclass(value):
            return [text for place in dataclasses.fields(value) for text in texts(getattr(value, place.name))]
        return []

    printed = [field for field in dataclasses.fields(CertificateRecord) if field.name != "results"]
    every = [text for field in printed for text in texts(getattr(make_record(), field.name))]
    assert len(every) > 40
    absent = [text for text in every if "".join((text[:1].upper() + text[1:]).split()) not in whole]
    absent = [text for text in absent if "".join(text.split()) not in whole]
    assert absent == []


def test_jcgm_102_6_5_factors_stand_with_their_region_probability_and_number_of_outputs(usual: bytes) -> None:
    page = pages_of(usual)[0].replace("k q", "kq").replace("k p", "kp")
    assert "kq = 2.95 of the hyper-rectangle: the 13 intervals" in page
    assert "coverage probability of at least 95 %" in page
    assert "kp = 4.73 (13 dimensions)" in page
    assert "GUM uncertainty framework (JCGM 102:2011, clause 6)" in page


def test_every_row_has_the_rounded_numbers_of_the_result(usual: bytes, make_record: Make) -> None:
    record = make_record()
    assert record.results is not None
    result = record.results[0]
    page = pages_of(usual)[0]
    # EX0C: u = 0.28 µm, U = 2.95 * 0.28 = 0.826 µm, so the estimate has two decimals.
    place = result.names.index("EX0C")
    estimate = f"{result.estimate[place]:.2f}".replace("-", "−")
    assert f"EX0C position in X of axis C {estimate} 0.28 0.83 µm" in page
    assert page.count(" µrad") == 7
    assert page.count(" µm/m") == 3


def test_full_correlation_matrix_is_printed(usual: bytes, make_record: Make) -> None:
    record = make_record()
    assert record.results is not None
    matrix = record.results[0].correlation
    page = pages_of(usual)[1]
    for row in range(13):
        name = record.results[0].names[row]
        numbers = " ".join(written_correlation(float(matrix[row, column])) for column in range(row + 1))
        assert f"{name} {numbers}" in page


def test_refused_parameters_are_named_without_numbers(make_record: Make) -> None:
    refusal = RefusedParameters(("EX0C1", "EY0C1"), "C1 stands at one angle throughout")
    pages = pages_of(certificate_pdf(make_record(refused=(refusal,))))
    assert len(pages) == 2
    assert "No result for EX0C1, EY0C1: C1 stands at one angle throughout." in pages[0]
    assert "position in X of spindle C1" not in pages[0]
    assert "the 11 intervals" in pages[0]
    assert "EX0C1" not in pages[1]


@pytest.mark.slow
def test_the_same_record_gives_the_same_bytes_in_another_process(
    usual: bytes, make_record: Make, tmp_path: Path
) -> None:
    # Hash seeds differ between processes: whatever depends on the order of a set would show.
    stored = tmp_path / "record.json"
    stored.write_text(json.dumps(to_document(make_record())), encoding="utf-8")
    script = tmp_path / "again.py"
    script.write_text(
        "import json, sys\n"
        "from monitor.reporting.certificate.record import CertificateRecord\n"
        "from monitor.documents import from_document\n"
        "from monitor.reporting.pdf.render import certificate_pdf\n"
        "record = from_document(CertificateRecord, json.load(open(sys.argv[1], encoding='utf-8')))\n"
        "open(sys.argv[2], 'wb').write(certificate_pdf(record))\n",
        encoding="utf-8",
    )
    for seed in ("1", "2"):
        out = tmp_path / f"{seed}.pdf"
        subprocess.run(
            [sys.executable, str(script), str(stored), str(out)],
            check=True,
            env={"PATH": "/usr/bin:/bin", "PYTHONHASHSEED": seed, "PYTHONPATH": ":".join(sys.path)},
        )
        assert out.read_bytes() == usual


def test_usual_certificate_stays_inside_its_margins(usual: bytes) -> None:
    assert_inside_the_margins(usual)


@pytest.mark.slow
def test_thirty_parameters_and_long_names_in_three_alphabets_are_not_clipped(make_record: Make) -> None:
    record = make_record(30)
    assert record.customer is not None
    assert len(LONG_NAME) >= 60
    crowded = dataclasses.replace(
        record,
        number="K-2026-0042-" + "9" * 30,
        customer=dataclasses.replace(
            record.customer,
            name=LONG_NAME,
            address=("Οδός Παραδείγματος 1", "ул. Примерная, 2", "Łódź ąęß ñ Ű"),
        ),
        place="W" * 90,
        authorised_by=tuple(Person(f"{LONG_NAME} {place}", "head of laboratory") for place in range(3)),
    )
    pdf = certificate_pdf(crowded)
    assert_inside_the_margins(pdf)
    whole = " ".join(pages_of(pdf))
    for text in ("Οδός Παραδείγματος 1", "ул. Примерная, 2", "Łódź ąęß ñ Ű", "the 30 intervals"):
        assert text in whole
    joined = "".join(whole.split())
    for name in record.results[0].names if record.results else ():
        assert joined.count(name) >= 2  # in the table of results and beside the correlation matrix


def test_forty_parameters_run_over_as_many_pages_as_they_need(make_record: Make) -> None:
    pdf = certificate_pdf(make_record(40))
    assert_inside_the_margins(pdf)
    assert "End of certificate K-2026-0042" in pages_of(pdf)[-1]


def test_letters_that_no_font_has_are_refused_and_not_replaced(make_record: Make) -> None:
    record = make_record()
    assert record.customer is not None
    foreign = dataclasses.replace(record, customer=dataclasses.replace(record.customer, name="三井精機"))
    with pytest.raises(UnprintableError, match=r"lack 4 of its letters: 三 \(U\+4E09\).*give a font file"):
        certificate_pdf(foreign)


def test_text_of_the_user_is_never_markup(make_record: Make) -> None:
    record = make_record()
    assert record.customer is not None
    sly = dataclasses.replace(
        record,
        number='1" onload="x',
        customer=dataclasses.replace(record.customer, name="<img src=x> & {{ 1 }}"),
    )
    html = certificate_html(sly)
    assert "&lt;img src=x&gt; &amp; {{ 1 }}" in html
    assert 'onload="x' not in html


def test_no_temporary_file_is_left_to_the_garbage_collector(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A verb ends without collecting: each certificate left its fonts, 1.5 MB, in the temporary folder."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    face = f"@font-face {{ font-family: Our; src: url(font:{FONT_FILES[0][2]}) }}"
    page = f"<html><style>{face}</style><body style='font-family: Our'>text</body></html>"
    was_collecting = gc.isenabled()
    gc.disable()
    try:
        assert pdf_of(page, identifier="x", moment=datetime(2026, 1, 1, tzinfo=UTC)).startswith(b"%PDF")
        assert list(tmp_path.iterdir()) == []
    finally:
        if was_collecting:
            gc.enable()


def test_nothing_is_fetched_from_disk_or_network() -> None:
    for address in ("file:///etc/hostname", "http://127.0.0.1:9/x.png"):
        with pytest.raises(InputError, match="a report may not fetch"):
            pdf_of(
                f'<html><body><img src="{address}">', identifier="x", moment=datetime(2026, 1, 1, tzinfo=UTC)
            )


@pytest.mark.parametrize(
    ("sign", "shown"), [("\u202e", r"U\+202E"), ("\x07", r"U\+0007"), ("\u2066", r"U\+2066")]
)
def test_signs_that_turn_what_is_read_are_refused_by_their_number(
    make_record: Make, sign: str, shown: str
) -> None:
    record = dataclasses.replace(make_record(), place=f"hall {sign}12")
    with pytest.raises(UnprintableError, match=f"not seen but change what is: {shown}; take them out"):
        certificate_html(record)


def test_a_name_that_the_template_lacks_is_an_error() -> None:
    with pytest.raises(UndefinedError, match="'record' is undefined"):
        html_of("certificate.html", {})


def test_an_extra_font_that_is_none_is_refused(make_record: Make, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read: No such file"):
        certificate_pdf(make_record(), [tmp_path / "no.ttf"])
    wrong = tmp_path / "wrong.ttf"
    wrong.write_bytes(b"no font")
    with pytest.raises(InputError, match=r"wrong\.ttf is not a TrueType or OpenType font"):
        certificate_pdf(make_record(), [wrong])


def test_templates_and_fonts_with_their_licence_are_found() -> None:
    folder = report_folder()
    for name in ("certificate.html", "certificate.css", "base.css", "fonts/LICENSE_DEJAVU.txt"):
        assert folder.joinpath(name).is_file(), name
