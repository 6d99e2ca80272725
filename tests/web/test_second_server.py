"""A second server says where the first one is: of the same database its address, of the same port who has it."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest

from monitor.exceptions import InputError
from monitor.store import Database
from monitor.web.listening import listening
from monitor.web.note import Note, posted
from monitor.web.server import serve
from monitor.web.settings import ServerSettings


def unsaid(text: str) -> None:
    pytest.fail(f"it serves: {text}")


def test_a_database_that_is_served_is_not_served_twice(tmp_path: Path) -> None:
    path = tmp_path / "shop.duckdb"
    Database(path).close()
    with (
        posted(path, Note("https://127.0.0.1:8765", "secret", 4711)),
        pytest.raises(
            InputError,
            match=r"shop\.duckdb is served already, at https://127\.0\.0\.1:8765/ \(PID 4711\): open",
        ),
    ):
        serve(ServerSettings(database=path, port=0), unsaid)


def test_who_has_the_port_is_said_before_a_database_is_made(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as first:
        port = first.getsockname()[1]
        with pytest.raises(
            InputError,
            match=rf"port {port} of 127\.0\.0\.1 is taken by .*\(PID {os.getpid()}\), which answers there",
        ):
            serve(ServerSettings(database=tmp_path / "new.duckdb", port=port), unsaid)
    assert list(tmp_path.iterdir()) == []


def test_a_host_that_is_none_of_this_computer() -> None:
    with pytest.raises(InputError, match=r"--host 192\.0\.2\.1: no port can be had at that address"):
        listening("192.0.2.1", 0)
    with pytest.raises(InputError, match=r"--host nohost\.invalid: no address is known of that name"):
        listening("nohost.invalid", 0)


def test_a_name_of_several_addresses_listens_at_all_that_there_are() -> None:
    sockets = listening("localhost", 0)
    try:
        with socket.create_connection(("127.0.0.1", sockets[-1].getsockname()[1])):
            assert {taken.getsockname()[0] for taken in sockets} <= {"127.0.0.1", "::1"}
    finally:
        for taken in sockets:
            taken.close()
