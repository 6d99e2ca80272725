"""Elements of a Digital Calibration Certificate: its releases, name spaces, texts and the vocabulary of refTypes."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

from monitor.exceptions import InputError
from monitor.reporting.texts import Texts

if TYPE_CHECKING:
    # A request names a release alone: it waits for nothing that a certificate states.
    from monitor.reporting.certificate.record import CertificateRecord

DCC = "https://ptb.de/dcc"
SI = "https://ptb.de/si"
#: Where the cross-community vocabulary with the prefix ``basic_`` is published (PTB and DKD, the good-practice
#: examples of DCC 3.3.0); the writer uses no other.
_VOCABULARY = "https://digilab.ptb.de/dkd/refType/vocab/index.php?tema=2"


class DccVersion(StrEnum):
    """The releases of the schema that are written; each names one release of D-SI."""

    V3_2_1 = "3.2.1"  # D-SI 2.1
    V3_3_0 = "3.3.0"  # D-SI 2.2.1

    @property
    def by_vocabulary(self) -> bool:
        """Whether elements name what they hold by refTypes, and conditions and standards are elements of their own."""
        return self is not DccVersion.V3_2_1


#: What a new certificate is written in, and what records without a version were written in.
NEWEST, BEFORE = DccVersion.V3_3_0, DccVersion.V3_2_1


def dcc_version(name: str) -> DccVersion:
    """The release of a name. Raises InputError for one that is not written here."""
    try:
        return DccVersion(name)
    except ValueError as error:
        raise InputError(
            f"there is no digital certificate after DCC {name} here; there are {', '.join(DccVersion)}"
        ) from error


def version_of(record: CertificateRecord) -> DccVersion:
    """The release that a record is written in. Raises InputError for one that is not written here."""
    return BEFORE if record.dcc_version is None else dcc_version(record.dcc_version)


def add(
    parent: ET.Element, tag: str, text: str | None = None, space: str = DCC, *, ref: str | None = None
) -> ET.Element:
    """A new last child with its text; ``ref`` is its refType."""
    child = ET.SubElement(parent, f"{{{space}}}{tag}")
    child.text = text
    if ref is not None:
        child.set("refType", ref)
    return child


def say(parent: ET.Element, tag: str, text: str, language: str) -> ET.Element:
    """An element whose text says in which language it is."""
    child = add(parent, tag)
    add(child, "content", text).set("lang", language)
    return child


def define_vocabulary(parent: ET.Element, texts: Texts) -> None:
    """Where the refTypes of the certificate are defined."""
    definition = add(add(parent, "refTypeDefinitions"), "refTypeDefinition")
    say(definition, "name", texts("dcc.vocabulary"), texts.language)
    add(definition, "namespace", "basic")
    add(definition, "link", _VOCABULARY)


def strip_vocabulary(root: ET.Element) -> None:
    """Take the refTypes away: DCC 3.2.1 was released here without them."""
    for element in root.iter():
        element.attrib.pop("refType", None)
