"""PAdES B-LT (ETSI EN 319 142-1:2016, 5.4 and 6): what the authorities said at signing travels in the file.

The authority on the loopback stamps and answers by OpenSSL, which also judges what was embedded.
"""

from __future__ import annotations

import io
import shutil
import subprocess
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from pypdf import PdfReader

from monitor.exceptions import InputError
from monitor.reporting.pdf.render import pdf_of
from tests.reporting import long_term_authority
from tests.reporting.long_term_authority import Authority

pytest.importorskip("pyhanko", reason="the extra [sign] is not installed")

from monitor.reporting.signature.signature import check_signature
from monitor.reporting.signature.signing import FileKey, sign


@pytest.fixture(scope="module")
def authority(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Authority]:
    if shutil.which("openssl") is None:
        pytest.skip("openssl is not installed")
    authority = Authority(tmp_path_factory.mktemp("authority"))
    yield authority
    authority.close()


@pytest.fixture(scope="module")
def page() -> bytes:
    return pdf_of("<title>a</title><p>a</p>", identifier="a", moment=datetime(2026, 3, 9, tzinfo=UTC))


@pytest.fixture(scope="module")
def signed(page: bytes, authority: Authority) -> bytes:
    folder = authority.folder
    return sign(page, FileKey(folder / "laboratory.p12"), f"{authority.address}/tsa", folder / "root.pem")


def _embedded(pdf: bytes, kind: str) -> list[bytes]:
    """The streams of a kind in the document security store (ETSI EN 319 142-1, 5.4.2), read by pypdf."""
    store = PdfReader(io.BytesIO(pdf)).trailer["/Root"]["/DSS"]  # type: ignore[index]
    return [stream.get_object().get_data() for stream in store.get(f"/{kind}", [])]


def test_en_319_142_b_lt_signer_and_stamp_are_judged_by_the_file_alone(
    page: bytes, signed: bytes, authority: Authority
) -> None:
    assert signed.startswith(page)
    finding = check_signature(signed, authority.folder / "root.pem")
    assert (finding.good, finding.faults, finding.signer_trusted) == (True, (), True)
    material = finding.long_term
    assert material is not None
    assert (material.complete, material.why_not) == (True, "")
    assert (material.certificates, material.revocation_lists, material.answers) == (3, 1, 1)
    # The store stands in the revision that the signature covers: nothing follows it.
    assert finding.stamped_at is not None
    # Years later the certificates have ended, and nobody answers any more: the file is judged as of its stamp.
    later = check_signature(signed, authority.folder / "root.pem", datetime.now(UTC) + timedelta(days=3650))
    assert later.long_term == material
    assert "valid from" in later.faults[0]
    assert later.judged_until is None


def test_en_319_102_1_5_6_past_validation_a_stamp_proves_the_signature_until_its_own_certificate_ends(
    page: bytes, signed: bytes, authority: Authority
) -> None:
    folder = authority.folder
    now = datetime.now(UTC)
    root = folder / "root.pem"
    # The signer's certificate ends after 30 days, that of the time stamps after 60.
    assert _day_of_end("laboratory", folder) < _day_of_end("stamps", folder)
    assert check_signature(signed, root).judged_until == _day_of_end("stamps", folder)
    between = check_signature(signed, root, now + timedelta(days=45))
    assert (between.good, between.faults, between.signer_trusted) == (True, (), True)
    beyond = check_signature(signed, root, now + timedelta(days=75))
    assert (beyond.good, beyond.judged_until) == (False, None)
    # Without material the authority need not say any more whether the signer's was revoked before.
    plain = sign(page, FileKey(folder / "laboratory.p12"), f"{authority.address}/tsa")
    assert check_signature(plain, root).judged_until == _day_of_end("laboratory", folder)
    assert check_signature(plain, root, now + timedelta(days=45)).good is False
    # Nobody named: the material is not judged, and proves nothing.
    assert check_signature(signed).judged_until == _day_of_end("laboratory", folder)


