"""Fills templates in as HTML and PDF: our fonts, nothing fetched, the same bytes for the same record.

PDF/A-3u, tagged. WeasyPrint takes document dates from the template, the file's identifier is given, and the
dates inside the embedded fonts come from SOURCE_DATE_EPOCH, which is set while the file is written.
"""

from __future__ import annotations

import gc
import os
import threading
import unicodedata
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from datetime import UTC, datetime
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any

from fontTools.ttLib import TTFont
from jinja2 import Environment, FunctionLoader, StrictUndefined, select_autoescape

from monitor.exceptions import InputError
from monitor.reporting.certificate.data import Attached, certificate_files
from monitor.reporting.certificate.page import certificate_context
from monitor.reporting.certificate.record import CertificateRecord
from monitor.reporting.certificate.tables import LETTERS_PT
from monitor.reporting.pdf.last_page import (
    CLOSER,
    closeness_saves,
    ends_early,
    filling_breaks,
    with_breaks_before,
)
from monitor.reporting.pdf.layout_engine import (
    HTML,
    Attachment,
    Document,
    FatalURLFetchingError,
    FontConfiguration,
    URLFetcher,
    URLFetcherResponse,
)
from monitor.reporting.resources import FONT_FILES, font_bytes, report_text
from monitor.reporting.svg.letter_widths import in_mm
from monitor.reporting.texts import breakable, with_bound_units, with_subscripts

PDF_VARIANT = "pdf/a-3u"
_FONT_SCHEME = "font:"
#: A layout of more pages than this is collected at once: the next one would stand beside its half a gigabyte. Of
#: fewer pages it is left to Python, which takes its time: collecting at once takes a tenth of a second.
_LEFT_TO_PYTHON = 20
#: The process environment is shared: one document at a time may set SOURCE_DATE_EPOCH.
_EPOCH_LOCK = threading.Lock()
#: Signs that turn the order of the letters around them (Unicode UAX #9, 2): a number could be read as another.
_REORDERING = frozenset("\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")


class UnprintableError(InputError):
    """A text with letters that no font of the document has."""


def html_of(template: str, context: dict[str, Any], extra_fonts: Sequence[Path] = ()) -> str:
    """Fill in a template of ``reports/``; a name that the context lacks is an error, all text is escaped."""
    return _environment().get_template(template).render(**context, fonts=_font_faces(extra_fonts))


def pieces_of(template: str, context: dict[str, Any]) -> Iterator[str]:
    """Fill in as ``html_of``, for a browser: piece by piece, and without the addresses of our fonts."""
    yield from _environment().get_template(template).generate(**context, fonts=[])


def pdf_of(
    html: str,
    *,
    identifier: str,
    moment: datetime,
    extra_fonts: Sequence[Path] = (),
    attached: Sequence[Attached] = (),
    closer: str | None = None,
    saved: float | None = None,
) -> bytes:
    """Make the PDF/A-3u of a page. ``identifier`` and ``moment`` (with an offset) make its bytes reproducible.

    ``attached`` files travel inside it, named in the catalogue's ``/AF`` once each. Where the last page would be
    less than half full, ``closer``, the same page in less room, is taken if it saves that page, else the page before
    ends earlier (``last_page``). Where the part of the height that it saves is said (``saved``), it is tried only where
    that may do.

    Raises InputError where the page asks for anything but our fonts and inline pictures.
    """
    options: dict[str, Any] = {"pdf_variant": PDF_VARIANT, "pdf_tags": True}
    if attached:
        options["attachments"] = [
            Attachment(
                file_obj=BytesIO(file.content),
                name=file.name,
                description=file.description,
                created=moment,
                modified=moment,
                relationship=file.relationship,
            )
            for file in attached
        ]

    font_folders = ExitStack()

    def laid_out(text: str) -> Document:
        source = HTML(string=text, url_fetcher=_OwnFonts(extra_fonts), base_url="about:blank")
        fonts = FontConfiguration()
        # It removes its folder of temporary files when Python takes it apart, which a verb does not wait for.
        font_folders.callback(fonts.__del__)
        return source.render(font_config=fonts, **options)

    try:
        with _reproducible(moment), _uncollected(), font_folders:
            document = _filled(html, closer, saved, laid_out)
            pages = len(document.pages)
            pdf = bytes(
                document.write_pdf(finisher=_each_once, pdf_identifier=identifier.encode("utf-8"), **options)
            )
            del document
    except FatalURLFetchingError as error:  # no subclass of Exception
        raise InputError(str(error)) from error
    if pages > _LEFT_TO_PYTHON:
        gc.collect()
    return pdf


