"""The sections and keys of a laboratory's file, and which of them answers an item of a certificate."""

from __future__ import annotations

import re
from collections.abc import Mapping

#: Every section and its keys.
SECTIONS: Mapping[str, tuple[str, ...]] = {
    "laboratory": (
        "name",
        "address",
        "contact",
        "accreditation",
        "country",
        "dcc_version",
        "language",
        "mark",
    ),
    "accreditation": ("body", "number"),
    "customer": ("name", "address", "contact"),
    "item": ("description", "identification", "condition", "place", "received_on"),
    "method": ("document",),
    "traceability": ("statement", "probe", "scale_bar", "instruments"),
    "standards": ("name", "identification", "certificate", "issuer", "issued_on", "valid_until"),
    "temperature": ("machine_degC", "machine_U_degC", "standard_degC", "standard_U_degC", "reference"),
    "statements": (
        "title",
        "sampling",
        "relates_only",
        "deviations",
        "external_results",
        "reproduction",
        "adjustment",
        "conformity",
        "opinions",
    ),
    "authorised_by": ("name", "function"),
}
#: Sections of which there may be several.
REPEATED = frozenset({"authorised_by", "standards"})
#: Items of a certificate whose parts are the keys of one section, and of those that are one key.
_SECTION_OF = {
    "laboratory": "laboratory",
    "customer": "customer",
    "item": "item",
    "authorised_by": "authorised_by",
    "accredited": "accreditation",
    "standards": "standards",
}
_PARTS = frozenset({"name", "address", "contact", "function", "description", "identification", "condition"})
_KEY_OF = {
    "place": "[item] place",
    "received_on": "[item] received_on",
    "method": "[method] document",
    "traceability": "[traceability] statement",
    **{key: f"[statements] {key}" for key in SECTIONS["statements"]},
}


def key_of(name: str, part: str) -> str:
    """The key of the laboratory's file that answers an item of a certificate or a ``part`` of it; empty: none does.

    ``name`` is that of a field of ``CertificateRecord``: ``key_of("customer", "contact")`` is ``[customer] contact``.
    """
    word = re.split(r"[ :]", part)[0]
    if name == "references":
        if "instrument" in part:
            return "[traceability] instruments"
        return "[traceability] probe" if "probe" in part else "[traceability] scale_bar"
    section = _SECTION_OF.get(name)
    if section is None:
        return "" if name == "method" and word != "document" else _KEY_OF.get(name, "")
    title = f"[[{section}]]" if section in REPEATED else f"[{section}]"
    if not part:
        return f"{title} {', '.join(key for key in SECTIONS[section] if key in _PARTS)}"
    return f"{title} {word}" if word in SECTIONS[section] else ""
