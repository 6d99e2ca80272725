"""Electronic signatures on certificates: PAdES baseline B-B (ETSI EN 319 142-1:2016, 6) by pyHanko, an optional extra.

The signature is appended to the PDF, which stays as it was below it: PDF/A, its attachments, every byte. It
certifies the document: no change is allowed afterwards.
"""

from __future__ import annotations

import io
import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from monitor.exceptions import InputError

_FIELD = "Signature"
#: Where the signature's own bytes are kept; a certificate chain of three with RSA 4096 needs about 12 000.
_ROOM_BYTES = 32_768


@dataclass(frozen=True)
class SignatureFinding:
    """What a file's signature says: None for ``good`` where it carries none."""

    good: bool | None
    signer: str | None
    faults: tuple[str, ...]


def sign(pdf: bytes, key_file: Path, passphrase: str | None) -> bytes:
    """The PDF with a signature by the key and certificates of a PKCS#12 file.

    Raises InputError where pyHanko is not installed, or the file cannot be read or opened with the passphrase.
    """
    _needed()
    from pyhanko.pdf_utils.incremental_writer import IncrementalPdfFileWriter
    from pyhanko.sign import fields, signers

    try:
        content = key_file.read_bytes()
    except OSError as error:
        raise InputError(f"the key file {key_file} cannot be read: {error.strerror or error}") from error
    signer = _signer(signers, content, passphrase)
    if signer is None:
        raise InputError(f"{key_file} is no PKCS#12 file with a key, or its passphrase is another")
    meta = signers.PdfSignatureMetadata(
        field_name=_FIELD,
        md_algorithm="sha256",
        subfilter=fields.SigSeedSubFilter.PADES,
        certify=True,
        docmdp_permissions=fields.MDPPerm.NO_CHANGES,
    )
    out = io.BytesIO()
    signers.sign_pdf(
        IncrementalPdfFileWriter(io.BytesIO(pdf)), meta, signer=signer, output=out, bytes_reserved=_ROOM_BYTES
    )
    return out.getvalue()


def check_signature(pdf: bytes, trusted: Path | None = None) -> SignatureFinding:
    """Whether a PDF's signature covers the whole file and fits it.

    ``trusted`` is a PEM or DER file with the certificates that a signer's must lead to; without one nothing is
    said of who signed beyond the name in the certificate. Never raises for the file's own faults: they are the
    finding. Raises InputError where pyHanko is not installed or ``trusted`` cannot be read.
    """
    _needed()
    from pyhanko.pdf_utils.reader import PdfFileReader
    from pyhanko.sign.validation import validate_pdf_signature
    from pyhanko.sign.validation.status import SignatureCoverageLevel

    context = _context(trusted)
    # What is wrong is the finding; pyHanko's own log says it again, with a traceback.
    logging.getLogger("pyhanko").setLevel(logging.CRITICAL)
    logging.getLogger("pyhanko_certvalidator").setLevel(logging.CRITICAL)
    try:
        found = PdfFileReader(io.BytesIO(pdf)).embedded_signatures
        if not found:
            return SignatureFinding(None, None, ())
        (one,) = found
        status = validate_pdf_signature(one, signer_validation_context=context)
        signer = one.signer_cert.subject.human_friendly
        clean = _room_is_clean(pdf, [int(number) for number in one.byte_range])
    except Exception as error:  # an altered file breaks the reader in as many ways as there are bytes
        return SignatureFinding(
            False, None, (f"the file's signature cannot be read: {_words(error)}: altered",)
        )
    faults = []
    if not status.intact:
        faults.append("the file was altered after it was signed")
    if not clean:
        faults.append("the room that the signature leaves unsigned was altered")
    if not status.valid:
        faults.append("the signature does not fit its certificate")
    if status.coverage != SignatureCoverageLevel.ENTIRE_FILE or not status.docmdp_ok:
        faults.append("the signature does not cover the whole file: something was added afterwards")
    if trusted is not None and not status.trusted:
        faults.append(f"the certificate of {signer} does not lead to a trusted one")
    return SignatureFinding(not faults, signer, tuple(faults))


def _room_is_clean(pdf: bytes, covered: list[int]) -> bool:
    """Whether the part that no signature can cover, its own, holds it and zeros alone (ISO 32000-2, 12.8.1).

    Without this a byte behind the signature, or the case of one of its hexadecimal digits, could be changed unseen.
    """
    start, length, after, _ = covered
    room = pdf[start + length : after]
    digits = room[1:-1]
    content = bytes.fromhex(digits.decode("ascii"))
    # DER: the length of the outermost SEQUENCE, in the short form or with so many octets (ITU-T X.690, 8.1.3).
    octets = content[1] & 0x7F if content[1] & 0x80 else 0
    size = int.from_bytes(content[2 : 2 + octets], "big") if octets else content[1]
    exact = content[: 2 + octets + size].hex().ljust(len(digits), "0").encode("ascii")
    return room[:1] == b"<" and room[-1:] == b">" and digits in (exact, exact.upper())


def _needed() -> None:
    try:
        import pyhanko  # noqa: F401
    except ImportError as error:
        raise InputError("signatures need pyHanko: pip install 'machine-health-monitor[sign]'") from error


def _signer(signers: Any, content: bytes, passphrase: str | None) -> Any:
    logging.getLogger("pyhanko").setLevel(logging.CRITICAL)
    try:
        return signers.SimpleSigner.load_pkcs12_data(
            content, other_certs=[], passphrase=None if passphrase is None else passphrase.encode()
        )
    except Exception:  # the library below raises by kind of fault; all mean the same to the user
        return None


def _context(trusted: Path | None) -> Any:
    from pyhanko.keys import load_certs_from_pemder
    from pyhanko_certvalidator import ValidationContext

    if trusted is None:
        return ValidationContext(trust_roots=[], allow_fetching=False)
    try:
        roots = list(load_certs_from_pemder([str(trusted)]))  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise InputError(f"{trusted} cannot be read as certificates: {error}") from error
    return ValidationContext(trust_roots=roots, allow_fetching=False)


def _words(error: Exception) -> str:
    return str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