def _filled(
    html: str, closer: str | None, saved: float | None, laid_out: Callable[[str], Document]
) -> Document:
    """A document without a last page that is more than half empty, where a closer setting or another break helps.

    One document is held at a time: 25 machines need half a gigabyte.
    """
    document = laid_out(html)
    if not ends_early(document):
        return document
    count, choices = len(document.pages), filling_breaks(document)
    if closer is not None and (saved is None or closeness_saves(document, saved)):
        del document
        document = laid_out(closer)
        if len(document.pages) < count and not ends_early(document):
            return document
    else:
        closer = None
    for names in choices:
        del document
        document = laid_out(with_breaks_before(html, names))
        if len(document.pages) <= count and not ends_early(document):
            return document
    if not choices and closer is None:
        return document
    del document
    return laid_out(html)


def certificate_html(record: CertificateRecord, extra_fonts: Sequence[Path] = ()) -> str:
    """Make the certificate as one page of HTML. Raises IncompleteCertificateError, UnprintableError."""
    context = certificate_context(record)
    _check_letters(record, extra_fonts)
    return html_of("certificate.html", context, extra_fonts)


def load_certificate() -> None:
    """Load what the first certificate needs: its template, the widths of letters, the letters of our fonts."""
    _environment().get_template("certificate.html")
    in_mm("0", LETTERS_PT)
    _letters(None)


def certificate_pdf(
    record: CertificateRecord,
    extra_fonts: Sequence[Path] = (),
    inputs: Mapping[str, Any] | None = None,
    document: Mapping[str, Any] | None = None,
) -> bytes:
    """Make the certificate as PDF/A-3u: the same bytes for the same record and ``inputs``.

    Its data travel inside it: the record with the ``inputs`` as JSON, estimates and covariance as CSV. ``document`` is
    the record as an earlier version wrote it, where it is not to be written anew.

    ``extra_fonts`` are TrueType or OpenType files for letters that DejaVu Sans lacks (Chinese, Japanese, ...).
    Raises IncompleteCertificateError with the list of what is missing, UnprintableError for letters that no
    font has.
    """
    html = certificate_html(record, extra_fonts)
    assert record.issued_on is not None  # complete: certificate_html has checked it
    moment = datetime(record.issued_on.year, record.issued_on.month, record.issued_on.day, tzinfo=UTC)
    return pdf_of(
        html,
        identifier=str(record.number),
        moment=moment,
        extra_fonts=extra_fonts,
        attached=certificate_files(record, inputs, document),
        closer=html.replace("<body ", '<body class="close" ', 1),
        saved=CLOSER,
    )


def _each_once(document: Any, pdf: Any) -> None:
    """WeasyPrint 70 names every attachment twice in ``/AF``; ISO 19005-3:2012, 6.8 wants a list of the files."""
    if "AF" in pdf.catalog:
        pdf.catalog["AF"][:] = list(dict.fromkeys(pdf.catalog["AF"]))


