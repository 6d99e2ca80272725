"""Log in with a token, and out."""

from __future__ import annotations

from fastapi import APIRouter, Request
from starlette.responses import RedirectResponse, Response

from monitor.web.forms import read_form
from monitor.web.gate import session_cookie
from monitor.web.rendering import page
from monitor.web.sessions import COOKIE, Sessions


def routes() -> APIRouter:
    """Return the routes of the log-in."""
    router = APIRouter()

    @router.get("/login")
    def form(request: Request, then: str = "/") -> Response:
        """Show the form."""
        return page(request, "login.html", then=_inside(then), wrong=False)

    @router.post("/login")
    async def login(request: Request) -> Response:
        """Begin a session for the user of a token.

        No proof is asked: there is no session yet, and the gate refuses what another site's page sends.
        """
        sessions: Sessions = request.app.state.sessions
        async with request.form(max_files=0) as texts:
            then = _inside(str(texts.get("then") or "/"))
            key = sessions.begin(str(texts.get("token") or "").strip())
        if key is None:
            return page(request, "login.html", status=403, then=then, wrong=True)
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


def _inside(address: str) -> str:
    """Return an address of this server, the first page for any other."""
    return address if address.startswith("/") and not address.startswith(("//", "/\\")) else "/"
