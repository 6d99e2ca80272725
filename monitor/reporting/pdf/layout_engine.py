"""WeasyPrint and the libraries under it, behind one door, with the versions that decide the bytes of a page."""

from __future__ import annotations

# ruff: noqa: E402  (what is loaded first decides how long the rest takes)
import zlib

from monitor.reporting.pdf.quick_loading import load_weasyprint

load_weasyprint()

import fontTools
import pydyf
import pyphen
import weasyprint
from weasyprint import HTML, Attachment
from weasyprint.document import Document
from weasyprint.text.ffi import pango
from weasyprint.text.fonts import FontConfiguration
from weasyprint.urls import FatalURLFetchingError, URLFetcher, URLFetcherResponse


def engine_versions() -> dict[str, str]:
    """Return what decides the bytes of a page besides its content: another version may break or compress otherwise."""
    number = int(pango.pango_version())
    return {
        "weasyprint": weasyprint.__version__,
        "pydyf": pydyf.__version__,
        "fonttools": fontTools.version,
        "pyphen": pyphen.__version__,
        "pango": f"{number // 10000}.{number // 100 % 100}.{number % 100}",
        "zlib": zlib.ZLIB_RUNTIME_VERSION,
    }


__all__ = [
    "HTML",
    "Attachment",
    "Document",
    "FatalURLFetchingError",
    "FontConfiguration",
    "URLFetcher",
    "URLFetcherResponse",
    "engine_versions",
]