class _OwnFonts(URLFetcher):  # type: ignore[misc]
    """Fetches our fonts and inline pictures, and nothing from a disk or a network."""

    def __init__(self, extra: Sequence[Path]) -> None:
        super().__init__(allowed_protocols=("data",), allow_redirects=False)
        self._files = {f"{_FONT_SCHEME}{file}": file for _, _, file in FONT_FILES}
        self._extra = {f"{_FONT_SCHEME}extra-{index}": path for index, path in enumerate(extra)}

    def fetch(self, url: str, headers: dict[str, str] | None = None) -> Any:
        if url in self._files:
            return URLFetcherResponse(url, font_bytes(self._files[url]), {"Content-Type": "font/ttf"})
        if url in self._extra:
            return URLFetcherResponse(url, _extra_bytes(self._extra[url]), {"Content-Type": "font/ttf"})
        if not url.startswith("data:"):
            raise FatalURLFetchingError(f"a report may not fetch '{url}': its fonts and pictures are its own")
        return super().fetch(url, headers)


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=FunctionLoader(report_text),
        undefined=StrictUndefined,
        autoescape=select_autoescape(default=True),
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.tests["wider_than"] = lambda text, mm: in_mm(text, LETTERS_PT) > mm
    environment.filters["subscripts"] = with_subscripts
    environment.filters["breakable"] = breakable
    environment.filters["bound"] = with_bound_units
    environment.filters["capitalize_first"] = lambda text: text[:1].upper() + text[1:]
    return environment


def _font_faces(extra: Sequence[Path]) -> list[dict[str, str]]:
    """Return family, weight and address of every font, ours first."""
    fonts = [
        {"family": family, "weight": str(weight), "url": _FONT_SCHEME + file}
        for family, weight, file in FONT_FILES
    ]
    return fonts + [
        {"family": f"Extra {index}", "weight": "100 900", "url": f"{_FONT_SCHEME}extra-{index}"}
        for index in range(len(extra))
    ]


@contextmanager
def _uncollected() -> Iterator[None]:
    """Do not look for cyclic garbage meanwhile: a layout is a million objects that all stay, and looking through them
    again and again takes a fifth of its time."""
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()


@contextmanager
def _reproducible(moment: datetime) -> Iterator[None]:
    """Set SOURCE_DATE_EPOCH to ``moment``, one document at a time."""
    with _EPOCH_LOCK, warnings.catch_warnings():
        # WeasyPrint 70 leaves closing its colour profile to the garbage collector.
        warnings.filterwarnings("ignore", "unclosed file.*sRGB2014", ResourceWarning)
        before = os.environ.get("SOURCE_DATE_EPOCH")
        os.environ["SOURCE_DATE_EPOCH"] = str(int(moment.timestamp()))
        try:
            yield
        finally:
            if before is None:
                del os.environ["SOURCE_DATE_EPOCH"]
            else:
                os.environ["SOURCE_DATE_EPOCH"] = before


def _check_letters(record: CertificateRecord, extra: Sequence[Path]) -> None:
    """Raise UnprintableError for letters without a font: no system font replaces ours, so all copies look alike."""
    printable = _letters(None).union(*(_letters(path) for path in extra))
    used = set(_text_of(record)) - set("\n\r\t")
    hidden = sorted(
        letter for letter in used if letter in _REORDERING or unicodedata.category(letter) == "Cc"
    )
    if hidden:
        shown = ", ".join(f"U+{ord(letter):04X}" for letter in hidden)
        raise UnprintableError(
            f"the certificate's texts hold signs that are not seen but change what is: {shown}; take them out"
        )
    missing = sorted(letter for letter in used if ord(letter) not in printable)
    if missing:
        shown = ", ".join(f"{letter} (U+{ord(letter):04X})" for letter in missing[:8])
        raise UnprintableError(
            f"the certificate's fonts lack {len(missing)} of its letters: {shown}"
            f"{', ...' if len(missing) > 8 else ''}; DejaVu Sans has Latin, Greek and Cyrillic: give a font file "
            "for others"
        )


def _text_of(value: object) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, tuple | list):
        return "".join(_text_of(part) for part in value)
    if hasattr(value, "__dataclass_fields__"):
        return "".join(_text_of(getattr(value, name)) for name in value.__dataclass_fields__)
    return ""


@cache
def _letters(path: Path | None) -> frozenset[int]:
    content = font_bytes(FONT_FILES[0][2]) if path is None else _extra_bytes(path)
    try:
        font = TTFont(BytesIO(content), fontNumber=0, lazy=True)
        return frozenset(font.getBestCmap())
    except Exception as error:  # fontTools raises many kinds for a file that is no font
        raise InputError(f"{path} is not a TrueType or OpenType font: {error}") from error


def _extra_bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"the font {path} cannot be read: {error.strerror or error}") from error
