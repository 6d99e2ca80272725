"""The files of the pages: our style sheet and script, the project's font, and the script that plotly's wheel brings."""

from __future__ import annotations

import hashlib
import re
from functools import cache
from importlib import resources

from fastapi import APIRouter, Request
from starlette.responses import Response

from monitor.exceptions import NotFoundError
from monitor.reporting.resources import font_bytes, report_text

_OWN = {"pages.css": "text/css; charset=utf-8", "pages.js": "text/javascript; charset=utf-8"}
_FONTS = ("DejaVuSans.ttf", "DejaVuSans-Bold.ttf")
_PLOTLY = "plotly.min.js"


@cache
def _content(name: str) -> tuple[bytes, str]:
    """Content and media type of a file. Raises NotFoundError."""
    if name in _OWN:
        return report_text(f"pages/{name}").encode("utf-8"), _OWN[name]
    if name in _FONTS:
        return font_bytes(name), "font/ttf"
    if name == _PLOTLY:
        return resources.files("plotly.package_data").joinpath(
            _PLOTLY
        ).read_bytes(), "text/javascript; charset=utf-8"
    raise NotFoundError(f"there is no file {name}")


@cache
def maps_style() -> str:
    """The id of the style sheet that plotly.js writes into a page for maps of the earth, unless the page has an element
    of that id.

    Our policy refuses styles in a page, which browsers report as a fault; no page has such a map.
    """
    guard = re.search(rb'getElementById\("([0-9a-f]{64})"\)', _content(_PLOTLY)[0])
    return guard[1].decode() if guard else "plotly"


def static_routes() -> APIRouter:
    """Return the routes of the files, which a browser may keep as long as their content stays."""
    router = APIRouter()

    @router.get("/static/{name}")
    def file(request: Request, name: str) -> Response:
        """Send a file, or say that the browser has it."""
        content, media_type = _content(name)
        tag = f'"{hashlib.sha256(content).hexdigest()[:32]}"'
        headers = {"ETag": tag, "Cache-Control": "no-cache"}
        if request.headers.get("if-none-match") == tag:
            return Response(status_code=304, headers=headers)
        return Response(content, media_type=media_type, headers=headers)

    return router
