"""WeasyPrint, loaded without starting a compiler.

It asks for its libraries under the names of every platform, one after the other. What the loader does not know Python
looks for with gcc and ld: seventeen processes, a fifth of a second, before a name of Linux is tried.
"""

from __future__ import annotations

import ctypes.util
import sys
import zlib
from collections.abc import Iterator
from contextlib import contextmanager

#: What the names of WeasyPrint's libraries hold.
_OWN = ("gobject", "pango", "harfbuzz", "fontconfig")


@contextmanager
def _by_the_loader_alone() -> Iterator[None]:
    """On Linux the loader finds each library by its soname, which is among the names; no search is needed."""
    if sys.platform != "linux":
        yield
        return
    search = ctypes.util.find_library

    def found(name: str) -> str | None:
        return None if any(part in name for part in _OWN) else search(name)

    ctypes.util.find_library = found
    try:
        yield
    finally:
        ctypes.util.find_library = search


with _by_the_loader_alone():
    import fontTools
    import pydyf
    import pyphen
    import weasyprint
    from weasyprint import HTML, Attachment
    from weasyprint.text.ffi import pango
    from weasyprint.text.fonts import FontConfiguration
    from weasyprint.urls import FatalURLFetchingError, URLFetcher, URLFetcherResponse


def engine_versions() -> dict[str, str]:
    """What decides the bytes of a page besides its content: another version may break or compress otherwise."""
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
    "FatalURLFetchingError",
    "FontConfiguration",
    "URLFetcher",
    "URLFetcherResponse",
    "engine_versions",
]
