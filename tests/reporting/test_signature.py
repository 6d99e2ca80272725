"""PAdES signatures: the certificate below stays as it is, and one altered byte anywhere is seen."""

from __future__ import annotations

import io
import re
import shutil
import subprocess
from collections.abc import Callable, Iterable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pypdf
import pytest
from by_path import load
from weasyprint import HTML

from monitor.exceptions import InputError
from monitor.reporting.certificate.record import CertificateRecord
from monitor.reporting.pdf.render import certificate_pdf

pytest.importorskip("pyhanko", reason="the extra [sign] is not installed")
from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.hazmat.primitives.serialization import BestAvailableEncryption, Encoding, pkcs12
from cryptography.x509.oid import NameOID

from monitor.reporting.signature.signature import check_signature
from monitor.reporting.signature.signer import Signer
from monitor.reporting.signature.signing import FileKey, sign


@pytest.fixture(scope="module")
def keys(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """PKCS#12 and PEM of a made-up laboratory, and the PEM of another one."""
    folder = tmp_path_factory.mktemp("keys")
    found = {}
    for name, days in (("lab", (-1, 30)), ("other", (-1, 30)), ("ended", (-60, -1)), ("begins", (1, 30))):
        key = rsa.generate_private_key(public_exponent=65537, key_size=2048)
        subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, f"Made-up Laboratory {name}")])
        now = datetime.now(UTC)
        certificate = (
            x509.CertificateBuilder()
            .subject_name(subject)
            .issuer_name(subject)
            .public_key(key.public_key())
            .serial_number(7)
            .not_valid_before(now + timedelta(days=days[0]))
            .not_valid_after(now + timedelta(days=days[1]))
            .add_extension(x509.KeyUsage(True, True, *[False] * 7), critical=True)
            .sign(key, hashes.SHA256())
        )
        found[name] = folder / f"{name}.p12"
        found[name].write_bytes(
            pkcs12.serialize_key_and_certificates(
                name.encode(), key, certificate, None, BestAvailableEncryption(b"words")
            )
        )
        found[f"{name}.pem"] = folder / f"{name}.pem"
        found[f"{name}.pem"].write_bytes(certificate.public_bytes(Encoding.PEM))
    return found


@pytest.fixture(scope="module")
def plain(make_record: Callable[..., CertificateRecord]) -> bytes:
    return certificate_pdf(make_record())


@pytest.fixture(scope="module")
def signed(plain: bytes, keys: dict[str, Path]) -> bytes:
    return sign(plain, FileKey(keys["lab"], "words"))


def test_en_319_142_the_document_lies_unchanged_below_its_signature(plain: bytes, signed: bytes) -> None:
    assert signed.startswith(plain)
    finding = check_signature(signed)
    assert finding.good is True
    assert finding.signer is not None
    assert finding.signer.name == "Common Name: Made-up Laboratory lab"
    assert finding.faults == ()
    reader = pypdf.PdfReader(io.BytesIO(signed))
    field = reader.root_object["/AcroForm"]["/Fields"][0].get_object()
    assert field["/V"]["/SubFilter"] == "/ETSI.CAdES.detached"


def test_signing_keeps_pdf_a_and_attachments(plain: bytes, signed: bytes) -> None:
    before, after = (pypdf.PdfReader(io.BytesIO(content)) for content in (plain, signed))
    assert before.attachments == after.attachments
    assert len(after.root_object["/AF"]) == 3
    for name in ("/Metadata", "/OutputIntents", "/MarkInfo"):
        assert name in after.root_object
    assert 'pdfaid:part="3"' in after.root_object["/Metadata"].get_object().get_data().decode("utf-8")


def test_iso_19005_3_6_3_the_field_of_the_signature_is_one_that_pdf_a_allows(
    signed: bytes, tmp_path: Path
) -> None:
    """A page that names no signer has no place for it: of no size, printed, not hidden, such a widget needs no
    appearance (6.3.3), which part 1 asked for (5.3.1)."""
    looked = load("pdf_a", Path(__file__).with_name("test_pdf_a.py"))
    (widget,) = (one.get_object() for one in pypdf.PdfReader(io.BytesIO(signed)).pages[0]["/Annots"])
    assert list(widget["/Rect"]) == [0, 0, 0, 0]
    printed, forbidden = 1 << 2, 1 << 0 | 1 << 1 | 1 << 5 | 1 << 8  # ISO 32000-1, table 165
    assert widget["/F"] & printed
    assert not widget["/F"] & forbidden
    if looked.needs_preflight.args[0]:
        pytest.skip(looked.needs_preflight.kwargs["reason"])
    file = tmp_path / "signed.pdf"
    file.write_bytes(signed)
    assert set(looked.preflight(file)) - set(looked.LIFTED) == {"5.3.1"}


