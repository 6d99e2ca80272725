"""What a certificate's electronic signature says: does it cover the whole file, fit it, and lead to a trusted one?

By pyHanko, an optional extra. Making signatures is ``signing``.
"""

from __future__ import annotations

import io
import logging
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from monitor.exceptions import InputError

#: Any of these bytes says that a file carries a signature, or did before somebody changed it.
_MARKS = (b"/ByteRange", b"/ETSI.CAdES.detached", b"/Adobe.PPKLite", b"/Type /Sig")


@dataclass(frozen=True)
class SignatureFinding:
    """What a file's signature says: None for ``good`` where it carries none."""

    good: bool | None
    signer: str | None
    faults: tuple[str, ...]


def is_signed(pdf: bytes) -> bool:
    """Whether a file carries a signature, whole or broken."""
    return any(mark in pdf for mark in _MARKS)


def check_signature(pdf: bytes, trusted: Path | None = None, at: datetime | None = None) -> SignatureFinding:
    """Whether a PDF's signature covers the whole file and fits it.

    ``trusted`` is a PEM or DER file with the certificates that a signer's must lead to; without one nothing is
    said of who signed beyond the name in the certificate. ``at`` (with an offset) is when the signature was there, as
    somebody else than the signer knows: certificates end, and what was signed before stays signed. Without it they
    have to be valid now (ETSI EN 319 102-1, 5.2.6: past validation needs a proof of existence). Never raises for the
    file's own faults: they are the finding. Raises InputError where pyHanko is not installed or ``trusted`` cannot be
    read.
    """
    need_pyhanko()
    from pyhanko.pdf_utils.reader import PdfFileReader
    from pyhanko.sign.validation import validate_pdf_signature
    from pyhanko.sign.validation.status import SignatureCoverageLevel

    moment = at or datetime.now(UTC)
    context = _context(trusted, moment)
    # What is wrong is the finding; pyHanko's own log says it again, with a traceback.
    logging.getLogger("pyhanko").setLevel(logging.CRITICAL)
    logging.getLogger("pyhanko_certvalidator").setLevel(logging.CRITICAL)
    try:
        found = PdfFileReader(io.BytesIO(pdf)).embedded_signatures
        if not found:
            lost = is_signed(pdf)
            words = ("the file carries a signature that is no field of it any more: altered",) if lost else ()
            return SignatureFinding(False if lost else None, None, words)
        (one,) = found
        status = validate_pdf_signature(one, signer_validation_context=context)
        signer = one.signer_cert.subject.human_friendly
        first, last = one.signer_cert.not_valid_before, one.signer_cert.not_valid_after
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
    if trusted is not None and not first <= moment <= last:
        faults.append(
            f"the certificate of {signer} is valid from {first:%Y-%m-%d} to {last:%Y-%m-%d}, not on {moment:%Y-%m-%d}"
        )
    elif trusted is not None and not status.trusted:
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


def need_pyhanko() -> None:
    """Raise InputError, with what to type, where the extra is not installed."""
    try:
        import pyhanko  # noqa: F401
    except ImportError as error:
        raise InputError("signatures need pyHanko: pip install 'machine-health-monitor[sign]'") from error


def _context(trusted: Path | None, moment: datetime) -> Any:
    from pyhanko.keys import load_certs_from_pemder
    from pyhanko_certvalidator import ValidationContext

    if trusted is None:
        return ValidationContext(trust_roots=[], allow_fetching=False, moment=moment)
    try:
        roots = list(load_certs_from_pemder([str(trusted)]))  # type: ignore[no-untyped-call]
    except OSError as error:
        raise InputError(f"{trusted} cannot be read: {error.strerror or error}") from error
    except ValueError as error:
        raise InputError(f"{trusted} holds no certificates in PEM or DER: {error}") from error
    return ValidationContext(trust_roots=roots, allow_fetching=False, moment=moment)


def _words(error: Exception) -> str:
    return str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
