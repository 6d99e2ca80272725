"""Asks a server the questions of the contract: a typed request out as a document, its typed answer back from one.

The one client of the HTTP interface for every question. It follows no redirection and no proxy of the environment, so
that a token reaches the server that was named and nobody else; it sends none unencrypted to another computer.
"""

from __future__ import annotations

import hashlib
import http.client
import json
import socket
import ssl
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import IO, Any
from urllib.parse import urlsplit

from monitor import __version__
from monitor.bounded import LARGEST_SETTINGS, read_bounded
from monitor.documents import answer_from_document, to_document
from monitor.exceptions import InputError, NotFoundError
from monitor.web.access import JUDGING, NOT_OFFERED, ROOT, STAYING, address_of
from monitor.web.note import Note
from monitor.web.parcel import MEDIA_TYPE, check_targets, packed_question, travelling, unpacked_answer
from monitor.web.settings import DEFAULT_PORT, UPLOAD_BYTES, is_loopback
from monitor.workflow.contract import QUESTIONS

#: How long a server may take to be reached, in s. An answer may take as long as it takes to compute.
_REACHED_S = 10.0
_JSON = "application/json"
#: Fields that say with how many processes something is computed: its server decides, and the answer is the same.
_LEFT_TO_THE_SERVER = ("workers",)


class ServerFaultError(Exception):
    """A fault of the software of the server."""


@dataclass(frozen=True)
class Address:
    """Where a server is reached."""

    scheme: str
    host: str
    port: int

    def __str__(self) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.scheme}://{host}:{self.port}"

    @property
    def is_this_computer(self) -> bool:
        """Whether nothing that is sent leaves the computer."""
        return is_loopback(self.host)


def address_of_server(text: str) -> Address:
    """Read ``http://HOST:PORT`` or ``https://HOST``. Raises InputError for anything else."""
    try:
        parts = urlsplit(text)
        port = parts.port
    except ValueError as error:
        raise InputError(f"--server {text}: {error}; write for example https://monitor.example") from error
    if parts.username is not None or parts.password is not None:
        raise InputError(
            "--server takes no user or password, which others could read in the list of processes; "
            "put the token into a file: --server-token FILE"
        )
    if (
        parts.scheme not in ("http", "https")
        or not parts.hostname
        or parts.path not in ("", "/")
        or parts.query
    ):
        raise InputError(
            f"--server {text}: write the address of a server, such as http://127.0.0.1:{DEFAULT_PORT} or "
            "https://monitor.example"
        )
    return Address(parts.scheme, parts.hostname, port or (443 if parts.scheme == "https" else DEFAULT_PORT))


