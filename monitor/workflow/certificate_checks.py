"""What can be asked of a certificate that is there: its state, is a file it, can it be made again, as data."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

from monitor import __version__
from monitor.exceptions import InputError
from monitor.reporting.certificate import CertificateRecord
from monitor.reporting.dcc import dcc_xml
from monitor.reporting.documents import from_document
from monitor.reporting.render import certificate_pdf
from monitor.reporting.signature import SignatureFinding, check_signature
from monitor.store import (
    Database,
    find_certificate,
    list_certificates,
    load_certificate,
    verify_audit,
)
from monitor.workflow.certificate_files import path_of, write_file

Document = dict[str, Any]


def summary(db: Database, number: str) -> Document:
    """A certificate's present state."""
    found = load_certificate(db, number)
    return {
        "number": number,
        "state": found.state,
        "campaign": found.campaign,
        "runs": list(found.runs),
        "sha256": found.pdf_sha256,
        "software_version": found.software_version,
        "reason": found.reason or None,
        "replaced_by": found.replaced_by,
    }


def show(db: Database, number: str | None = None) -> Document:
    """One certificate, or all of them."""
    if number is not None:
        return {**summary(db, number), "record": dict(load_certificate(db, number).record)}
    return {"certificates": [summary(db, str(one)) for one in list_certificates(db)["number"]]}


def remake(db: Database, number: str, path: Path | None = None) -> Document:
    """Make a certificate again from its stored record and compare it, byte for byte, with the stored document.

    A signature is no part of what can be made again: it is appended to the document, which has to lie unchanged
    below it. ``path`` is a folder or a file for the document that was made again. Raises NotFoundError.
    """
    stored = load_certificate(db, number)
    record = from_document(CertificateRecord, stored.record)
    pdf = certificate_pdf(record, inputs=stored.record.get("inputs"))
    signed = _is_signed(stored.pdf)
    same = stored.pdf.startswith(pdf) if signed else stored.pdf == pdf
    found = {**summary(db, number), "identical": same, "signed": signed, "file": None}
    if not same:
        found["why"] = (
            f"it was issued with {stored.software_version} of this software, this is {__version__}; the stored "
            "document is unchanged where `monitor verify` says so"
        )
    if path is not None:
        target = path_of(path, number)
        write_file(target, pdf)
        found["file"] = str(target)
    return found


def digital(db: Database, number: str, path: Path) -> Document:
    """Write the digital calibration certificate (PTB DCC 3.2.1) of a stored record to a file or into a folder.

    Raises NotFoundError, InputError where the record names no country.
    """
    record = from_document(CertificateRecord, load_certificate(db, number).record)
    name = f"certificate-{number}.dcc.xml".replace("/", "-").replace("\\", "-")
    target = path if path.suffix.lower() == ".xml" else path / name
    write_file(target, dcc_xml(record))
    return {**summary(db, number), "file": str(target)}


def _is_signed(pdf: bytes) -> bool:
    return b"/ByteRange" in pdf


def verify(db: Database, file: Path, trusted: Path | None = None) -> Document:
    """Whether a file is a certificate of this database, unaltered, and whether the database is as written.

    The signature is null where the file has none. ``trusted`` names the certificates (PEM or DER) that the
    signer's has to lead to.
    """
    try:
        content = file.read_bytes()
    except OSError as error:
        raise InputError(f"{file} cannot be read: {error.strerror or error}") from error
    number = find_certificate(db, hashlib.sha256(content).hexdigest())
    chain = verify_audit(db)
    signature = check_signature(content, trusted) if _is_signed(content) else SignatureFinding(None, None, ())
    state = None
    if number is not None:
        state = load_certificate(db, number).state
    checks = {
        "hash": number is not None,
        "chain": chain.ok,
        "signature": signature.good,
        "database": state == "issued",
    }
    faults = [*signature.faults, *chain.faults]
    if number is None:
        why = "altered, or not from here" if content.startswith(b"%PDF-") else "it is no PDF"
        faults.insert(0, f"no certificate of this database has the content of {file.name}: {why}")
    elif state != "issued":
        faults.insert(
            0, f"certificate {number} is {state}, no longer valid" if state != "draft" else "it is a draft"
        )
    ok = all(value for value in checks.values() if value is not None)
    return {
        "number": number,
        "ok": ok,
        "state": state,
        "checks": checks,
        "signer": signature.signer,
        "faults": faults,
    }
