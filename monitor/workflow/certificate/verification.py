"""Verifies that a file is a valid certificate of this database, and that a trusted signer signed it."""

from __future__ import annotations

import hashlib
import re
from datetime import UTC
from pathlib import Path

import numpy as np

from monitor.bounded import LARGEST_DOCUMENT, read_bounded
from monitor.exceptions import InputError, NotFoundError
from monitor.reporting import messages
from monitor.reporting.signature.signature import SignatureFinding, check_signature, is_signed
from monitor.store import Database, StoredCertificate, find_certificate, load_certificate, verify_audit
from monitor.workflow.certificate.answer import CertificateChecks, Verdict, VerificationAnswer
from monitor.workflow.certificate.request import VerificationRequest

#: The identifier that a certificate's file bears, its number (ISO 32000-2:2020, 14.4).
_IDENTIFIER = re.compile(rb"/ID ?\[ ?\(([^()\\]*)\)")


def verify_file(db: Database, request: VerificationRequest) -> VerificationAnswer:
    """Whether a file is a certificate of this database, unaltered, and whether the database is as written.

    The signature is None where the file has none. The signer's certificate has to lead to a trusted one on the day on
    which the file was stored where it is known to this database, else today. Raises InputError for a file that cannot
    be read.
    """
    file = request.file
    content = _content(file)
    sha256 = hashlib.sha256(content).hexdigest()
    number = find_certificate(db, sha256)
    chain = verify_audit(db)
    stored = None if number is None else load_certificate(db, number)
    signature = _signature(content, request, stored, chain.ok)
    signer = signature.signer
    checks = CertificateChecks(
        hash=stored is not None,
        chain=chain.ok,
        signature=signature.good,
        database=stored is not None and stored.state == "issued" and stored.campaign_withdrawn is None,
        expected=None if request.expected is None else request.expected.strip().lower() == sha256,
    )
    without = request.trusted is not None and signature.good is None
    ok = checks.passed and not without
    faults = (
        _unknown(db, file.name, content) if stored is None else _no_longer(stored),
        messages.other_hash(sha256) if checks.expected is False else None,
        messages.WITHOUT_SIGNATURE if without else None,
    )
    return VerificationAnswer(
        number=number,
        ok=ok,
        state=None if stored is None else stored.state,
        checks=checks,
        signer=None if signer is None else signer.name,
        signer_sha256=None if signer is None else signer.sha256,
        faults=(*filter(None, faults), *signature.faults, *chain.faults),
        stamped_at=signature.stamped_at,
        verdict=_verdict(signature) if ok else Verdict.NOT_CONFIRMED,
        long_term=signature.long_term,
        judged_until=signature.judged_until,
    )


def _signature(
    content: bytes, request: VerificationRequest, stored: StoredCertificate | None, chain_ok: bool
) -> SignatureFinding:
    """Return what the file's signature says, held against the certificate that the database stored."""
    # The chain of entries, not the signer, says when this very file was there.
    at = stored.made_at.replace(tzinfo=UTC) if stored is not None and chain_ok else None
    signature = SignatureFinding(None, None, ())
    if is_signed(content):
        signature = check_signature(content, request.trusted, at)
    return signature if stored is None else _as_stated(signature, stored)


def _verdict(signature: SignatureFinding) -> Verdict:
    """Return what may be said of a file that no check speaks against."""
    if signature.good is None:
        return Verdict.NOT_SIGNED
    return Verdict.GENUINE if signature.signer_trusted else Verdict.SIGNER_NOT_TRUSTED


def _content(file: Path) -> bytes:
    try:
        return read_bounded(file, LARGEST_DOCUMENT)
    except OSError as error:
        raise InputError(f"{file} cannot be read: {error.strerror or error}") from error


def _as_stated(signature: SignatureFinding, stored: StoredCertificate) -> SignatureFinding:
    """Return the finding, with a fault where another signed than the certificate itself states.

    Certificates of earlier versions state nobody.
    """
    stated = stored.record.get("signer")
    if stated is None or (signature.signer is not None and signature.signer.sha256 == stated["sha256"]):
        return signature
    actual = None if signature.signer is None else (signature.signer.name, signature.signer.sha256)
    fault = messages.other_signer((stated["name"], stated["sha256"]), actual)
    return SignatureFinding(False, signature.signer, (*signature.faults, fault))


def _unknown(db: Database, name: str, content: bytes) -> str:
    """Why a file that this database does not know is no certificate of it."""
    why = _claimed(db, content) if content.startswith(b"%PDF-") else messages.NO_PDF
    return messages.unknown_content(name, why)


def _no_longer(stored: StoredCertificate) -> str | None:
    """Why a genuine certificate is not valid; None where it is."""
    if stored.state == "draft":
        return messages.DRAFT
    if stored.state != "issued":
        return messages.no_longer_valid(stored.number, stored.state, stored.replaced_by, stored.reason)
    if stored.campaign_withdrawn is None:
        return None
    return messages.campaign_of_certificate_withdrawn(
        stored.campaign, stored.number, stored.campaign_withdrawn
    )


def _claimed(db: Database, content: bytes) -> str:
    """Which certificate an unknown document claims to be, and where it differs from that one."""
    for number in {number.decode("utf-8", "replace") for number in _IDENTIFIER.findall(content)}:
        try:
            genuine = load_certificate(db, number).pdf
        except NotFoundError:
            continue
        common = min(len(content), len(genuine))
        starts = (np.frombuffer(file[:common], dtype=np.uint8) for file in (content, genuine))
        first = next(iter(np.flatnonzero(np.not_equal(*starts))), common)
        return messages.differs_from(number, int(first), len(content), len(genuine))
    return messages.ALTERED
