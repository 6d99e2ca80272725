"""Where the server listens and who may come in: loopback alone, unless users and an encrypted way are named."""

from __future__ import annotations

import ipaddress
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from monitor.exceptions import InputError

DEFAULT_PORT = 8765
#: The largest upload: a folder of a year of campaigns takes some 20 MB, packed a tenth of it.
UPLOAD_BYTES = 64 * 2**20


def is_loopback(host: str) -> bool:
    """Whether a name or address is that of this computer alone."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


@dataclass(frozen=True)
class ServerSettings:
    """The database to serve, the address to listen at, and what protects it.

    ``users`` is the file of tokens (None: no log-in, loopback alone). ``certificate`` and ``key`` are PEM files of TLS;
    ``proxy`` is the name under which a proxy that does TLS is reached. ``reading_only`` makes everybody a viewer.
    ``tolerances`` are the limits by machine type of the configuration; ``trusted_signers`` is the file of those whose
    certificates are called genuine.
    """

    database: Path
    host: str = "127.0.0.1"
    port: int = DEFAULT_PORT
    users: Path | None = None
    certificate: Path | None = None
    key: Path | None = None
    proxy: str | None = None
    reading_only: bool = False
    tolerances: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    trusted_signers: Path | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.port <= 65535:
            raise InputError(f"--port {self.port}: a port lies between 0 and 65535")
        if (self.certificate is None) != (self.key is None):
            raise InputError("TLS needs both --certificate FILE and --key FILE (PEM)")
        for option, file in (
            ("--certificate", self.certificate),
            ("--key", self.key),
            ("--users", self.users),
        ):
            if file is not None and not file.is_file():
                raise InputError(f"{option} {file}: there is no such file")
        if self.is_loopback and self.proxy is None:
            return
        if self.users is None:
            raise InputError(
                f"{self.proxy or self.host} can be reached from other computers: name who may come in with --users "
                "FILE (`monitor serve --add-user NAME --users FILE` makes a token)"
            )
        if self.certificate is None and self.proxy is None:
            raise InputError(
                f"{self.host} can be reached from other computers, and tokens must not be sent in the clear: name "
                "--certificate FILE and --key FILE, or with --behind-proxy NAME the host name of a proxy that does TLS"
            )

    @property
    def is_loopback(self) -> bool:
        """Whether only this computer reaches the server."""
        return is_loopback(self.host)

    @property
    def is_encrypted(self) -> bool:
        """Whether browsers reach the server by https, so that its cookie may be sent by nothing else."""
        return self.certificate is not None or self.proxy is not None

    @property
    def hosts(self) -> frozenset[str] | None:
        """Names that a request may have in ``Host`` (without the port); None: any, where users log in directly.

        A page of another site may name this computer's loopback address under a name of its own (DNS rebinding).
        """
        if self.proxy is not None:
            return frozenset({self.proxy.lower(), "127.0.0.1", "localhost", "[::1]"})
        return frozenset({"127.0.0.1", "localhost", "[::1]"}) if self.is_loopback else None
