"""Serves the pages and the interface until somebody stops it."""

from __future__ import annotations

import hashlib
import importlib
import ipaddress
import os
import signal
import ssl
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import uvicorn

from monitor.bounded import LARGEST_SETTINGS, read_bounded
from monitor.exceptions import InputError
from monitor.web.app import application
from monitor.web.ending import EndingServer, cut_off_at_the_end
from monitor.web.gate import Gate
from monitor.web.listening import listening
from monitor.web.note import Note, posted, read_note
from monitor.web.opening import opened
from monitor.web.rendering import prepare
from monitor.web.settings import ServerSettings
from monitor.web.slow_clients import ImpatientProtocol
from monitor.workflow.contract import QUESTIONS

#: A page asks some ten short queries, and waits so long behind every computation to go on after each (Python's usual
#: 5 ms make it twice as slow while two trends are computed).
_SWITCH_S = 0.0005
#: So long a server leaves both cores to its first page before it loads the questions that people ask next.
_HEAD_START_S = 0.5
_USUAL = ("fleet", "campaigns", "values", "trend", "compare", "explain", "import")


def serve(settings: ServerSettings, say: Callable[[str], None]) -> None:
    """Serve a database; returns when it was stopped. Raises NotFoundError, StoreError, InputError before it listens."""
    fingerprint = _checked_certificate(settings)
    _refuse_served(settings.database)
    sockets = listening(settings.host, settings.port)
    _end_in_order()
    with tempfile.TemporaryDirectory(prefix="monitor-serve-") as folder, ExitStack() as beside:
        for taken in sockets:
            beside.callback(taken.close)
        working_folder = Path(folder).resolve()
        with opened(settings.database, working_folder, must_exist=settings.reading_only) as served:
            if served.unwritten is not None:
                settings = replace(settings, reading_only=True)
                say(
                    f"{served.unwritten}: nobody can change anything here; what others store is seen with the next page"
                )
            gate = application(served.db, settings, working_folder, served.copies)
            config = configuration(gate, settings)
            scheme = "http" if settings.certificate is None else "https"

            def listens(port: int) -> None:
                note = Note(
                    _address(scheme, _reached_at(settings.host), port),
                    gate.sessions.owner_secret,
                    os.getpid(),
                    fingerprint,
                )
                if not beside.enter_context(posted(settings.database, note)):
                    say(
                        "no note could be written beside the database: other commands have to name this address"
                    )
                threading.Thread(target=_load_ahead, daemon=True).start()
                say(
                    f"{settings.database} is served at {_address(scheme, settings.host, port)}/ ; Ctrl-C ends it"
                )

            prepare()
            sys.setswitchinterval(_SWITCH_S)
            with cut_off_at_the_end(working_folder):
                try:
                    EndingServer(config, gate.desk, say, listens, beside.close).run(sockets)
                finally:
                    beside.close()
                    gate.desk.close(waiting=False)


def _refuse_served(database: Path) -> None:
    """Raise InputError where a server of this account has the database."""
    note = read_note(database)
    if note is not None:
        raise InputError(
            f"{database} is served already, at {note.address}/ (PID {note.pid}): open that, or stop it first"
        )


def configuration(gate: Gate, settings: ServerSettings) -> uvicorn.Config:
    """Return how the server listens."""
    return uvicorn.Config(
        gate, host=settings.host, port=settings.port, log_level="warning", server_header=False,
        ssl_certfile=settings.certificate, ssl_keyfile=settings.key, proxy_headers=False, http=ImpatientProtocol,
    )  # fmt: skip


def _end_in_order() -> None:
    """Let SIGTERM, by which services and containers are stopped, leave through every block, as Ctrl-C does.

    uvicorn ends its work at the signal and then raises it anew, for whoever handled it before: that nobody did would
    end the process with the database open, its log not brought in, and note and folder left behind.
    """
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(0))


def _load_ahead() -> None:
    """Load what the second page will need, a moment after the first could be asked for."""
    time.sleep(_HEAD_START_S)
    importlib.import_module("pandas")
    for question in _USUAL:
        QUESTIONS[question].load()


def _address(scheme: str, host: str, port: int) -> str:
    return f"{scheme}://{f'[{host}]' if ':' in host else host}:{port}"


def _reached_at(host: str) -> str:
    """Return the address at which this computer itself reaches a server that listens at ``host``."""
    try:
        address = ipaddress.ip_address(host)
    except ValueError:
        return host
    if not address.is_unspecified:
        return host
    return "127.0.0.1" if address.version == 4 else "::1"


def _checked_certificate(settings: ServerSettings) -> str | None:
    """Return the SHA-256 of the certificate of TLS. Raises InputError where certificate and key cannot be used."""
    if settings.certificate is None or settings.key is None:
        return None
    try:
        for file in (settings.certificate, settings.key):
            # OpenSSL would wait for whoever writes into a pipe.
            read_bounded(file, LARGEST_SETTINGS)
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(
            settings.certificate, settings.key, password=""
        )
        text = settings.certificate.read_text(encoding="ascii", errors="replace")
        begin = text.index("-----BEGIN CERTIFICATE")
        first = text[begin : text.index("-----END CERTIFICATE-----", begin) + 25]
        return hashlib.sha256(ssl.PEM_cert_to_DER_cert(first)).hexdigest()
    except (OSError, ValueError) as error:
        raise InputError(
            f"--certificate {settings.certificate} and --key {settings.key} do not belong together, or are not in PEM "
            f"without a passphrase: {error}"
        ) from error
