"""Who signed, or is to sign, a file."""

from __future__ import annotations

import re
from dataclasses import dataclass

#: The name among the attributes of a subject as asn1crypto writes them: after ", ", or "; " where a value has a comma.
_COMMON = re.compile(r"(?:^|, |; )Common Name: (.*?)(?=(?:, |; )[A-Z][A-Za-z ]*: |$)")


@dataclass(frozen=True)
class Signer:
    """Who signs the file electronically: the name in the signing certificate, and that one's SHA-256, hexadecimal."""

    name: str
    sha256: str

    @property
    def common_name(self) -> str:
        """The name alone, without what it is called in the certificate and the organisation, country and so on."""
        named = _COMMON.search(self.name)
        return self.name if named is None else named[1]
