"""Ends connections whose request does not come: uvicorn waits for the rest of its headers without end.

Whoever opens many connections and sends a few bytes on each (Slowloris) would hold every file handle of the server.
"""

from __future__ import annotations

import asyncio

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

#: As Apache's mod_reqtimeout gives the headers at least (``RequestReadTimeout header=20-40``).
HEADERS_S = 20.0


class ImpatientProtocol(H11Protocol):
    """HTTP/1.1 of uvicorn; closes a connection when the headers of its request are not whole after ``headers_s``.

    The time runs from the opening of the connection, and later from the first byte of each further request; between
    requests uvicorn's own ``timeout_keep_alive`` holds. Under TLS asyncio limits the handshake before it (60 s).
    """

    headers_s = HEADERS_S
    _deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin to wait for the first request."""
        assert isinstance(transport, asyncio.Transport)
        super().connection_made(transport)
        self._set_deadline()

    def data_received(self, piece: bytes) -> None:
        """Take what came; wait on where it is no whole request yet."""
        super().data_received(piece)
        self._set_deadline()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait for nothing any more."""
        self._forget_deadline()
        super().connection_lost(exc)

    def _set_deadline(self) -> None:
        # IDLE: nothing of a request is understood yet; pieces do not set the time back.
        if self.conn.their_state is not h11.IDLE or self.transport.is_closing():
            self._forget_deadline()
        elif self._deadline is None:
            self._deadline = self.loop.call_later(self.headers_s, self.transport.close)

    def _forget_deadline(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None
