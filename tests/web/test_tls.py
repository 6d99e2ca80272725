"""A server with TLS as people start it: a process of its own with a certificate by openssl, asked over loopback."""

from __future__ import annotations

import http.client
import re
import shutil
import socket
import ssl
import subprocess
import sys
from collections.abc import Iterator
from http.cookies import SimpleCookie
from pathlib import Path
from urllib.parse import urlencode

import pytest

pytest.importorskip("fastapi", reason="the extra web is not installed")

from monitor.web.sessions import COOKIE
from monitor.web.users import add_user


class Served:
    """The port of a server, the certificate that its clients trust, and the token of a viewer."""

    def __init__(self, port: int, certificate: Path, token: str, log: Path) -> None:
        self.port, self.token, self.log = port, token, log
        self.trusting = ssl.create_default_context(cafile=str(certificate))

    def ask(
        self, path: str, form: dict[str, str] | None = None, cookie: str = ""
    ) -> tuple[http.client.HTTPResponse, str]:
        """The answer to one request over TLS, with its text."""
        connection = http.client.HTTPSConnection("localhost", self.port, timeout=60.0, context=self.trusting)
        headers = {"Cookie": cookie} if cookie else {}
        try:
            if form is None:
                connection.request("GET", path, headers=headers)
            else:
                kind = {"Content-Type": "application/x-www-form-urlencoded"}
                connection.request("POST", path, urlencode(form), headers | kind)
            answer = connection.getresponse()
            return answer, answer.read().decode()
        finally:
            connection.close()


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    if shutil.which("openssl") is None:
        pytest.skip("openssl is not installed")
    folder = tmp_path_factory.mktemp("tls")
    certificate, key, users, log = (folder / name for name in ("c.pem", "k.pem", "users.toml", "log"))
    subprocess.run(
        [
            "openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "2",
            "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1",
            "-keyout", key, "-out", certificate,
        ],
        check=True, capture_output=True,
    )  # fmt: skip
    token = add_user(users, "ada", "viewer")
    with log.open("w") as errors:
        server = subprocess.Popen(
            [
                sys.executable, "-m", "monitor", "--db", folder / "shop.duckdb", "serve", "--port", "0",
                "--certificate", certificate, "--key", key, "--users", users,
            ],
            stdout=subprocess.PIPE, stderr=errors, text=True,
        )  # fmt: skip
        assert server.stdout is not None
        said = server.stdout.readline()
        try:
            port = re.search(r"https://127\.0\.0\.1:(\d+)/", said)
            assert port is not None, said + log.read_text()
            yield Served(int(port[1]), certificate, token, log)
        finally:
            server.terminate()
            server.wait()
            server.stdout.close()


def _session_cookie(answer: http.client.HTTPResponse) -> tuple[str, dict[str, object]]:
    """The value of the session's cookie and its attributes as the response sets them."""
    (header,) = answer.headers.get_all("Set-Cookie") or [""]
    morsel = SimpleCookie(header)[COOKIE]
    return morsel.value, {name: morsel[name] for name in ("secure", "httponly", "samesite", "path")}


def test_over_tls_the_cookie_is_secure_and_a_session_works(served: Served) -> None:
    sent_away, _ = served.ask("/campaigns")
    assert (sent_away.status, sent_away.headers["location"]) == (303, "/login?then=/campaigns")
    answer, _ = served.ask("/login", {"token": served.token, "then": "/campaigns"})
    assert (answer.status, answer.headers["location"]) == (303, "/campaigns")
    value, attributes = _session_cookie(answer)
    assert attributes == {"secure": True, "httponly": True, "samesite": "Strict", "path": "/"}
    page, text = served.ask("/campaigns", cookie=f"{COOKIE}={value}")
    assert page.status == 200
    assert "ada, viewer" in text
    assert page.headers["strict-transport-security"] == "max-age=31536000"
    proof = re.search(r'name="proof" value="([0-9a-f]{64})"', text)
    assert proof is not None
    out, _ = served.ask("/logout", {"proof": proof[1]}, cookie=f"{COOKIE}={value}")
    # The cookie is taken back as it was set.
    assert out.status == 303
    assert _session_cookie(out) == ("", attributes)
    assert "Max-Age=0" in out.headers["set-cookie"]
    assert served.ask("/campaigns", cookie=f"{COOKIE}={value}")[0].status == 303


def test_whoever_does_not_know_the_certificate_is_not_connected(served: Served) -> None:
    connection = http.client.HTTPSConnection(
        "localhost", served.port, timeout=60.0, context=ssl.create_default_context()
    )
    with pytest.raises(ssl.SSLCertVerificationError, match="self-signed certificate"):
        connection.request("GET", "/login")


@pytest.mark.parametrize("version", [ssl.TLSVersion.TLSv1, ssl.TLSVersion.TLSv1_1])
def test_old_versions_of_tls_are_refused(served: Served, version: ssl.TLSVersion) -> None:
    old = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    old.check_hostname = False
    old.verify_mode = ssl.CERT_NONE
    with pytest.warns(DeprecationWarning, match="deprecated"):
        old.minimum_version = old.maximum_version = version
    # At its usual level the client itself has no cipher of these versions: it is the server that has to refuse.
    old.set_ciphers("ALL:@SECLEVEL=0")
    with (
        socket.create_connection(("localhost", served.port), 60.0) as plain,
        pytest.raises(ssl.SSLError, match=r"alert protocol version|EOF occurred|has been closed"),
    ):
        old.wrap_socket(plain)


def test_plain_http_at_the_port_of_tls_gets_no_answer_and_does_no_harm(served: Served) -> None:
    """Nothing of a page, no cookie, no redirect that a third party could rewrite; who comes with TLS is served on."""
    before = served.log.read_text()
    with socket.create_connection(("localhost", served.port), 60.0) as plain:
        plain.sendall(b"GET /login HTTP/1.1\r\nHost: localhost\r\n\r\n")
        plain.settimeout(60.0)
        received = b""
        while part := plain.recv(65536):
            received += part
    assert b"HTTP/" not in received
    assert b"cookie" not in received.lower()
    assert served.ask("/login")[0].status == 200
    assert "Traceback" not in served.log.read_text()[len(before) :]
