"""A second server says where the first one is: of the same database its address, of the same port who has it."""

from __future__ import annotations

import errno
import os
import socket
import subprocess
import sys
from ipaddress import ip_address
from pathlib import Path
from typing import Any

import pytest

from monitor.exceptions import InputError
from monitor.store import Database
from monitor.web.listening import _address_of, _keeps_from, listening
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


_LISTENING = """
import socket, sys
with socket.create_server(("127.0.0.2", int(sys.argv[1]))):
    print("listens", flush=True)
    sys.stdin.read()
"""


def test_who_has_the_port_of_another_address_is_not_named() -> None:
    """Two programs may have one port number at two addresses: whichever came first in the table was named."""
    with socket.create_server(("127.0.0.1", 0)) as first:
        port = first.getsockname()[1]
        with subprocess.Popen(
            [sys.executable, "-c", _LISTENING, str(port)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        ) as other:
            assert other.stdout is not None
            assert other.stdin is not None
            assert other.stdout.readline() == b"listens\n"
            for address, holder in (("127.0.0.1", os.getpid()), ("127.0.0.2", other.pid)):
                with pytest.raises(InputError, match=rf"is taken by .*\(PID {holder}\), which answers there"):
                    listening(address, port)
            other.stdin.close()


@pytest.mark.parametrize(
    ("held", "wanted", "keeps"),
    [
        ("0100007F", "127.0.0.1", True),
        ("0100007F", "127.0.0.2", False),
        ("0100007F", "0.0.0.0", True),
        ("0100007F", "::", False),
        ("00000000", "127.0.0.1", True),
        ("00000000", "::1", False),
        ("00000000000000000000000000000000", "127.0.0.1", True),
        ("00000000000000000000000001000000", "::1", True),
        ("0000000000000000FFFF00000100007F", "127.0.0.1", True),
    ],
)
@pytest.mark.skipif(sys.byteorder == "big", reason="the words of proc(5) are those of the processor")
def test_which_listeners_of_the_table_keep_others_from_an_address(
    held: str, wanted: str, *, keeps: bool
) -> None:
    assert _keeps_from(_address_of(held), ip_address(wanted)) is keeps


def two_addresses(*asked: object, **options: object) -> list[tuple[Any, ...]]:
    """What a resolver says of a name that stands for two addresses."""
    return [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (name, 0)) for name in ("127.0.0.1", "127.0.0.2")]


def test_a_name_of_two_addresses_has_one_port_that_is_free_at_both(monkeypatch: pytest.MonkeyPatch) -> None:
    """With port 0 each address got a port of its own, and one of them was told."""
    monkeypatch.setattr(socket, "getaddrinfo", two_addresses)
    original, refused = socket.create_server, list[int]()

    def taken_once(address: tuple[str, int], **options: Any) -> socket.socket:
        if address[0] == "127.0.0.2" and not refused:
            refused.append(address[1])
            raise OSError(errno.EADDRINUSE, "Address already in use")
        return original(address, **options)

    monkeypatch.setattr(socket, "create_server", taken_once)
    sockets = listening("name", 0)
    try:
        assert [taken.getsockname()[0] for taken in sockets] == ["127.0.0.1", "127.0.0.2"]
        (port,) = {taken.getsockname()[1] for taken in sockets}
        assert refused[0] not in (0, port)
    finally:
        for taken in sockets:
            taken.close()


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
