"""Who is trusted to sign: certificates that a signer's has to lead to, or fingerprints of the signers themselves.

Two kinds of file are read: certificates in PEM or DER (a laboratory's own, or an authority's), and a text with a
SHA-256 fingerprint in each line, as `certificate verify` prints it; what follows a # is a note.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from monitor.bounded import LARGEST_DOCUMENT, read_bounded
from monitor.exceptions import InputError

_FINGERPRINT = re.compile(r"[0-9a-f]{64}")


@dataclass(frozen=True)
class TrustedSigners:
    """Certificates (``asn1crypto.x509.Certificate``) that a signer's may lead to, and fingerprints of signers."""

    roots: tuple[Any, ...] = ()
    fingerprints: frozenset[str] = frozenset()


def read_trusted(file: Path) -> TrustedSigners:
    """Read a file of trusted signers. Raises InputError where it cannot be read or holds none."""
    try:
        content = read_bounded(file, LARGEST_DOCUMENT)
    except OSError as error:
        raise InputError(f"{file} cannot be read: {error.strerror or error}") from error
    fingerprints = _fingerprints(content)
    if fingerprints is not None:
        return TrustedSigners(fingerprints=fingerprints)
    from pyhanko.keys import load_certs_from_pemder_data

    try:
        roots = tuple(load_certs_from_pemder_data(content))
        # Parsed only where it is looked at.
        for root in roots:
            root.subject.native  # noqa: B018
    except ValueError as error:
        raise _refusal(file) from error
    if not roots:
        raise _refusal(file)
    return TrustedSigners(roots)


def _refusal(file: Path) -> InputError:
    return InputError(
        f"{file} holds no certificates in PEM or DER, and no fingerprints (SHA-256, 64 hexadecimal digits a line)"
    )


def _fingerprints(content: bytes) -> frozenset[str] | None:
    """Return the fingerprints of a text that holds nothing else; None for another file."""
    try:
        lines = [line.partition("#")[0] for line in content.decode("utf-8-sig").splitlines()]
    except UnicodeDecodeError:
        return None
    written = [re.sub(r"[\s:]", "", line).lower() for line in lines if line.strip()]
    if not written or not all(map(_FINGERPRINT.fullmatch, written)):
        return None
    return frozenset(written)
