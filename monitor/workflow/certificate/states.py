"""Shows certificates and writes their files."""

from __future__ import annotations

from monitor.reporting.certificate.dcc import dcc_xml
from monitor.reporting.certificate.dcc_page import dcc_context
from monitor.store import Database, StoredCertificate, certificate_numbers, load_certificate
from monitor.workflow.certificate.answer import (
    CertificateFileAnswer,
    CertificatesAnswer,
    CertificateShowAnswer,
    CertificateState,
)
from monitor.workflow.certificate.files import dcc_page_path_of, dcc_path_of, path_of, write_file
from monitor.workflow.certificate.request import (
    CertificateFileRequest,
    CertificateShowRequest,
    CertificatesRequest,
)
from monitor.workflow.certificate.stored import restored_record


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


def write_digital(db: Database, request: CertificateFileRequest) -> CertificateFileAnswer:
    """Write the digital calibration certificate (PTB DCC) of a stored record to a file or into a folder.

    Raises NotFoundError, InputError where the record names no country.
    """
    stored = load_certificate(db, request.number)
    path = dcc_path_of(request.path, request.number)
    write_file(path, dcc_xml(restored_record(stored.record)))
    return CertificateFileAnswer(state_of(stored), str(path))


def write_digital_page(db: Database, request: CertificateFileRequest) -> CertificateFileAnswer:
    """Write what the digital calibration certificate says as a page (HTML) to a file or into a folder.

    Raises NotFoundError, InputError where the record names no country.
    """
    # Loaded here: who lists certificates waits for no layout engine.
    from monitor.reporting.pdf.render import pieces_of

    stored = load_certificate(db, request.number)
    path = dcc_page_path_of(request.path, request.number)
    page = "".join(pieces_of("dcc.html", dcc_context(dcc_xml(restored_record(stored.record)))))
    write_file(path, page.encode())
    return CertificateFileAnswer(state_of(stored), str(path))


def write_issued(db: Database, request: CertificateFileRequest) -> CertificateFileAnswer:
    """Write the document of a certificate, as it was issued, to a file or into a folder. Raises NotFoundError."""
    stored = load_certificate(db, request.number)
    path = path_of(request.path, request.number)
    write_file(path, stored.pdf)
    return CertificateFileAnswer(state_of(stored), str(path))
