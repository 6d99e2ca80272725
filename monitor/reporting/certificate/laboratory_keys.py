"""The sections and keys of a laboratory's file, and which of them answers an item of a certificate."""

from __future__ import annotations

import re
from collections.abc import Mapping

from monitor.reporting.texts import Texts

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


#: The words of a reference in a certificate's language, and the key that answers what is missing of it.
_KEY_OF_REFERENCE = {
    "record.instrument": "[traceability] instruments",
    "record.probe": "[traceability] probe",
    "record.bar": "[traceability] scale_bar",
}
#: The one item that a campaign answers and need not state.
ARTEFACT_KEY = "[artefact] id in campaign.toml, withdraw the campaign and import the folder again"


def key_of(name: str, part: str, texts: Texts) -> str:
    """The key of the laboratory's file that answers an item of a certificate or a ``part`` of it; empty: none does.

    ``name`` is that of a field of ``CertificateRecord``: ``key_of("customer", "contact", texts)`` is ``[customer]
    contact``; a part of a reference or condition has its words in the language of ``texts``.
    """
    word = re.split(r"[ :]", part)[0]
    if name == "references":
        return next((key for kind, key in _KEY_OF_REFERENCE.items() if _names(part, texts.sentences[kind])), "")
    if name == "conditions":
        return ARTEFACT_KEY if part.endswith(f" {texts('record.artefact')}") else ""
    section = _SECTION_OF.get(name)
    if section is None:
        return "" if name == "method" and word != "document" else _KEY_OF.get(name, "")
    title = f"[[{section}]]" if section in REPEATED else f"[{section}]"
    if not part:
        return f"{title} {', '.join(key for key in SECTIONS[section] if key in _PARTS)}"
    return f"{title} {word}" if word in SECTIONS[section] else ""


def _names(part: str, template: str) -> bool:
    """Whether a part of an item names what ``template`` says with its places filled in."""
    words = (re.escape(text) for text in re.split(r"\{\w+\}", template))
    return re.search(f"(^| of ){'.+'.join(words)}(: |$)", part) is not None
