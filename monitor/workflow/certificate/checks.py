"""What can be asked of a certificate that is there: its state, is a file it, can it be made again, as data."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from datetime import UTC
from pathlib import Path
from typing import Any

import numpy as np

from monitor import __version__
from monitor.documents import from_document
from monitor.exceptions import InputError, NotFoundError
from monitor.reporting.certificate.dcc import dcc_xml
from monitor.reporting.certificate.record import CertificateRecord
from monitor.reporting.pdf.layout_engine import engine_versions
from monitor.reporting.pdf.render import certificate_pdf
from monitor.reporting.signature.signature import SignatureFinding, check_signature, is_signed
from monitor.store import (
    Database,
    StoredCertificate,
    find_certificate,
    list_certificates,
    load_certificate,
    verify_audit,
)
from monitor.workflow.certificate.files import font_hashes, path_of, write_file

Document = dict[str, Any]
#: The identifier that a certificate's file bears, its number (ISO 32000-2:2020, 14.4).
_IDENTIFIER = re.compile(rb"/ID ?\[ ?\(([^()\\]*)\)")


def summary(db: Database, number: str) -> Document:
    """A certificate's present state."""
    found = load_certificate(db, number)
    return {
        "number": number,
        "state": found.state,
        "campaign": found.campaign,
        "campaign_withdrawn": found.campaign_withdrawn,
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


def remake(db: Database, number: str, path: Path | None = None, fonts: Sequence[Path] = ()) -> Document:
    """Make a certificate again from its stored record and compare it, byte for byte, with the stored document.

    A signature is no part of what can be made again: it is appended to the document, which has to lie unchanged
    below it. ``path`` is a folder or a file for the document that was made again. ``fonts`` are those that it was
    made with besides ours. Raises NotFoundError, InputError where the fonts are others.
    """
    stored = load_certificate(db, number)
    record = from_document(CertificateRecord, stored.record)
    inputs = stored.record.get("inputs") or {}
    wanted = inputs.get("fonts", [])
    if [one["sha256"] for one in font_hashes(fonts)] != [one["sha256"] for one in wanted]:
        named = ", ".join(f"{one['name']} (SHA-256 {one['sha256']})" for one in wanted) or "no font but ours"
        raise InputError(f"certificate {number} was made with {named}: give the same by --font")
    pdf = certificate_pdf(record, fonts, inputs)
    signed = is_signed(stored.pdf)
    same = stored.pdf.startswith(pdf) if signed else stored.pdf == pdf
    found = {**summary(db, number), "identical": same, "signed": signed, "file": None}
    if not same:
        found["why"] = (
            f"{_why_another(stored, inputs)}; the stored document is unchanged where `monitor verify` says so"
        )
    if path is not None:
        target = path_of(path, number)
        write_file(target, pdf)
        found["file"] = str(target)
    return found


def _why_another(stored: StoredCertificate, inputs: Mapping[str, Any]) -> str:
    """What is another than when a document was made: this software, or what lays out its pages."""
    then = {"this software": stored.software_version, **inputs.get("page_made_by", {})}
    here = {"this software": __version__, **engine_versions()}
    others = [
        f"{name} {then[name]} (here {here[name]})"
        for name in then
        if here.get(name, then[name]) != then[name]
    ]
    if others:
        return f"it was made with {', '.join(others)}"
    return f"it was made with the same {stored.software_version} of this software, but with other templates or texts"


def digital(db: Database, number: str, path: Path) -> Document:
    """Write the digital calibration certificate (PTB DCC 3.2.1) of a stored record to a file or into a folder.

    Raises NotFoundError, InputError where the record names no country.
    """
    record = from_document(CertificateRecord, load_certificate(db, number).record)
    name = f"certificate-{number}.dcc.xml".replace("/", "-").replace("\\", "-")
    target = path if path.suffix.lower() == ".xml" else path / name
    write_file(target, dcc_xml(record))
    return {**summary(db, number), "file": str(target)}


def stored_file(db: Database, number: str, path: Path) -> Document:
    """Write the document of a certificate, as it was issued, to a file or into a folder. Raises NotFoundError."""
    found = load_certificate(db, number)
    target = path_of(path, number)
    write_file(target, found.pdf)
    return {**summary(db, number), "file": str(target)}


def _no_longer(found: StoredCertificate) -> str:
    """Why a genuine certificate is not valid."""
    if found.state == "draft":
        return "it is a draft"
    replaced = f", replaced by {found.replaced_by}" if found.replaced_by else ""
    return f"certificate {found.number} is {found.state}, no longer valid{replaced}: {found.reason}"


def _claimed(db: Database, content: bytes) -> str:
    """Which certificate an unknown document says that it is, and where it differs from that one."""
    for number in {one.decode("utf-8", "replace") for one in _IDENTIFIER.findall(content)}:
        try:
            stored = load_certificate(db, number).pdf
        except NotFoundError:
            continue
        common = min(len(content), len(stored))
        both = (np.frombuffer(one[:common], dtype=np.uint8) for one in (content, stored))
        first = next(iter(np.flatnonzero(np.not_equal(*both))), common)
        return (
            f"it bears the number {number}, but differs from the document of that certificate from byte "
            f"{first} on ({len(content)} bytes, where the genuine one has {len(stored)})"
        )
    return "altered, or not from here"


def verify(db: Database, file: Path, trusted: Path | None = None) -> Document:
    """Whether a file is a certificate of this database, unaltered, and whether the database is as written.

    The signature is null where the file has none. ``trusted`` names the certificates (PEM or DER) that the
    signer's has to lead to, on the day on which the file was stored where it is known here, else today.
    """
    try:
        content = file.read_bytes()
    except OSError as error:
        raise InputError(f"{file} cannot be read: {error.strerror or error}") from error
    number = find_certificate(db, hashlib.sha256(content).hexdigest())
    chain = verify_audit(db)
    found = None if number is None else load_certificate(db, number)
    # The chain of entries, not the signer, says when this very file was there.
    at = found.made_at.replace(tzinfo=UTC) if found is not None and chain.ok else None
    signature = (
        check_signature(content, trusted, at) if is_signed(content) else SignatureFinding(None, None, ())
    )
    state = None if found is None else found.state
    checks = {
        "hash": number is not None,
        "chain": chain.ok,
        "signature": signature.good,
        "database": state == "issued" and found is not None and found.campaign_withdrawn is None,
    }
    faults = [*signature.faults, *chain.faults]
    if found is None:
        why = _claimed(db, content) if content.startswith(b"%PDF-") else "it is no PDF"
        faults.insert(0, f"no certificate of this database has the content of {file.name}: {why}")
    elif state != "issued":
        faults.insert(0, _no_longer(found))
    elif found.campaign_withdrawn is not None:
        faults.insert(
            0,
            f"the campaign {found.campaign}, which certificate {number} rests on, was withdrawn: "
            f"{found.campaign_withdrawn}",
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
