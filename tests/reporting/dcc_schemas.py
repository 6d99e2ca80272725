"""PTB's schemas of the digital certificate, as lxml validates by them: kept raw in tests/references/dcc."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

SCHEMAS = Path(__file__).resolve().parents[1] / "references" / "dcc"
#: The signature schema of the W3C, which the DCC's imports and this writer does not use: an element of any content.
SIGNATURE = """<xs:schema xmlns:xs="http://www.w3.org/2001/XMLSchema" targetNamespace="http://www.w3.org/2000/09/xmldsig#">
<xs:element name="Signature" type="xs:anyType"/></xs:schema>"""


def schema_of(release: str) -> Any:
    """The schema of a release, without anything fetched; the test is skipped where lxml is not installed."""
    etree = pytest.importorskip("lxml.etree", reason="lxml validates XML schemas")

    class Local(etree.Resolver):  # type: ignore[misc, name-defined]
        def resolve(self, url: str, public_id: str, context: object) -> object:
            if "xmldsig" in url:
                return self.resolve_string(SIGNATURE, context)
            if url == "https://ptb.de/si/v2.1.0/SI_Format.xsd":
                return self.resolve_filename(str(SCHEMAS / "SI_Format-2.1.0.xsd"), context)
            return None

    parser = etree.XMLParser(no_network=True)
    parser.resolvers.add(Local())
    return etree.XMLSchema(etree.parse(str(SCHEMAS / f"dcc-{release}.xsd"), parser))