def test_a_stamp_that_ends_before_the_signer_shortens_nothing(
    page: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(long_term_authority._DAYS, "stamps", 10)
    authority = Authority(tmp_path)
    try:
        signed = sign(
            page, FileKey(tmp_path / "laboratory.p12"), f"{authority.address}/tsa", tmp_path / "root.pem"
        )
    finally:
        authority.close()
    for days in (0, 15):
        finding = check_signature(signed, tmp_path / "root.pem", datetime.now(UTC) + timedelta(days=days))
        assert (finding.good, finding.signer_trusted) == (True, True)
        assert finding.judged_until == _day_of_end("laboratory", tmp_path)


def _day_of_end(name: str, folder: Path) -> datetime:
    """When a certificate ends, as OpenSSL reads it."""
    said = (
        _openssl("x509", "-in", folder / f"{name}.pem", "-noout", "-enddate")
        .strip()
        .removeprefix("notAfter=")
    )
    return datetime.strptime(said, "%b %d %H:%M:%S %Y %Z").replace(tzinfo=UTC)


def test_openssl_reads_in_the_store_that_both_certificates_were_in_force(
    signed: bytes, authority: Authority, tmp_path: Path
) -> None:
    folder = authority.folder
    (revocations,) = _embedded(signed, "CRLs")
    (tmp_path / "embedded.crl").write_bytes(revocations)
    said = _openssl(
        "crl", "-inform", "DER", "-in", tmp_path / "embedded.crl", "-CAfile", folder / "root.pem", "-noout"
    )
    assert "verify OK" in said
    said = _openssl("crl", "-inform", "DER", "-in", tmp_path / "embedded.crl", "-text", "-noout")
    assert "Serial Number: 17" in said  # 23, of the one that was revoked
    assert "Serial Number: 16" not in said  # 22, of the time stamps
    (answer,) = _embedded(signed, "OCSPs")
    (tmp_path / "answer.der").write_bytes(answer)
    said = _openssl(
        "ocsp", "-respin", tmp_path / "answer.der", "-issuer", folder / "root.pem",
        "-cert", folder / "laboratory.pem", "-CAfile", folder / "root.pem", "-no_nonce",
    )  # fmt: skip
    assert "Response verify OK" in said
    assert f"{folder / 'laboratory.pem'}: good" in said
    fingerprints = [_fingerprint(content, tmp_path) for content in _embedded(signed, "Certs")]
    expected = [
        _fingerprint((folder / f"{name}.pem").read_bytes(), tmp_path)
        for name in ("laboratory", "root", "stamps")
    ]
    assert sorted(fingerprints) == sorted(expected)


def test_without_named_authorities_the_material_is_counted_and_not_judged(
    page: bytes, signed: bytes, authority: Authority, tmp_path: Path
) -> None:
    material = check_signature(signed).long_term
    assert material is not None
    assert material.complete is None
    plain = sign(page, FileKey(authority.folder / "laboratory.p12"), f"{authority.address}/tsa")
    assert check_signature(plain, authority.folder / "root.pem").long_term is None
    # Of another authority the same bytes prove nothing.
    (tmp_path / "other").mkdir()
    other = Authority(tmp_path / "other")
    other.close()
    foreign = check_signature(signed, other.folder / "root.pem").long_term
    assert foreign is not None
    assert foreign.complete is False
    assert foreign.why_not.startswith("the certificate of the signer: ")


def test_a_revoked_certificate_and_one_of_which_nothing_is_known_do_not_sign(
    page: bytes, authority: Authority
) -> None:
    folder = authority.folder
    for name, why in (("revoked", "revoked"), ("silent", "[Rr]evocation|revinfo|status")):
        with pytest.raises(
            InputError, match=rf"cannot be judged by .*root\.pem.*({why}).*nothing was issued"
        ):
            sign(page, FileKey(folder / f"{name}.p12"), f"{authority.address}/tsa", folder / "root.pem")


def test_a_stamp_of_an_authority_that_was_not_named_is_refused(
    page: bytes, authority: Authority, tmp_path: Path
) -> None:
    stranger = Authority(tmp_path)
    folder = authority.folder
    try:
        with pytest.raises(
            InputError, match=r"signer and time stamp cannot be judged by .*nothing was issued"
        ):
            sign(page, FileKey(folder / "laboratory.p12"), f"{stranger.address}/tsa", folder / "root.pem")
    finally:
        stranger.close()


def test_fingerprints_are_no_authorities(page: bytes, authority: Authority, tmp_path: Path) -> None:
    (tmp_path / "signers.txt").write_text("ab" * 32)
    with pytest.raises(InputError, match=r"holds fingerprints: long-term material needs the certificates"):
        sign(
            page,
            FileKey(authority.folder / "laboratory.p12"),
            f"{authority.address}/tsa",
            tmp_path / "signers.txt",
        )


def test_an_altered_byte_of_the_material_is_seen(signed: bytes, authority: Authority) -> None:
    at = signed.rindex(b"/DSS")
    altered = signed[:at] + b"/DSX" + signed[at + 4 :]
    assert check_signature(altered, authority.folder / "root.pem").good is False


def _fingerprint(content: bytes, folder: Path) -> str:
    (folder / "certificate").write_bytes(content)
    form = "PEM" if content.startswith(b"-----") else "DER"
    return _openssl(
        "x509", "-inform", form, "-in", folder / "certificate", "-noout", "-fingerprint", "-sha256"
    )


def _openssl(*command: str | Path) -> str:
    done = subprocess.run(["openssl", *command], check=True, capture_output=True, text=True)
    return done.stdout + done.stderr
