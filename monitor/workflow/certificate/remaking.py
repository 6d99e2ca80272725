"""Makes a certificate again from its stored record and compares it with the stored document."""

from __future__ import annotations

from monitor import __version__
from monitor.documents import from_document
from monitor.exceptions import InputError
from monitor.reporting import messages
from monitor.reporting.pdf.layout_engine import engine_versions
from monitor.reporting.pdf.render import certificate_pdf
from monitor.reporting.signature.signature import is_signed
from monitor.store import Database, StoredCertificate, load_certificate
from monitor.workflow.certificate.answer import RemakeAnswer
from monitor.workflow.certificate.files import font_hashes, path_of, write_file
from monitor.workflow.certificate.inputs import MadeWith
from monitor.workflow.certificate.request import RemakeRequest
from monitor.workflow.certificate.states import state_of
from monitor.workflow.certificate.stored import restored_record


def remake(db: Database, request: RemakeRequest) -> RemakeAnswer:
    """Make a certificate again from its stored record and compare it, byte for byte, with the stored document.

    A signature is no part of what can be made again: it is appended to the document, which has to lie unchanged
    below it. Raises NotFoundError, InputError where the fonts are others.
    """
    number = request.number
    stored = load_certificate(db, number)
    record = restored_record(stored.record)
    inputs = stored.record.get("inputs") or {}
    made_with = from_document(MadeWith, inputs)
    if [font.sha256 for font in font_hashes(request.fonts)] != [font.sha256 for font in made_with.fonts]:
        fonts = ", ".join(f"{font.name} (SHA-256 {font.sha256})" for font in made_with.fonts)
        raise InputError(
            f"certificate {number} was made with {fonts or 'no font but ours'}: give the same by --font"
        )
    # The document holds the record as it was stored, not as this version would write it.
    written = {key: value for key, value in stored.record.items() if key != "inputs"}
    pdf = certificate_pdf(record, request.fonts, inputs, written)
    signed = is_signed(stored.pdf)
    identical = stored.pdf.startswith(pdf) if signed else stored.pdf == pdf
    why = None if identical else _why_another(stored, made_with)
    file = None
    if request.path is not None:
        path = path_of(request.path, number)
        write_file(path, pdf)
        file = str(path)
    return RemakeAnswer(state_of(stored), identical, signed, file, why)


def _why_another(stored: StoredCertificate, made_with: MadeWith) -> str:
    """What differs from when a document was made: this software, or what lays out its pages."""
    then = {messages.THIS_SOFTWARE: stored.software_version, **made_with.page_made_by}
    present = {messages.THIS_SOFTWARE: __version__, **engine_versions()}
    others = {
        name: (version, present[name])
        for name, version in then.items()
        if present.get(name, version) != version
    }
    if others:
        return messages.remade_with_others(others)
    return messages.remade_with_other_texts(stored.software_version)
