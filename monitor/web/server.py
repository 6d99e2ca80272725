"""Serves the pages and the interface until somebody stops it."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from socket import socket

import uvicorn

from monitor.web.app import application
from monitor.web.opening import opened
from monitor.web.settings import ServerSettings


class _Server(uvicorn.Server):
    """A server that says where it listens once it does."""

    def __init__(self, config: uvicorn.Config, settings: ServerSettings, say: Callable[[str], None]) -> None:
        super().__init__(config)
        self._settings = settings
        self._say = say

    async def startup(self, sockets: list[socket] | None = None) -> None:
        """Listen; the port is the one that the system gave where none was named."""
        await super().startup(sockets)
        for server in self.servers:
            for listening in server.sockets:
                port = listening.getsockname()[1]
                scheme = "https" if self._settings.certificate is not None else "http"
                host = f"[{self._settings.host}]" if ":" in self._settings.host else self._settings.host
                self._say(
                    f"{self._settings.database} is served at {scheme}://{host}:{port}/ ; Ctrl-C ends it"
                )
                return


def serve(settings: ServerSettings, say: Callable[[str], None]) -> None:
    """Serve a database; returns when it was stopped. Raises NotFoundError, StoreError, InputError before it listens."""
    with tempfile.TemporaryDirectory(prefix="monitor-serve-") as folder:
        working_folder = Path(folder).resolve()
        with opened(settings.database, working_folder, must_exist=settings.reading_only) as db:
            gate = application(db, settings, working_folder)
            config = uvicorn.Config(
                gate, host=settings.host, port=settings.port, log_level="warning", server_header=False,
                ssl_certfile=settings.certificate, ssl_keyfile=settings.key, proxy_headers=False,
            )  # fmt: skip
            _Server(config, settings, say).run()
            gate.close()
