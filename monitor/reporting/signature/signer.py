"""Who signed, or is to sign, a file."""

from __future__ import annotations

from dataclasses import dataclass

#: What pyHanko writes before the name of a certificate's subject.
_COMMON = "Common Name: "


@dataclass(frozen=True)
class Signer:
    """Who signs the file electronically: the name in the signing certificate, and that one's SHA-256, hexadecimal."""

    name: str
    sha256: str

    @property
    def common_name(self) -> str:
        """The name alone, without what it is called in the certificate and the organisation, country and so on."""
        named = [part.removeprefix(_COMMON) for part in self.name.split(", ") if part.startswith(_COMMON)]
        return named[0] if named else self.name