def test_the_field_of_a_signature_is_seen_above_the_name_of_who_signs(
    make_record: Callable[..., CertificateRecord], keys: dict[str, Path], tmp_path: Path
) -> None:
    """Its frame stands above the line of the signer, over nothing printed there; no font comes into the file."""
    signer = Signer("Common Name: Made-up Laboratory lab, Country: DE", "ab" * 32)
    plain = certificate_pdf(replace(make_record(), signer=signer))
    signed = sign(plain, FileKey(keys["lab"], "words"))
    assert check_signature(signed, keys["lab.pem"]).good is True
    reader = pypdf.PdfReader(io.BytesIO(signed))
    (page,) = (page for page in reader.pages if "/Annots" in page)
    (widget,) = (annotation.get_object() for annotation in page["/Annots"])
    left, bottom, right, top = map(float, widget["/Rect"])
    assert (right - left, top - bottom) == pytest.approx((198.0, 20.0), abs=2.0)
    drawing = widget["/AP"]["/N"].get_object()
    assert "/Font" not in drawing.get("/Resources", {})
    assert drawing.get_data().count(b" f") > 30
    written: list[tuple[str, float, float]] = []
    page.extract_text(visitor_text=lambda text, cm, tm, *_: written.append((text, *_at(cm, tm))))
    covered = [text for text, x, y in written if text.strip() and left < x < right and bottom < y < top]
    assert covered == []
    below = [text for text, x, y in written if left - 2 < x < right and bottom - 14 < y < bottom]
    assert "Made-up Laboratory lab" in "".join(below)
    assert "Electronic signature" in page.extract_text()
    if shutil.which("pdftoppm") is None:
        return
    file = tmp_path / "signed.pdf"
    file.write_bytes(signed)
    (tmp_path / "plain.pdf").write_bytes(plain)
    number = str(reader.pages.index(page) + 1)
    dark = [_dark_dots(tmp_path / part, number) for part in ("plain.pdf", "signed.pdf")]
    # A frame of 198 by 20 points and some fifty letters, at 72 dots an inch.
    assert dark[1] - dark[0] > 300


def _at(cm: list[float], tm: list[float]) -> tuple[float, float]:
    """Where a text begins on the page, in points."""
    return cm[0] * tm[4] + cm[2] * tm[5] + cm[4], cm[1] * tm[4] + cm[3] * tm[5] + cm[5]


def _dark_dots(file: Path, page: str) -> int:
    """How many dots of a page are not white."""
    run = ["pdftoppm", "-r", "72", "-gray", "-f", page, "-l", page, str(file)]
    picture = subprocess.run(run, capture_output=True, check=True).stdout
    return sum(value < 200 for value in picture[15:])


def _container(signed: bytes) -> tuple[int, str]:
    """Where the hexadecimal digits of the signature's container begin in a file, and all of them but its zeros."""
    (room,) = re.finditer(rb"/Contents <([0-9a-fA-F]{1000,})>", signed)
    return room.start(1), room[1].rstrip(b"0").decode("ascii").lower()


def _digits_that_stay(signed: bytes, start: int, digits: Iterable[int]) -> list[int]:
    """The digits whose change by one bit is not seen."""
    unseen = []
    for digit in digits:
        altered = bytearray(signed)
        altered[start + digit] ^= 1
        if check_signature(bytes(altered)).good:
            unseen.append(digit)
    return unseen


def test_rfc_5652_labels_of_the_container_that_no_signature_covers_are_seen_when_they_change(
    keys: dict[str, Path],
) -> None:
    signed = sign(HTML(string="<p>A page.</p>").write_pdf(), FileKey(keys["lab"], "words"))
    start, container = _container(signed)
    # SHA-256 with its parameter NULL: in the set of digests, behind its version; in the signer's own record, behind
    # the name and the serial number (7) of his certificate.
    algorithm = "300d06096086480165030402010500"
    of_set, of_signer = (found.start() for found in re.finditer(algorithm, container))
    last = len(algorithm) - 1
    assert container[of_set - 5] == "1"
    assert container[of_signer - 6 : of_signer] == "020107"
    labels = [4, 6, of_set - 5, of_set - 3, of_set + 8, of_set + last - 2, of_set + last]
    labels += [of_signer - 1, of_signer - 8, of_signer - 9, of_signer + last - 2, of_signer + last]
    assert _digits_that_stay(signed, start, labels) == []


