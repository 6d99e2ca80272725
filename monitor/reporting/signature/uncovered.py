"""Judges the part of a signed PDF that no signature covers: the room that holds the signature itself, and in it the
labels of its container (CMS SignedData) that are not among the signed attributes (RFC 5652, 5.1 and 5.3).

Without this a byte behind the signature, the case of one of its hexadecimal digits, or a version number of its
container could be changed unseen.
"""

from __future__ import annotations

from typing import Any

#: The fields of a container and of the record of its signer that are signed or prove themselves; the others follow.
_OF_CONTAINER = ("encap_content_info", "certificates", "crls")
_OF_SIGNER = ("signed_attrs", "signature_algorithm", "signature", "unsigned_attrs")


def uncovered_is_exact(pdf: bytes, signature: Any) -> bool:
    """Return whether the room of a signature holds its container, as ``sign`` writes it, and zeros alone.

    ``signature`` is pyHanko's ``EmbeddedPdfSignature``, its room as in ISO 32000-2, 12.8.1. Raises what parsing an
    altered container raises.
    """
    start, length, after, _ = [int(number) for number in signature.byte_range]
    room = pdf[start + length : after]
    exact = _container(signature).hex().ljust(len(room) - 2, "0").encode("ascii")
    return room in (b"<" + exact + b">", b"<" + exact.upper() + b">")


def _container(signature: Any) -> bytes:
    """Return the DER encoding of a signature's container with all labels as they follow from what is signed."""
    from asn1crypto import cms

    signed, signer, certificate = signature.signed_data, signature.signer_info, signature.signer_cert
    digest = {"algorithm": signer["digest_algorithm"]["algorithm"].native}
    named = {"issuer": certificate.issuer, "serial_number": certificate.serial_number}
    record = cms.SignerInfo(
        {
            "version": "v1",
            "sid": cms.SignerIdentifier("issuer_and_serial_number", cms.IssuerAndSerialNumber(named)),
            "digest_algorithm": digest,
            **_present(signer, _OF_SIGNER),
        }
    )
    content = cms.SignedData(
        {
            "version": "v1",
            "digest_algorithms": [digest],
            "signer_infos": [record],
            **_present(signed, _OF_CONTAINER),
        }
    )
    container: bytes = cms.ContentInfo({"content_type": "signed_data", "content": content}).dump()
    return container


def _present(fields: Any, names: tuple[str, ...]) -> dict[str, Any]:
    """Return the named fields of an ASN.1 sequence that it has, as they are."""
    from asn1crypto.core import VOID

    return {
        name: fields[name] for name in names if fields[name] is not VOID and fields[name].contents is not None
    }
