"""The sockets of a server, taken before anything else is done: a port that somebody has is refused with who has it."""

from __future__ import annotations

import contextlib
import errno
import os
import socket
import sys
from collections.abc import Sequence
from ipaddress import IPv4Address, IPv6Address, ip_address
from pathlib import Path

from monitor.exceptions import InputError
from monitor.store import activity

#: Of /proc/net/tcp (proc(5)): the columns of address, state and inode, and the state of a socket that listens.
_ADDRESS, _STATE, _INODE, _LISTENS = 1, 3, 9, "0A"
#: Connections that wait to be taken, as many as uvicorn lets wait.
_BACKLOG = 2048
#: How many free ports are tried, of a name with several addresses.
_FREE_PORTS_TRIED = 20
#: An address that this computer does not have, or a kind of addresses.
_NOT_HERE = (errno.EADDRNOTAVAIL, errno.EAFNOSUPPORT)


def listening(host: str, port: int) -> list[socket.socket]:
    """Return sockets that listen at every address of a host, all at one port; 0 is any that is free at all of them.

    Raises InputError where the port is taken or may not be had, or the host is none of this computer.
    """
    try:
        resolved = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    except (OSError, UnicodeError) as fault:
        raise InputError(f"--host {host}: no address is known of that name ({fault})") from fault
    addresses = tuple(dict.fromkeys((family, str(address[0])) for family, _, _, _, address in resolved))
    for remaining in reversed(range(_FREE_PORTS_TRIED)):
        try:
            return _at_every(addresses, port)
        except _NotHadError as refused:
            # A port that is free at one address may be taken at the next.
            if port != 0 or refused.fault.errno != errno.EADDRINUSE or not remaining:
                raise InputError(_in_words(host, port, refused)) from refused.fault
    raise AssertionError("the last try returns or raises")


class _NotHadError(Exception):
    """An address at which no socket could be had, and why."""

    def __init__(self, address: str, fault: OSError) -> None:
        super().__init__(address)
        self.address, self.fault = address, fault


def _at_every(addresses: Sequence[tuple[int, str]], port: int) -> list[socket.socket]:
    """Return a socket at each address (family and text), all at one port. Raises _NotHadError, and keeps none then."""
    sockets: list[socket.socket] = []
    missing: _NotHadError | None = None
    for family, address in addresses:
        number = sockets[0].getsockname()[1] if sockets else port
        try:
            sockets.append(socket.create_server((address, number), family=family, backlog=_BACKLOG))
        except OSError as fault:
            missing = _NotHadError(address, fault)
            if fault.errno in _NOT_HERE:
                # A name may stand for an address of IPv6 on a computer without it.
                continue
            for taken in sockets:
                taken.close()
            raise missing from fault
    if missing is not None and not sockets:
        raise missing
    return sockets


def _in_words(host: str, port: int, refused: _NotHadError) -> str:
    fault = refused.fault
    if fault.errno == errno.EADDRINUSE:
        holder = _holder(refused.address, port) or "another program"
        return (
            f"port {port} of {host} is taken by {holder}, which answers there: stop it, or "
            "serve at another port (--port N; 0 takes any free one)"
        )
    if fault.errno in (errno.EACCES, errno.EPERM):
        return f"port {port} of {host} may not be used by this user; the ports from 1024 on may: --port N"
    return f"--host {host}: no port can be had at that address: {fault.strerror or fault}"


def _holder(address: str, port: int) -> str:
    """Return what has a port of an address, with its PID; empty where the system does not say, as of processes of
    others."""
    inodes = set(_inodes(address, port))
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            for descriptor in (process / "fd").iterdir():
                with contextlib.suppress(OSError):
                    if os.readlink(descriptor) in inodes:
                        return f"{activity(int(process.name)) or 'a program'} (PID {process.name})"
    return ""


def _inodes(address: str, port: int) -> list[str]:
    """Return what the descriptors of sockets link to that listen at a port where they keep others from an address."""
    wanted = ip_address(address)
    lines: list[list[str]] = []
    for table in ("tcp", "tcp6"):
        with contextlib.suppress(OSError):
            lines += [line.split() for line in Path(f"/proc/net/{table}").read_text().splitlines()[1:]]
    return [
        f"socket:[{line[_INODE]}]"
        for line in lines
        if line[_STATE] == _LISTENS
        and int(line[_ADDRESS].rpartition(":")[2], 16) == port
        and _keeps_from(_address_of(line[_ADDRESS].rpartition(":")[0]), wanted)
    ]


def _address_of(digits: str) -> IPv4Address | IPv6Address:
    """Return the address that the digits of the table stand for: words of 32 bits as this processor orders them."""
    octets = b"".join(
        int(digits[begin : begin + 8], 16).to_bytes(4, sys.byteorder) for begin in range(0, len(digits), 8)
    )
    address = ip_address(octets)
    return getattr(address, "ipv4_mapped", None) or address


def _keeps_from(held: IPv4Address | IPv6Address, wanted: IPv4Address | IPv6Address) -> bool:
    """Whether who listens at an address keeps others from listening at the wanted one, at the same port."""
    if held.is_unspecified:
        # At all addresses of IPv6 one listens mostly at those of IPv4, too.
        return held.version >= wanted.version
    return held == wanted or (wanted.is_unspecified and held.version == wanted.version)