def test_an_altered_attachment_is_seen_and_named_as_altered(plain: bytes, signed: bytes) -> None:
    start = plain.index(b"/EmbeddedFile")
    inside = plain.index(b"stream", start) + 40
    altered = bytearray(signed)
    altered[inside] ^= 1
    finding = check_signature(bytes(altered))
    assert finding.good is False
    assert "the file was altered after it was signed" in finding.faults


def test_what_is_added_afterwards_is_seen(signed: bytes) -> None:
    finding = check_signature(signed + b"\n% and more\n")
    assert finding.good is False
    assert any("does not cover the whole file" in fault for fault in finding.faults)


def test_trust_is_said_only_against_certificates_that_are_given(signed: bytes, keys: dict[str, Path]) -> None:
    assert check_signature(signed, keys["lab.pem"]).good is True
    finding = check_signature(signed, keys["other.pem"])
    assert finding.good is False
    assert finding.faults == (
        "the certificate of Common Name: Made-up Laboratory lab does not lead to a trusted one",
    )


def test_a_signer_is_trusted_by_fingerprint_or_by_an_authority(
    signed: bytes, keys: dict[str, Path], tmp_path: Path
) -> None:
    # Computed by another library than the product's.
    certificate = x509.load_pem_x509_certificate(keys["lab.pem"].read_bytes())
    fingerprints = tmp_path / "signers.txt"
    fingerprints.write_text(f"\ufeff# ours\n\n{certificate.fingerprint(hashes.SHA256()).hex(':')} # 2026\n")
    assert check_signature(signed, fingerprints).signer_trusted is True
    der = tmp_path / "lab.der"
    der.write_bytes(certificate.public_bytes(Encoding.DER))
    assert check_signature(signed, der).signer_trusted is True
    # Nobody named, or another: the signature is whole and says nothing of who made it.
    assert check_signature(signed).signer_trusted is False
    assert check_signature(signed, keys["other.pem"]).signer_trusted is False
    for content in (b"", b"nobody\n", b"ab" * 31, bytes(range(256))):
        fingerprints.write_bytes(content)
        with pytest.raises(
            InputError, match=r"signers\.txt holds no certificates in PEM or DER, and no finger"
        ):
            check_signature(signed, fingerprints)


def test_an_unsigned_certificate_has_no_finding(plain: bytes) -> None:
    assert check_signature(plain).good is None


def test_keys_that_do_not_open_are_refused(plain: bytes, keys: dict[str, Path], tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"lab\.p12 is no PKCS#12 file with a key, or its passphrase is another"
    ):
        sign(plain, FileKey(keys["lab"], "other words"))
    with pytest.raises(InputError, match=r"other\.pem is no PKCS#12 file"):
        sign(plain, FileKey(keys["other.pem"]))
    with pytest.raises(InputError, match="cannot be read: No such file"):
        sign(plain, FileKey(tmp_path / "none.p12"))
    with pytest.raises(InputError, match=r"none\.pem cannot be read: No such file"):
        check_signature(sign(plain, FileKey(keys["lab"], "words")), tmp_path / "none.pem")


@pytest.mark.parametrize("name", ["ended", "begins"])
def test_a_certificate_that_is_not_valid_today_does_not_sign(
    plain: bytes, keys: dict[str, Path], name: str
) -> None:
    with pytest.raises(
        InputError, match=rf"Laboratory {name} is valid from .* not today .*; sign with one that is"
    ):
        sign(plain, FileKey(keys[name], "words"))


def test_en_319_102_1_a_certificate_that_ended_since_is_valid_on_the_day_of_the_signature(
    signed: bytes, keys: dict[str, Path]
) -> None:
    now = datetime.now(UTC)
    assert check_signature(signed, keys["lab.pem"], now).good is True
    late = check_signature(signed, keys["lab.pem"], now + timedelta(days=400))
    assert late.good is False
    (fault,) = late.faults
    assert fault.startswith("the certificate of Common Name: Made-up Laboratory lab is valid from ")
    assert fault.endswith(f", not on {now + timedelta(days=400):%Y-%m-%d}")
    # Who signed is another question than when.
    other = check_signature(signed, keys["other.pem"], now)
    assert other.faults == (
        "the certificate of Common Name: Made-up Laboratory lab does not lead to a trusted one",
    )
