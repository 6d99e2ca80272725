"""The sockets of a server, taken before anything else is done: a port that somebody has is refused with who has it."""

from __future__ import annotations

import contextlib
import errno
import os
import socket
from pathlib import Path

from monitor.exceptions import InputError
from monitor.store import activity

#: Of /proc/net/tcp (proc(5)): the columns of address, state and inode, and the state of a socket that listens.
_ADDRESS, _STATE, _INODE, _LISTENS = 1, 3, 9, "0A"
#: Connections that wait to be taken, as many as uvicorn lets wait.
_BACKLOG = 2048
#: An address that this computer does not have, or a kind of addresses.
_NOT_HERE = (errno.EADDRNOTAVAIL, errno.EAFNOSUPPORT)


def listening(host: str, port: int) -> list[socket.socket]:
    """Return sockets that listen at every address of a host; port 0 is any free one.

    Raises InputError where the port is taken or may not be had, or the host is none of this computer.
    """
    try:
        resolved = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    except (OSError, UnicodeError) as fault:
        raise InputError(f"--host {host}: no address is known of that name ({fault})") from fault
    sockets: list[socket.socket] = []
    missing: OSError | None = None
    for family, _, _, _, address in dict.fromkeys(resolved):
        try:
            sockets.append(socket.create_server(address[:2], family=family, backlog=_BACKLOG))
        except OSError as fault:
            if fault.errno in _NOT_HERE:
                # A name may stand for an address of IPv6 on a computer without it.
                missing = fault
                continue
            for taken in sockets:
                taken.close()
            raise InputError(_in_words(host, port, fault)) from fault
    if missing is not None and not sockets:
        raise InputError(_in_words(host, port, missing)) from missing
    return sockets


def _in_words(host: str, port: int, fault: OSError) -> str:
    if fault.errno == errno.EADDRINUSE:
        return (
            f"port {port} of {host} is taken by {_holder(port) or 'another program'}, which answers there: stop it, or "
            "serve at another port (--port N; 0 takes any free one)"
        )
    if fault.errno in (errno.EACCES, errno.EPERM):
        return f"port {port} of {host} may not be used by this user; the ports from 1024 on may: --port N"
    return f"--host {host}: no port can be had at that address: {fault.strerror or fault}"


def _holder(port: int) -> str:
    """Return what has a port, with its PID; empty where the system does not say, as of processes of others."""
    inodes = set(_inodes(port))
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            for descriptor in (process / "fd").iterdir():
                with contextlib.suppress(OSError):
                    if os.readlink(descriptor) in inodes:
                        return f"{activity(int(process.name)) or 'a program'} (PID {process.name})"
    return ""


def _inodes(port: int) -> list[str]:
    """Return what the descriptors of sockets that listen at a port link to."""
    lines: list[list[str]] = []
    for table in ("tcp", "tcp6"):
        with contextlib.suppress(OSError):
            lines += [line.split() for line in Path(f"/proc/net/{table}").read_text().splitlines()[1:]]
    return [
        f"socket:[{line[_INODE]}]"
        for line in lines
        if line[_STATE] == _LISTENS and int(line[_ADDRESS].rpartition(":")[2], 16) == port
    ]
