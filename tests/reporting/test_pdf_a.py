"""PDF/A-3u (ISO 19005-3:2012) as far as it can be checked here: by reading the file, by qpdf, by PDFBox Preflight.

Preflight knows PDF/A-1b (ISO 19005-1). What it may report of a certificate are rules that part 3 lifted, each named
below with its clause; anything else it says is a fault. docs/reports-and-certificates.md tells what this leaves open.
"""

from __future__ import annotations

import dataclasses
import io
import re
import shutil
import struct
import subprocess
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pypdf
import pytest

from monitor.reporting.certificate.data import certificate_files
from monitor.reporting.certificate.record import CertificateRecord
from monitor.reporting.pdf.render import certificate_pdf

Make = Callable[..., CertificateRecord]
JAVA = Path("/usr/share/java")
#: Debian: libpdfbox2-java, libactivation-java, libjaxb-api-java (which Java 11 and later no longer bring along).
JARS = ("preflight", "pdfbox2", "xmpbox", "fontbox2", "commons-logging", "javax.activation", "jaxb-api")
#: Preflight's code: what PDF/A-1 forbids and PDF/A-3 (ISO 19005-3:2012) allows, and where that says so.
LIFTED = {
    "1.2.7": "a filter on the metadata (6.6.2.1 asks only that no encryption hides them)",
    "1.2.9": "embedded files (6.8)",
    "1.4": "cross reference streams (6.1.4 follows ISO 32000-1)",
    "1.4.7": "embedded files in the name tree (6.8)",
    "2.2.1": "transparency groups, here of a hatched bar (6.2.10, blended in the colours of the output intent)",
    "3.1.11": "no CIDSet in a font subset (6.2.11.4.2: optional, complete where present)",
}


@pytest.fixture(scope="module")
def record(make_record: Make) -> CertificateRecord:
    return dataclasses.replace(make_record(13, language="de", maps=1), country="DE")


