"""Who signed, or is to sign, a file."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Signer:
    """Who signs the file electronically: the name in the signing certificate, and that one's SHA-256, hexadecimal."""

    name: str
    sha256: str
