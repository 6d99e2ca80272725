"""Shows certificates and writes their documents as they were issued; ``digital`` writes the digital ones."""

from __future__ import annotations

from monitor.store import Database, StoredCertificate, certificate_numbers, load_certificate
from monitor.workflow.certificate.answer import (
    CertificateFileAnswer,
    CertificatesAnswer,
    CertificateShowAnswer,
    CertificateState,
)
from monitor.workflow.certificate.files import path_of, write_file
from monitor.workflow.certificate.request import (
    CertificateFileRequest,
    CertificateShowRequest,
    CertificatesRequest,
)


def state_of(stored: StoredCertificate) -> CertificateState:
    """The present state of a stored certificate."""
    return CertificateState(
        number=stored.number,
        state=stored.state,
        campaign=stored.campaign,
        campaign_withdrawn=stored.campaign_withdrawn,
        runs=stored.runs,
        sha256=stored.pdf_sha256,
        software_version=stored.software_version,
        reason=stored.reason or None,
        replaced_by=stored.replaced_by,
    )


def show_certificate(db: Database, request: CertificateShowRequest) -> CertificateShowAnswer:
    """Show one certificate with its record. Raises NotFoundError."""
    stored = load_certificate(db, request.number)
    return CertificateShowAnswer(state_of(stored), stored.record)


def list_certificates(db: Database, request: CertificatesRequest) -> CertificatesAnswer:
    """Show the states of all certificates."""
    return CertificatesAnswer(
        tuple(state_of(load_certificate(db, number)) for number in certificate_numbers(db))
    )


def write_issued(db: Database, request: CertificateFileRequest) -> CertificateFileAnswer:
    """Write the document of a certificate, as it was issued, to a file or into a folder. Raises NotFoundError."""
    stored = load_certificate(db, request.number)
    path = path_of(request.path, request.number)
    write_file(path, stored.pdf)
    return CertificateFileAnswer(state_of(stored), str(path))
