"""Log in with a token, or with name and password, and out."""

from __future__ import annotations

import logging

from fastapi import APIRouter, Request
from starlette.concurrency import run_in_threadpool
from starlette.responses import RedirectResponse, Response

from monitor.web.forms import Typed, own_address, read_form, typed_of
from monitor.web.gate import DOCUMENT_BYTES, session_cookie
from monitor.web.rendering import again_page, page
from monitor.web.sessions import Sessions

_log = logging.getLogger("monitor.web")


def routes() -> APIRouter:
    """Return the routes of the log-in."""
    router = APIRouter()

    @router.get("/login")
    def form(request: Request, then: str = "/") -> Response:
        """Show the form."""
        return _form(request, own_address(then))

    @router.post("/login")
    async def login(request: Request) -> Response:
        """Begin a session for the user of a token, or of a name and password.

        No proof is asked: there is no session yet, and the gate refuses what another site's page sends.
        """
        sessions: Sessions = request.app.state.sessions
        if request.state.sent_to:
            return _form(request, "/", typed=await _too_late(request), status=401)
        async with request.form(max_files=0) as texts:
            then = own_address(str(texts.get("then") or "/"))
            typed = Typed.of_document(str(texts.get("typed") or ""))
            name, secret = str(texts.get("name") or "").strip(), str(texts.get("token") or "")
        wait_s = sessions.attempts.wait_s(name) if name else 0.0
        if wait_s > 0.0:
            wrong = f"There were too many wrong passwords: try again in {wait_s:.0f} s."
            return _form(request, then, wrong, typed, status=429)
        key = await run_in_threadpool(sessions.begin, secret if name else secret.strip(), name)
        if key is None:
            _log.warning("a log-in of %r was refused", name or "a token")
            wrong = (
                "Nobody has this name and password." if name
                else "Nobody has this token. Copy the whole line that was printed when you were added."
            )  # fmt: skip
            return _form(request, then, wrong, typed, status=403)
        answer: Response = RedirectResponse(then, status_code=303)
        if typed is not None:
            request.state.session, request.state.user = key, sessions.user_of(key)
            answer = again_page(request, typed, "You are logged in again. Nothing was done yet.")
        answer.headers["Set-Cookie"] = session_cookie(key, encrypted=request.app.state.settings.is_encrypted)
        return answer

    @router.post("/logout")
    async def logout(request: Request) -> Response:
        """End the session."""
        async with read_form(request):
            request.app.state.sessions.end(request.state.session)
        answer = RedirectResponse("/login", status_code=303)
        encrypted = request.app.state.settings.is_encrypted
        answer.headers["Set-Cookie"] = f"{session_cookie('', encrypted=encrypted)}; Max-Age=0"
        return answer

    return router


async def _too_late(request: Request) -> Typed:
    """What a form held that was sent after its session had ended; a large one has files, which are not taken."""
    length = request.headers.get("content-length", "")
    if length.isdigit() and int(length) <= DOCUMENT_BYTES:
        async with request.form(max_files=2000, max_fields=200) as form:
            return typed_of(request.state.sent_to, form)
    # Read to its end: a browser whose upload is cut off shows a fault of the network, and no page.
    async for _ in request.stream():
        pass
    return Typed(request.state.sent_to, with_files=True)


def _form(
    request: Request, then: str, wrong: str = "", typed: Typed | None = None, *, status: int = 200
) -> Response:
    return page(request, "login.html", status=status, then=then, wrong=wrong, typed=typed)
