"""Checks an electronic signature: whether it covers the whole file, fits it, and leads to a trusted certificate.

By pyHanko, an optional extra. ``signing`` makes signatures.
"""

from __future__ import annotations

import io
import logging
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from monitor.exceptions import InputError
from monitor.reporting.signature.long_term import LongTermMaterial, material_in
from monitor.reporting.signature.signer import Signer
from monitor.reporting.signature.trust import TrustedSigners, read_trusted
from monitor.reporting.signature.uncovered import uncovered_is_exact

#: A file with any of these bytes carries a signature, or carried one before it was altered.
_MARKS = (b"/ByteRange", b"/ETSI.CAdES.detached", b"/Adobe.PPKLite", b"/Type /Sig")


@dataclass(frozen=True)
class SignatureFinding:
    """The finding about a file's signature: None for ``good`` where it carries none.

    ``stamped_at`` is when a time stamp authority saw it; None without a time stamp that fits the signature.
    ``signer_trusted``: whether the signer is a trusted one; never where nobody was named as such. ``long_term`` is the
    material for later validation, None without any; what it lacks is no fault of the signature. ``judged_until`` is
    when the file ceases to prove by itself who signed it, None for a signature that is not good: the end of the
    signer's certificate, or that of the time stamp's where the material suffices and it is later.
    """

    good: bool | None
    signer: Signer | None
    faults: tuple[str, ...]
    stamped_at: datetime | None = None
    signer_trusted: bool = False
    long_term: LongTermMaterial | None = None
    judged_until: datetime | None = None


def is_signed(pdf: bytes) -> bool:
    """Return whether a file carries a signature, whole or broken."""
    return any(mark in pdf for mark in _MARKS)


def check_signature(pdf: bytes, trusted: Path | None = None, at: datetime | None = None) -> SignatureFinding:
    """Check whether a PDF's signature covers the whole file and fits it.

    ``trusted`` is a file of trusted signers (``trust``); without one nothing is concluded about the signer beyond the
    name in the certificate, which whoever made the key chose. ``at`` (with an offset) is a time at which the
    signature existed, from another source than the signer: certificates end, and what was signed before stays signed.
    Without it they have to be valid today (ETSI EN 319 102-1, 5.2.6: past validation needs a proof of existence),
    unless the file's own time stamp and long-term material prove that it existed while they were.
    Never raises for the file's own faults: they are the finding. Raises InputError where pyHanko is not installed or
    ``trusted`` cannot be read.
    """
    need_pyhanko()
    from pyhanko.pdf_utils.reader import PdfFileReader
    from pyhanko.sign.validation import validate_pdf_signature

    moment = at or datetime.now(UTC)
    signers = TrustedSigners() if trusted is None else read_trusted(trusted)
    context = _context(signers, moment)
    # What is wrong is the finding; pyHanko's own log says it again, with a traceback.
    logging.getLogger("pyhanko").setLevel(logging.CRITICAL)
    logging.getLogger("pyhanko_certvalidator").setLevel(logging.CRITICAL)
    try:
        reader = PdfFileReader(io.BytesIO(pdf))
        signatures = reader.embedded_signatures
        if not signatures:
            return _without_signature(pdf)
        (signature,) = signatures
        status = validate_pdf_signature(signature, signer_validation_context=context)
        certificate = _Certificate(
            signer_in(signature.signer_cert),
            signature.signer_cert.not_valid_before,
            signature.signer_cert.not_valid_after,
        )
        exact = uncovered_is_exact(pdf, signature)
        stamped_at = _time_of_stamp(status)
        material = material_in(reader, signature, signers, stamped_at)
    except Exception as error:  # an altered file breaks the reader in as many ways as there are bytes
        message = f"the file's signature cannot be read: {_message(error)}: altered"
        return SignatureFinding(False, None, (message,))
    faults = _faults_of_file(status, exact)
    proven_at = _proven_at(material, stamped_at, moment)
    is_trusted = status.trusted or certificate.signer.sha256 in signers.fingerprints or proven_at is not None
    if trusted is not None:
        faults += _faults_of_signer(is_trusted, certificate, proven_at or moment)
    if status.timestamp_validity is not None and stamped_at is None:
        faults.append("the time stamp does not fit the signature")
    good = not faults
    return SignatureFinding(
        good,
        certificate.signer,
        tuple(faults),
        stamped_at,
        good and trusted is not None and is_trusted,
        material,
        _judged_until(material, certificate) if good else None,
    )


def _time_of_stamp(status: Any) -> datetime | None:
    """Return the time of a stamp that fits the signature; None without one."""
    stamp = status.timestamp_validity
    fits = stamp is not None and stamp.intact and stamp.valid
    return stamp.timestamp if fits else None


def _proven_at(
    material: LongTermMaterial | None, stamped_at: datetime | None, moment: datetime
) -> datetime | None:
    """Return the time of the stamp where it still proves, at a moment, that the signature existed then."""
    if material is None or material.until is None or moment > material.until:
        return None
    return stamped_at


def _judged_until(material: LongTermMaterial | None, certificate: _Certificate) -> datetime:
    """Return when the file alone ceases to suffice: with the signer's certificate, or a later one of the stamp."""
    return (
        certificate.last
        if material is None or material.until is None
        else max(certificate.last, material.until)
    )


@dataclass(frozen=True)
class _Certificate:
    signer: Signer
    first: datetime
    last: datetime


def _without_signature(pdf: bytes) -> SignatureFinding:
    """Return the finding of a file in which the reader sees no signature: never signed, or altered."""
    if not is_signed(pdf):
        return SignatureFinding(None, None, ())
    message = "the file carries a signature that is no field of it any more: altered"
    return SignatureFinding(False, None, (message,))


def _faults_of_file(status: Any, exact: bool) -> list[str]:
    from pyhanko.sign.validation.status import SignatureCoverageLevel

    whole = status.coverage == SignatureCoverageLevel.ENTIRE_FILE and status.docmdp_ok
    checks = (
        (status.intact, "the file was altered after it was signed"),
        (exact, "the room that the signature leaves unsigned was altered"),
        (status.valid, "the signature does not fit its certificate"),
        (whole, "the signature does not cover the whole file: something was added afterwards"),
    )
    return [fault for passed, fault in checks if not passed]


def _faults_of_signer(is_trusted: bool, certificate: _Certificate, moment: datetime) -> list[str]:
    signer, first, last = certificate.signer.name, certificate.first, certificate.last
    if not first <= moment <= last:
        return [
            f"the certificate of {signer} is valid from {first:%Y-%m-%d} to {last:%Y-%m-%d}, not on {moment:%Y-%m-%d}"
        ]
    return [] if is_trusted else [f"the certificate of {signer} does not lead to a trusted one"]


def signer_in(certificate: Any) -> Signer:
    """Return the name and the fingerprint in a certificate, an ``asn1crypto.x509.Certificate``."""
    return Signer(certificate.subject.human_friendly, certificate.sha256.hex())


def need_pyhanko() -> None:
    """Raise InputError, with what to type, where the extra is not installed."""
    try:
        import pyhanko  # noqa: F401
    except ImportError as error:
        raise InputError("signatures need pyHanko: pip install 'machine-health-monitor[sign]'") from error


def _context(signers: TrustedSigners, moment: datetime) -> Any:
    from pyhanko_certvalidator import ValidationContext

    return ValidationContext(trust_roots=list(signers.roots), allow_fetching=False, moment=moment)


def _message(error: Exception) -> str:
    return str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
