"""An authority on the loopback for tests of PAdES B-LT: it issues certificates, and says which of them were revoked.

Certificates and revocation lists are made with `cryptography`; time stamps and OCSP answers come from OpenSSL, which
shares no code with pyHanko.
"""

from __future__ import annotations

import subprocess
import threading
from datetime import UTC, datetime, timedelta
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat, pkcs12
from cryptography.x509.oid import AuthorityInformationAccessOID, ExtendedKeyUsageOID, NameOID

_TSA = """[tsa]
default_tsa = stamps
[stamps]
serial = {folder}/tsa-serial
signer_cert = {folder}/stamps.pem
signer_key = {folder}/stamps.key
signer_digest = sha256
default_policy = 1.2.3.4
digests = sha256, sha384, sha512
ess_cert_id_alg = sha256
"""
#: Serial numbers of what the authority issues.
SERIALS = {"laboratory": 21, "stamps": 22, "revoked": 23, "silent": 24}
#: How long certificates are valid, those of others 30 days.
_DAYS = {"root": 90, "stamps": 60}
_MEDIA = {
    "ocsp": "application/ocsp-response",
    "tsa": "application/timestamp-reply",
    "crl": "application/pkix-crl",
}


class Authority:
    """A root that answers under ``address``: /tsa stamps, /ocsp answers for single certificates, /crl is its list.

    Keys lie in ``folder`` as NAME.p12: ``laboratory`` with OCSP and a list, ``revoked`` the same but taken back,
    ``silent`` names no address at which its state could be asked.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._server = HTTPServer(("127.0.0.1", 0), self._handler())
        self.address = f"http://127.0.0.1:{self._server.server_port}"
        self._key = rsa.generate_private_key(public_exponent=65537, key_size=2048)
        self.root = self._issued("root", 1, self._key, self._key)
        for name, serial in SERIALS.items():
            own = rsa.generate_private_key(public_exponent=65537, key_size=2048)
            certificate = self._issued(name, serial, own, self._key)
            (folder / f"{name}.p12").write_bytes(
                pkcs12.serialize_key_and_certificates(name.encode(), own, certificate, None, NoEncryption())
            )
        self._write_states()
        threading.Thread(target=self._server.serve_forever, daemon=True).start()

    def close(self) -> None:
        """Answer nobody any more."""
        self._server.shutdown()
        self._server.server_close()

    def _issued(
        self, name: str, serial: int, own: rsa.RSAPrivateKey, issuer: rsa.RSAPrivateKey
    ) -> x509.Certificate:
        now = datetime.now(UTC)
        is_root = name == "root"
        builder = (
            x509.CertificateBuilder()
            .subject_name(_named(name))
            .issuer_name(_named("root"))
            .public_key(own.public_key())
            .serial_number(serial)
            .not_valid_before(now - timedelta(days=1))
            .not_valid_after(now + timedelta(days=_DAYS.get(name, 30)))
            .add_extension(x509.BasicConstraints(is_root, None), critical=True)
            .add_extension(x509.SubjectKeyIdentifier.from_public_key(own.public_key()), critical=False)
            .add_extension(
                x509.AuthorityKeyIdentifier.from_issuer_public_key(issuer.public_key()), critical=False
            )
            .add_extension(_usage(signs_others=is_root), critical=True)
        )
        if name == "stamps":
            builder = builder.add_extension(
                x509.ExtendedKeyUsage([ExtendedKeyUsageOID.TIME_STAMPING]), critical=True
            )
        if name in ("laboratory", "revoked"):
            at = x509.AccessDescription(
                AuthorityInformationAccessOID.OCSP, x509.UniformResourceIdentifier(f"{self.address}/ocsp")
            )
            builder = builder.add_extension(x509.AuthorityInformationAccess([at]), critical=False)
        if name in ("stamps", "revoked"):
            names = [x509.UniformResourceIdentifier(f"{self.address}/crl")]
            points = [x509.DistributionPoint(names, None, None, None)]
            builder = builder.add_extension(x509.CRLDistributionPoints(points), critical=False)
        certificate = builder.sign(issuer, hashes.SHA256())
        (self.folder / f"{name}.pem").write_bytes(certificate.public_bytes(Encoding.PEM))
        pem = own.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
        (self.folder / f"{name}.key").write_bytes(pem)
        return certificate

    def _write_states(self) -> None:
        """Write the list of what was revoked, and the same as OpenSSL's index for its OCSP answers."""
        now = datetime.now(UTC)
        taken_back = now - timedelta(hours=1)
        revoked = (
            x509.RevokedCertificateBuilder()
            .serial_number(SERIALS["revoked"])
            .revocation_date(taken_back)
            .build()
        )
        revocations = (
            x509.CertificateRevocationListBuilder()
            .issuer_name(_named("root"))
            .last_update(now - timedelta(hours=1))
            .next_update(now + timedelta(days=7))
            .add_revoked_certificate(revoked)
            .add_extension(x509.CRLNumber(1), critical=False)
            .add_extension(
                x509.AuthorityKeyIdentifier.from_issuer_public_key(self._key.public_key()), critical=False
            )
            .sign(self._key, hashes.SHA256())
        )
        (self.folder / "root.crl").write_bytes(revocations.public_bytes(Encoding.DER))
        ends = f"{now + timedelta(days=30):%y%m%d%H%M%SZ}"
        rows = [
            f"{'R' if name == 'revoked' else 'V'}\t{ends}\t"
            f"{f'{taken_back:%y%m%d%H%M%SZ}' if name == 'revoked' else ''}\t{serial:02X}\tunknown\t/CN=Made-up {name}\n"
            for name, serial in SERIALS.items()
        ]
        (self.folder / "index.txt").write_text("".join(rows))
        (self.folder / "tsa-serial").write_text("01\n")
        (self.folder / "tsa.cnf").write_text(_TSA.format(folder=self.folder))

    def _answer(self, path: str, asked: bytes) -> bytes:
        folder = self.folder
        if path == "/crl":
            return (folder / "root.crl").read_bytes()
        (folder / "asked.der").write_bytes(asked)
        if path == "/tsa":
            command = ["ts", "-reply", "-config", folder / "tsa.cnf", "-queryfile", folder / "asked.der"]
            return _openssl(command)
        answer = folder / "answer.der"
        command = [
            "ocsp", "-index", folder / "index.txt", "-CA", folder / "root.pem", "-rsigner", folder / "root.pem",
            "-rkey", folder / "root.key", "-reqin", folder / "asked.der", "-respout", answer, "-ndays", "7",
        ]  # fmt: skip
        _openssl(command)
        return answer.read_bytes()

    def _handler(self) -> type[BaseHTTPRequestHandler]:
        authority = self

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                self._reply(self.rfile.read(int(self.headers["Content-Length"])))

            def do_GET(self) -> None:
                self._reply(b"")

            def _reply(self, asked: bytes) -> None:
                reply = authority._answer(self.path, asked)
                self.send_response(200)
                self.send_header("Content-Type", _MEDIA[self.path[1:]])
                self.send_header("Content-Length", str(len(reply)))
                self.end_headers()
                self.wfile.write(reply)

            def log_message(self, *_: object) -> None:
                """Print nothing."""

        return Handler


def _named(name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, f"Made-up {name}")])


def _usage(*, signs_others: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=True, content_commitment=not signs_others, key_encipherment=False, data_encipherment=False,
        key_agreement=False, key_cert_sign=signs_others, crl_sign=signs_others, encipher_only=False,
        decipher_only=False,
    )  # fmt: skip


def _openssl(command: list[str | Path]) -> bytes:
    return subprocess.run(["openssl", *command], check=True, capture_output=True).stdout
