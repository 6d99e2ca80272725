"""Writes the digital calibration certificate of a stored record, and what it says as a page."""

from __future__ import annotations

from monitor.reporting.certificate.dcc import dcc_xml
from monitor.reporting.certificate.dcc_page import dcc_context
from monitor.store import Database, load_certificate
from monitor.workflow.certificate.answer import CertificateFileAnswer
from monitor.workflow.certificate.files import dcc_page_path_of, dcc_path_of, write_file
from monitor.workflow.certificate.request import CertificateFileRequest
from monitor.workflow.certificate.states import state_of
from monitor.workflow.certificate.stored import restored_record


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
    # Loaded here: who writes XML waits for no templates.
    from monitor.reporting.pdf.render import pieces_of

    stored = load_certificate(db, request.number)
    path = dcc_page_path_of(request.path, request.number)
    page = "".join(pieces_of("dcc.html", dcc_context(dcc_xml(restored_record(stored.record)))))
    write_file(path, page.encode())
    return CertificateFileAnswer(state_of(stored), str(path))