class Server:
    """A server that is asked instead of a database file; use it in a ``with`` statement as a database.

    ``tolerances`` are limits by machine type of the configuration of whoever asks.
    """

    def __init__(
        self, address: Address, token: str | None = None, *, certificate_sha256: str | None = None,
        tolerances: Mapping[str, Mapping[str, float]] | None = None,
    ) -> None:  # fmt: skip
        if token is not None and (not token.isascii() or not token.isprintable() or " " in token):
            raise InputError("a token is one line of letters, digits, - and _, as it was printed")
        if token and address.scheme == "http" and not address.is_this_computer:
            raise InputError(
                f"{address} is not encrypted, and a token must not be sent in the clear; use https://"
            )
        self.address = address
        self._token = token
        self._certificate_sha256 = certificate_sha256
        self._tolerances = tolerances

    def __enter__(self) -> Server:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        return

    def answer(self, question: str, request: object = None) -> Any:
        """Return the typed answer to a question; its files are written where the request says.

        Raises InputError for what the server refuses, and where it cannot be asked; ServerFaultError.
        """
        if question in NOT_OFFERED:
            raise InputError(f"{self.address} cannot be asked this: {NOT_OFFERED[question]}")
        document = _document(question, request)
        check_targets(question, document)
        content: dict[str, Any] = {"document": document}
        if self._tolerances is not None and question in JUDGING:
            content["tolerances"] = self._tolerances
        fields = travelling(question)
        has_files = any(document.get(name) for name in (*fields.incoming, *fields.outgoing))
        with tempfile.TemporaryFile() as body:
            if has_files or "tolerances" in content:
                packed_question(question, content, body, UPLOAD_BYTES)
                media_type = MEDIA_TYPE
            else:
                body.write(json.dumps(document, allow_nan=False).encode())
                media_type = _JSON
            return self._asked(question, document, body, media_type)

    def _asked(self, question: str, document: Mapping[str, Any], body: IO[bytes], media_type: str) -> Any:
        length = body.tell()
        body.seek(0)
        headers = {"Content-Type": media_type, "Content-Length": str(length), "Connection": "close"}
        if self._token:
            headers["Authorization"] = f"Bearer {self._token}"
        connection = self._connected()
        try:
            connection.request("POST", address_of(question), body, headers)
            response = connection.getresponse()
            return self._read(question, document, response)
        except (OSError, http.client.HTTPException) as error:
            raise InputError(
                f"{self.address} went away before it had answered ({error or type(error).__name__}); whether it stored "
                "anything, `monitor audit` says"
            ) from error
        finally:
            connection.close()

    def _connected(self) -> http.client.HTTPConnection:
        """Return a connection to the server, and to no other where its certificate is known."""
        host, port = self.address.host, self.address.port
        if self.address.scheme == "http":
            connection = http.client.HTTPConnection(host, port, timeout=_REACHED_S)
        else:
            context = ssl.create_default_context()
            if self._certificate_sha256 is not None:
                # The note of the same account says which certificate it is: compared below, before anything is sent.
                context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
            connection = http.client.HTTPSConnection(host, port, timeout=_REACHED_S, context=context)
        try:
            connection.connect()
        except ssl.SSLError as error:
            raise InputError(
                f"{self.address} does not show a certificate that this computer trusts ({error.reason}); the "
                "environment variable SSL_CERT_FILE may name the certificates to be trusted (PEM)"
            ) from error
        except (OSError, UnicodeError) as error:
            raise InputError(
                f"{self.address} cannot be reached ({error}); is `monitor serve` running there?"
            ) from error
        secured = connection.sock
        if self._certificate_sha256 is not None and isinstance(secured, ssl.SSLSocket):
            shown = secured.getpeercert(binary_form=True) or b""
            if hashlib.sha256(shown).hexdigest() != self._certificate_sha256:
                connection.close()
                raise InputError(f"{self.address} shows another certificate than the server of this database")
        if isinstance(secured, socket.socket):
            secured.settimeout(None)
            # A computation of an hour says nothing meanwhile; that the server is still there is asked below HTTP.
            secured.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        return connection

    def _read(self, question: str, document: Mapping[str, Any], response: http.client.HTTPResponse) -> Any:
        kind = (response.getheader("Content-Type") or "").partition(";")[0]
        if response.status != 200:
            raise self._refusal(response.status, kind, response.read(2**20))
        if kind == MEDIA_TYPE:
            with tempfile.TemporaryFile() as parcel:
                for chunk in iter(lambda: response.read(2**20), b""):
                    parcel.write(chunk)
                answered, _ = unpacked_answer(question, parcel, document)
        elif kind == _JSON:
            answered = json.loads(response.read())
        else:
            raise InputError(f"{self.address} answers {kind or 'nothing'}: it is no server of monitor")
        try:
            return answer_from_document(QUESTIONS[question].answer, answered)
        except (InputError, TypeError, ValueError, KeyError) as error:
            raise InputError(
                f"the answer of {self.address} is not understood ({error}); this is monitor {__version__}, and "
                f"{self.address}{ROOT}/openapi.json says which the server is: use the same"
            ) from error

    def _refusal(self, status: int, kind: str, body: bytes) -> Exception:
        """Return what the server refused as the command itself would have raised it."""
        try:
            content = json.loads(body) if kind == _JSON else {}
            text = str(content.get("in_full") or content["error"])
        except (ValueError, KeyError, AttributeError):
            return InputError(f"{self.address} answers with status {status}: it is no server of monitor")
        if status == 503:
            # Its database was replaced, or it has too much to do: no fault of the software.
            return InputError(f"{self.address}: {text}")
        if status >= 500:
            return ServerFaultError(f"{self.address}: {text}")
        if status == 401:
            how = "no token was sent" if not self._token else "nobody there has this token"
            return InputError(
                f"{self.address} lets nobody in without a token ({how}): --server-token FILE, or the environment "
                "variable MONITOR_SERVER_TOKEN_FILE, names the file that holds it"
            )
        return NotFoundError(text) if status == 404 else InputError(text)


def _document(question: str, request: object) -> dict[str, Any]:
    """Return the document of a request without what stays here. Raises InputError where that was asked for."""
    document = {} if request is None else to_document(request)
    travels = {*travelling(question).incoming, *travelling(question).outgoing}
    for name, why in STAYING.items():
        if name in document and name not in travels:
            if document[name] not in (None, False):
                raise InputError(f"this cannot be asked of a server: {why}")
            del document[name]
    for name in (*_LEFT_TO_THE_SERVER, *(name for name in travels if document.get(name) is None)):
        document.pop(name, None)
    return document


def server_of_note(note: Note, tolerances: Mapping[str, Mapping[str, float]] | None = None) -> Server:
    """Return the server that a note beside a database names."""
    return Server(
        address_of_server(note.address), note.secret,
        certificate_sha256=note.certificate_sha256, tolerances=tolerances,
    )  # fmt: skip


def token_in(file: Path) -> str:
    """Return the token that the first line of a file is. Raises InputError."""
    try:
        lines = read_bounded(file, LARGEST_SETTINGS).decode("ascii").split()
    except (OSError, ValueError) as error:
        raise InputError(f"the file of the token {file} cannot be read: {error}") from error
    if not lines:
        raise InputError(f"{file} is empty; it has to hold the token, as `serve --add-user` printed it")
    return lines[0]