@pytest.fixture(scope="module")
def file(record: CertificateRecord, tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("pdf") / "c.pdf"
    place.write_bytes(certificate_pdf(record))
    return place


@pytest.fixture(scope="module")
def reader(file: Path) -> pypdf.PdfReader:
    return pypdf.PdfReader(io.BytesIO(file.read_bytes()))


def test_iso_19005_3_6_6_4_the_metadata_declare_part_3_level_u(reader: pypdf.PdfReader) -> None:
    xmp = reader.root_object["/Metadata"].get_object().get_data().decode("utf-8")
    assert 'pdfaid:part="3"' in xmp
    assert 'pdfaid:conformance="U"' in xmp
    assert "Calibration certificate K-2026-0042" in xmp
    assert str(reader.metadata["/CreationDate"]).startswith("D:20260303")
    assert "/Encrypt" not in reader.trailer


def test_iso_19005_3_6_2_3_the_output_intent_is_an_icc_profile_of_rgb(reader: pypdf.PdfReader) -> None:
    (intent,) = (one.get_object() for one in reader.root_object["/OutputIntents"])
    assert intent["/S"] == "/GTS_PDFA1"
    profile = intent["/DestOutputProfile"].get_object()
    content = profile.get_data()
    assert struct.unpack(">I", content[:4]) == (len(content),)
    assert content[36:40] == b"acsp"  # ICC.1:2010, 7.2.9
    assert content[16:20] == b"RGB "
    assert profile["/N"] == 3


def test_iso_19005_3_6_2_11_all_fonts_are_our_own_embedded_and_mapped_to_unicode(
    reader: pypdf.PdfReader,
) -> None:
    names = set()
    for page in reader.pages:
        for font in page["/Resources"]["/Font"].values():
            descendant = font.get_object()["/DescendantFonts"][0].get_object()
            assert "/FontFile2" in descendant["/FontDescriptor"]
            assert "/ToUnicode" in font.get_object()
            names.add(str(font.get_object()["/BaseFont"]).partition("+")[2])
    assert names == {"DejaVu-Sans", "DejaVu-Sans-Bold"}


def test_iso_19005_3_6_2_8_no_picture_is_smoothed_and_nothing_acts(reader: pypdf.PdfReader) -> None:
    objects = [reader.get_object(number) for number in range(1, int(reader.trailer["/Size"]))]
    every = [one for one in objects if isinstance(one, pypdf.generic.DictionaryObject)]
    assert len(every) > 50
    pictures = [one for one in every if one.get("/Subtype") == "/Image"]
    assert not [one for one in pictures if one.get("/Interpolate")]
    forbidden = {
        "/JavaScript",
        "/Launch",
        "/Sound",
        "/Movie",
        "/SubmitForm",
        "/ImportData",
        "/ResetForm",
        "/Rendition",
    }
    assert not [one for one in every if one.get("/S") in forbidden or "/AA" in one]
    assert "/OpenAction" not in reader.root_object


def test_the_document_is_tagged_and_says_its_language(reader: pypdf.PdfReader) -> None:
    assert str(reader.root_object["/MarkInfo"]["/Marked"]) == "True"
    assert "/StructTreeRoot" in reader.root_object
    assert reader.root_object["/Lang"] == "de"


def test_iso_19005_3_6_8_every_attached_file_is_in_af_with_type_date_and_relationship(
    reader: pypdf.PdfReader, record: CertificateRecord
) -> None:
    listed = {str(one.get_object()["/UF"]): one.get_object() for one in reader.root_object["/AF"]}
    wanted = {one.name: one for one in certificate_files(record)}
    assert set(listed) == set(wanted)
    assert len(reader.root_object["/AF"]) == len(listed) == 5
    assert {"certificate.dcc.xml", "volumetric-error-1.csv"} <= set(listed)
    for name, one in listed.items():
        stream = one["/EF"]["/F"].get_object()
        assert one["/AFRelationship"] == f"/{wanted[name].relationship}"
        assert one["/Desc"] == wanted[name].description
        assert "/" in str(stream["/Subtype"])[1:].replace("#2F", "/")
        assert str(stream["/Params"]["/ModDate"]).startswith("D:20260303")
        assert stream.get_data() == wanted[name].content


@pytest.mark.skipif(
    shutil.which("qpdf") is None, reason="qpdf (Debian: qpdf) checks the structure of PDF files"
)
def test_qpdf_finds_no_error_of_structure(file: Path) -> None:
    found = subprocess.run(["qpdf", "--check", str(file)], capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stdout + found.stderr
    assert "No syntax or stream encoding errors found" in found.stdout


def preflight(file: Path) -> Counter[str]:
    """The codes that Preflight reports, with how often."""
    path = ":".join(str(JAVA / f"{jar}.jar") for jar in JARS)
    command = ["java", "-cp", path, "org.apache.pdfbox.preflight.Validator_A1b", str(file)]
    said = subprocess.run(command, capture_output=True, text=True, check=False)
    assert f"The file {file.name} is not a valid PDF/A-1b file" in said.stdout, said.stdout + said.stderr
    return Counter(re.findall(r"^([\d.]+) : ", said.stdout, re.MULTILINE))


needs_preflight = pytest.mark.skipif(
    shutil.which("java") is None or not all((JAVA / f"{jar}.jar").is_file() for jar in JARS),
    reason="no PDFBox Preflight (Debian: default-jre-headless libpdfbox2-java libactivation-java libjaxb-api-java)",
)


@needs_preflight
def test_pdfbox_preflight_reports_only_what_pdf_a_3_allows(file: Path) -> None:
    found = preflight(file)
    assert set(found) <= set(LIFTED), found
    assert found["1.2.9"] == 5  # it has read the file: one for each attached file


@needs_preflight
def test_pdfbox_preflight_reports_what_is_broken_on_purpose(file: Path, tmp_path: Path) -> None:
    writer = pypdf.PdfWriter(clone_from=file)
    del writer.root_object["/OutputIntents"]
    del writer.root_object["/Metadata"]
    broken = tmp_path / "broken.pdf"
    writer.write(broken)
    assert set(preflight(broken)) - set(LIFTED)
