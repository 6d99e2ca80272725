"""Keys on a PKCS#11 token, tested with a real one in software: SoftHSM 2. The private key never leaves it."""

from __future__ import annotations

import io
import shutil
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pypdf
import pytest

from monitor.exceptions import InputError
from monitor.reporting.certificate.record import CertificateRecord
from monitor.reporting.pdf.render import certificate_pdf

pytest.importorskip("pyhanko", reason="the extra [sign] is not installed")
pytest.importorskip("pkcs11", reason="the extra [token] is not installed")
import pkcs11
from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat

from monitor.reporting.signature.signature import check_signature
from monitor.reporting.signature.signing import TokenKey, sign

LIBRARIES = [
    Path(folder) / "softhsm" / "libsofthsm2.so"
    for folder in ("/usr/lib", "/usr/lib/x86_64-linux-gnu", "/usr/lib/aarch64-linux-gnu", "/usr/local/lib")
]
LIBRARY = next((one for one in LIBRARIES if one.is_file()), None)
pytestmark = pytest.mark.skipif(
    LIBRARY is None or shutil.which("softhsm2-util") is None,
    reason="no SoftHSM (Debian: softhsm2), the token in software",
)
PIN, LABEL = "1234", "Prüflabor"


def certified(key: rsa.RSAPrivateKey | ec.EllipticCurvePrivateKey, name: str) -> x509.Certificate:
    subject = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, name)])
    now = datetime.now(UTC)
    return (
        x509.CertificateBuilder().subject_name(subject).issuer_name(subject).public_key(key.public_key())
        .serial_number(1).not_valid_before(now - timedelta(days=1)).not_valid_after(now + timedelta(days=9))
        .add_extension(x509.KeyUsage(True, True, *[False] * 7), critical=True)
        .sign(key, hashes.SHA256())
    )  # fmt: skip


@pytest.fixture(scope="module")
def token(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The library of a token that holds the keys ``rsa`` and ``ec`` with their certificates, and ``bare`` without."""
    from pkcs11.util.ec import decode_ec_private_key
    from pkcs11.util.rsa import decode_rsa_private_key
    from pkcs11.util.x509 import decode_x509_certificate

    folder = tmp_path_factory.mktemp("token")
    (folder / "tokens").mkdir()
    settings = folder / "softhsm2.conf"
    settings.write_text(f"directories.tokendir = {folder / 'tokens'}\nlog.level = ERROR\n", encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SOFTHSM2_CONF", str(settings))
        subprocess.run(
            ["softhsm2-util", "--init-token", "--free", "--label", LABEL, "--pin", PIN, "--so-pin", "5678"],
            check=True, capture_output=True,
        )  # fmt: skip
        keys = {
            "rsa": rsa.generate_private_key(public_exponent=65537, key_size=2048),
            "ec": ec.generate_private_key(ec.SECP256R1()),
            "bare": ec.generate_private_key(ec.SECP256R1()),
        }
        with pkcs11.lib(str(LIBRARY)).get_token(token_label=LABEL).open(rw=True, user_pin=PIN) as session:
            for name, key in keys.items():
                traditional = key.private_bytes(
                    Encoding.DER, PrivateFormat.TraditionalOpenSSL, NoEncryption()
                )
                decode = decode_rsa_private_key if name == "rsa" else decode_ec_private_key
                kept = {pkcs11.Attribute.TOKEN: True, pkcs11.Attribute.LABEL: name}
                hidden = {pkcs11.Attribute.EXTRACTABLE: False, pkcs11.Attribute.SENSITIVE: True}
                session.create_object({**decode(traditional), **kept, **hidden})
                if name != "bare":
                    certificate = certified(key, f"Laboratory {name}").public_bytes(Encoding.DER)
                    session.create_object({**decode_x509_certificate(certificate), **kept})
        yield LIBRARY or Path()


@pytest.fixture(scope="module")
def plain(make_record: Callable[..., CertificateRecord]) -> bytes:
    return certificate_pdf(make_record())


@pytest.mark.parametrize("name", ["rsa", "ec"])
def test_pkcs11_a_key_on_a_token_signs_and_the_document_stays_below(
    token: Path, plain: bytes, name: str
) -> None:
    signed = sign(plain, TokenKey(token, key=name, token=LABEL, pin=PIN))
    assert signed.startswith(plain)
    finding = check_signature(signed)
    assert (finding.good, finding.signer) == (True, f"Common Name: Laboratory {name}")
    assert pypdf.PdfReader(io.BytesIO(signed)).attachments == pypdf.PdfReader(io.BytesIO(plain)).attachments
    altered = bytearray(signed)
    altered[len(plain) // 2] ^= 1
    assert check_signature(bytes(altered)).good is False


def test_pkcs11_what_the_token_refuses_is_told(token: Path, plain: bytes) -> None:
    good = TokenKey(token, key="rsa", token=LABEL, pin=PIN)
    for wrong, words in (
        (replace(good, pin="0000"), "token 'Prüflabor' of libsofthsm2.so does not open: PinIncorrect"),
        (replace(good, token="another"), "token 'another' of libsofthsm2.so does not open: .*another"),
        (replace(good, slot=1), "either by its label .* or by its slot"),
        (replace(good, token=None, slot=99), "slot 99 of libsofthsm2.so does not open"),
        (replace(good, key="nobody"), "does not sign with 'nobody': .*ould not find certificate with label 'nobody'"),
        (replace(good, key="bare"), "does not sign with 'bare': .*ould not find certificate"),
        (replace(good, key="nobody", certificate="rsa"), "ould not find private key with label 'nobody'"),
        (replace(good, library=Path("/nowhere.so")), "there is no PKCS#11 library /nowhere.so"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=words):
            sign(plain, wrong)


def test_pkcs11_the_certificate_may_have_a_label_of_its_own(token: Path, plain: bytes) -> None:
    signed = sign(plain, TokenKey(token, key="ec", certificate="ec", token=LABEL, pin=PIN))
    assert check_signature(signed).good is True
