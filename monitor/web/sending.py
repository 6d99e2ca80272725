"""Files that go to whoever asked: piece by piece from a folder, or as a file that a browser saves."""

from __future__ import annotations

from pathlib import Path

from starlette.background import BackgroundTask
from starlette.responses import FileResponse, Response

_ANY_MEDIA_TYPE = "application/octet-stream"


def sent(path: Path, name: str = "", media_type: str = _ANY_MEDIA_TYPE) -> FileResponse:
    """Send a file piece by piece and remove it: a backup does not fit into the memory."""
    headers = _saved_as(name) if name else {}
    return FileResponse(path, media_type=media_type, headers=headers, background=BackgroundTask(path.unlink))


def attachment(name: str, content: bytes) -> Response:
    """Return a file that a browser saves under its name and never shows as a page."""
    return Response(content, media_type=_ANY_MEDIA_TYPE, headers=_saved_as(name))


def _saved_as(name: str) -> dict[str, str]:
    plain = "".join(
        letter if letter.isascii() and (letter.isalnum() or letter in "-_.") else "_" for letter in name
    )
    return {"Content-Disposition": f'attachment; filename="{plain}"'}
