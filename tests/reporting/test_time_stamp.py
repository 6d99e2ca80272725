"""PAdES B-T (ETSI EN 319 142-1:2016, 6): a time stamp by OpenSSL's authority on the loopback, which shares no code."""

from __future__ import annotations

import shutil
import subprocess
import threading
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pytest

from monitor.exceptions import InputError
from monitor.reporting.pdf.render import pdf_of

pytest.importorskip("pyhanko", reason="the extra [sign] is not installed")
from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat, pkcs12
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from monitor.reporting.signature.signature import check_signature
from monitor.reporting.signature.signing import FileKey, sign

_TSA = """[tsa]
default_tsa = authority
[authority]
serial = {folder}/serial
signer_cert = {folder}/authority.pem
signer_key = {folder}/authority.key
signer_digest = sha256
default_policy = 1.2.3.4
digests = sha256, sha384, sha512
ess_cert_id_alg = sha256
"""


def _certificate(folder: Path, name: str, *, stamps: bool) -> None:
    key = rsa.generate_private_key(public_exponent=65537, key_size=2048)
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, f"Made-up {name}")])
    now = datetime.now(UTC)
    builder = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(subject)
        .public_key(key.public_key())
        .serial_number(11)
        .not_valid_before(now - timedelta(days=1))
        .not_valid_after(now + timedelta(days=30))
        .add_extension(x509.KeyUsage(True, True, *[False] * 7), critical=True)
    )
    if stamps:
        usage = x509.ExtendedKeyUsage([ExtendedKeyUsageOID.TIME_STAMPING])
        builder = builder.add_extension(usage, critical=True)
    certificate = builder.sign(key, hashes.SHA256())
    (folder / f"{name}.pem").write_bytes(certificate.public_bytes(Encoding.PEM))
    (folder / f"{name}.key").write_bytes(key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()))
    (folder / f"{name}.p12").write_bytes(
        pkcs12.serialize_key_and_certificates(name.encode(), key, certificate, None, NoEncryption())
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if shutil.which("openssl") is None:
        pytest.skip("openssl is not installed")
    keys = tmp_path_factory.mktemp("keys")
    _certificate(keys, "laboratory", stamps=False)
    _certificate(keys, "authority", stamps=True)
    (keys / "serial").write_text("01\n")
    (keys / "tsa.cnf").write_text(_TSA.format(folder=keys))
    return keys


@pytest.fixture(scope="module")
def authority(folder: Path) -> Iterator[str]:
    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            query = folder / "query.tsq"
            query.write_bytes(self.rfile.read(int(self.headers["Content-Length"])))
            if self.path == "/refuses":
                self.send_error(503)
                return
            reply = subprocess.run(
                ["openssl", "ts", "-reply", "-config", folder / "tsa.cnf", "-queryfile", query],
                check=True,
                capture_output=True,
            ).stdout
            (folder / "reply.tsr").write_bytes(reply)
            self.send_response(200)
            self.send_header("Content-Type", "application/timestamp-reply")
            self.send_header("Content-Length", str(len(reply)))
            self.end_headers()
            self.wfile.write(reply)

        def log_message(self, *_: object) -> None:
            """Print nothing."""

    server = HTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    server.server_close()


@pytest.fixture(scope="module")
def page() -> bytes:
    return pdf_of("<title>a</title><p>a</p>", identifier="a", moment=datetime(2026, 3, 9, tzinfo=UTC))


def test_en_319_142_b_t_the_signature_has_the_time_of_the_authority(
    page: bytes, folder: Path, authority: str
) -> None:
    before = datetime.now(UTC).replace(microsecond=0)
    signed = sign(page, FileKey(folder / "laboratory.p12"), authority)
    assert signed.startswith(page)
    finding = check_signature(signed, folder / "laboratory.pem")
    assert (finding.good, finding.faults) == (True, ())
    assert finding.stamped_at is not None
    assert before <= finding.stamped_at <= datetime.now(UTC)
    # RFC 3161: OpenSSL accepts its own reply for the query that the file was signed with.
    said = subprocess.run(
        ["openssl", "ts", "-verify", "-in", folder / "reply.tsr", "-queryfile", folder / "query.tsq",
         "-CAfile", folder / "authority.pem"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert "Verification: OK" in said.stdout + said.stderr
    assert check_signature(sign(page, FileKey(folder / "laboratory.p12"))).stamped_at is None


def test_an_authority_that_gives_none_is_a_refusal(page: bytes, folder: Path, authority: str) -> None:
    for address in (f"{authority}/refuses", "http://127.0.0.1:9"):
        with pytest.raises(
            InputError, match=r"authority http://127.*gave no time stamp: .*nothing was issued"
        ):
            sign(page, FileKey(folder / "laboratory.p12"), address)
