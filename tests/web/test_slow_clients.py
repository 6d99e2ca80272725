"""Who does not send a request is not waited for without end."""

from __future__ import annotations

import asyncio
import contextlib
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("fastapi", reason="the extra web is not installed")

import uvicorn
from uvicorn.server import ServerState

from monitor.web import gate
from monitor.web.server import configuration
from monitor.web.settings import ServerSettings
from monitor.web.slow_clients import HEADERS_S, ImpatientProtocol

#: Longer than any answer takes; a test that hangs fails by it.
PATIENCE_S = 30.0
REQUEST = b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"


class _Quick(ImpatientProtocol):
    headers_s = 0.2


async def _answer(scope: Any, receive: Any, send: Any) -> None:
    """An application that takes longer than headers may."""
    await asyncio.sleep(2.0 * _Quick.headers_s)
    headers = [(b"content-length", b"2")]
    await send({"type": "http.response.start", "status": 200, "headers": headers})
    await send({"type": "http.response.body", "body": b"ok"})


async def _said(pieces: list[bytes], pause_s: float) -> bytes:
    """All that a server sends until it closes the connection on which these pieces come."""
    config = uvicorn.Config(_answer, http=_Quick, lifespan="off", log_level="critical", timeout_keep_alive=1)
    config.load()
    state, loop = ServerState(), asyncio.get_running_loop()
    server = await loop.create_server(
        lambda: _Quick(config=config, server_state=state, app_state={}), "127.0.0.1"
    )
    async with server:
        reader, writer = await asyncio.open_connection(*server.sockets[0].getsockname()[:2])
        sending = asyncio.create_task(_send(writer, pieces, pause_s))
        said = await asyncio.wait_for(_until_closed(reader), PATIENCE_S)
        sending.cancel()
        writer.close()
    return said


async def _until_closed(reader: asyncio.StreamReader) -> bytes:
    said = b""
    # A piece that was on its way when the server closed is answered by a reset and not by an end.
    with contextlib.suppress(ConnectionResetError):
        while part := await reader.read(65536):
            said += part
    return said


async def _send(writer: asyncio.StreamWriter, pieces: list[bytes], pause_s: float) -> None:
    for piece in pieces:
        writer.write(piece)
        await asyncio.sleep(pause_s)


@pytest.mark.parametrize(
    ("pieces", "pause_s", "answers"),
    [
        ([], 0.0, 0),
        ([REQUEST[:20]], 0.0, 0),
        # Pieces do not set the time back: 1000 headers at 20 a second.
        ([REQUEST[:-2], *[b"x: y\r\n"] * 1000], 0.05, 0),
        # An answer takes as long as it takes, and so does the next request's.
        ([REQUEST + REQUEST], 0.0, 2),
        ([REQUEST, REQUEST], 0.6, 2),
        ([REQUEST, REQUEST[:20]], 0.6, 1),
    ],
)
def test_a_connection_without_a_whole_request_is_closed(
    pieces: list[bytes], pause_s: float, answers: int
) -> None:
    assert asyncio.run(_said(pieces, pause_s)).count(b"200 OK") == answers


def test_a_body_that_stops_is_refused(local: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """A large file may take long; what does not come at all is not waited for."""
    monkeypatch.setattr(gate, "BODY_PAUSE_S", 0.2)
    said: list[Any] = []
    pieces = [{"type": "http.request", "body": b"proof=", "more_body": True}] * 5

    async def receive() -> Any:
        # Four pauses that together are longer than one may be, then one that does not end.
        await asyncio.sleep(0.1 if pieces else PATIENCE_S)
        return pieces.pop()

    async def send(message: Any) -> None:
        said.append(message)

    headers = [(b"host", b"127.0.0.1:8765"), (b"content-type", b"application/x-www-form-urlencoded")]
    scope = {
        "type": "http", "method": "POST", "path": "/machine/event", "raw_path": b"/machine/event", "headers": headers,
        "query_string": b"", "scheme": "http", "http_version": "1.1", "root_path": "",
    }  # fmt: skip
    asyncio.run(local.client.app(scope, receive, send))
    assert not pieces
    assert said[0]["status"] == 408
    assert b"came for 0.2 s" in b"".join(message.get("body", b"") for message in said)


def test_the_server_listens_so(tmp_path: Path) -> None:
    config = configuration(_answer, ServerSettings(database=tmp_path / "none.duckdb"))  # type: ignore[arg-type]
    config.load()
    assert config.http_protocol_class is ImpatientProtocol
    assert ImpatientProtocol.headers_s == HEADERS_S
