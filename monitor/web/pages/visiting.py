"""Log in with a token, or with name and password, and out."""

from __future__ import annotations

import logging

from fastapi import APIRouter, Request
from starlette.concurrency import run_in_threadpool
from starlette.responses import RedirectResponse, Response

from monitor.web.forms import own_address, read_form
from monitor.web.gate import session_cookie
from monitor.web.rendering import page
from monitor.web.sessions import COOKIE, Sessions

_log = logging.getLogger("monitor.web")


def routes() -> APIRouter:
    """Return the routes of the log-in."""
    router = APIRouter()

    @router.get("/login")
    def form(request: Request, then: str = "/") -> Response:
        """Show the form."""
        return page(request, "login.html", then=own_address(then), wrong="")

    @router.post("/login")
    async def login(request: Request) -> Response:
        """Begin a session for the user of a token, or of a name and password.

        No proof is asked: there is no session yet, and the gate refuses what another site's page sends.
        """
        sessions: Sessions = request.app.state.sessions
        async with request.form(max_files=0) as texts:
            then = own_address(str(texts.get("then") or "/"))
            name, secret = str(texts.get("name") or "").strip(), str(texts.get("token") or "")
        wait_s = sessions.attempts.wait_s(name) if name else 0.0
        if wait_s > 0.0:
            wrong = f"There were too many wrong passwords: try again in {wait_s:.0f} s."
            return page(request, "login.html", status=429, then=then, wrong=wrong)
        key = await run_in_threadpool(sessions.begin, secret if name else secret.strip(), name)
        if key is None:
            _log.warning("a log-in of %r was refused", name or "a token")
            wrong = (
                "Nobody has this name and password." if name
                else "Nobody has this token. Copy the whole line that was printed when you were added."
            )  # fmt: skip
            return page(request, "login.html", status=403, then=then, wrong=wrong)
        answer = RedirectResponse(then, status_code=303)
        answer.headers["Set-Cookie"] = session_cookie(key, encrypted=request.app.state.settings.is_encrypted)
        return answer

    @router.post("/logout")
    async def logout(request: Request) -> Response:
        """End the session."""
        async with read_form(request):
            request.app.state.sessions.end(request.state.session)
        answer = RedirectResponse("/login", status_code=303)
        answer.delete_cookie(COOKIE, path="/", httponly=True, samesite="strict")
        return answer

    return router
