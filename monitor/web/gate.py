"""Stands before every request: which host was meant, how large, from whom, from which site; and what a browser may do.

What each check is against is said where it is made. The policy of the pages (Content-Security-Policy) has neither
unsafe-inline nor unsafe-eval; the one hash in it is that of the empty style sheet, which plotly.js fills rule by rule.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable, Mapping, MutableMapping
from html import escape
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import quote, urlsplit

from monitor.stopping import StoppedError
from monitor.web.desk import Desk
from monitor.web.faults import OUR_FAULT, SERVER_END, TakenBackError, TooLargeError, TooSlowError, refusal_of
from monitor.web.sessions import COOKIE, Sessions
from monitor.web.settings import UPLOAD_BYTES, ServerSettings
from monitor.web.users import User

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

EMPTY_STYLE = "'sha256-47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU='"
POLICY = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self'",
        f"style-src 'self' {EMPTY_STYLE}",
        "img-src 'self' data:",
        "font-src 'self'",
        "connect-src 'self'",
        "form-action 'self'",
        "frame-ancestors 'none'",
        "base-uri 'none'",
    )
)
HEADERS = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",  # with no-referrer a form would be sent from the origin "null"
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=()",
}
#: A document that is no upload: more text than any question of the contract needs.
DOCUMENT_BYTES = 2**20
#: What is served before anybody has logged in.
LOGIN = "/login"
PUBLIC = (LOGIN, "/static/")
#: Where a body may be as large as an upload.
UPLOADS = ("/import", "/certificates/verify", "/api/v1/")
#: A body may pause so long between two pieces (as the first of Apache's mod_reqtimeout, ``body=20``).
BODY_PAUSE_S = 20.0
_SAFE = frozenset({"GET", "HEAD", "OPTIONS"})


class Gate:
    """Lets a request in with ``state.user`` and ``state.session``, or answers it with a refusal in plain words."""

    def __init__(self, app: App, settings: ServerSettings, sessions: Sessions, desk: Desk) -> None:
        self.desk = desk
        self.close = desk.close
        self._app = app
        self._settings = settings
        self.sessions = self._sessions = sessions

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request (ASGI 3)."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        headers = {
            name.decode("latin-1").lower(): value.decode("latin-1") for name, value in scope["headers"]
        }
        refusal = self._refusal(scope, headers)
        from_form = _is_form(scope, headers)
        if refusal is not None:
            await _plain(send, *refusal, as_page=from_form)
            return
        user, session, cookie = self._visitor(scope, headers)
        limit, too_large = _limit(scope["path"]), _too_large(scope["path"])
        scope.setdefault("state", {}).update(user=user, session=session, sent_to="")
        if user is None and not _is_public(scope["path"]):
            if not _is_form(scope, headers):
                await self._send_away(scope, send)
                return
            # What was typed before the session ended is not lost: the log-in holds it until it can be sent.
            scope = {**scope, "path": LOGIN, "state": {**scope["state"], "sent_to": scope["path"]}}
        started = False

        async def send_with_headers(message: MutableMapping[str, Any]) -> None:
            nonlocal started
            if message["type"] == "http.response.start":
                started = True
                message["headers"] = [*message.get("headers", []), *self._headers(message, cookie)]
            await send(message)

        try:
            await self._app(scope, _counted(receive, limit, too_large), send_with_headers)
        except TooLargeError:
            if not started:
                await _plain(send, 413, too_large, as_page=from_form)
        except TooSlowError as error:
            if not started:
                await _plain(send, 408, str(error), as_page=from_form)
        except StoppedError as error:
            if not started:
                ended = refusal_of(TakenBackError(SERVER_END, error))
                await _plain(send, ended.status, ended.error, as_page=from_form)
        except Exception:
            # It was logged and answered where it happened; what follows would only be said twice.
            if not started:
                await _plain(send, 500, OUR_FAULT, as_page=from_form)

    def _refusal(self, scope: Scope, headers: Mapping[str, str]) -> tuple[int, str] | None:
        host = headers.get("host", "")
        name = host.rsplit(":", 1)[0] if host.rpartition(":")[2].isdigit() else host
        hosts = self._settings.hosts
        if hosts is not None and name.lower() not in hosts:
            # DNS rebinding: a page of another site that calls this computer by a name of its own.
            return (
                421,
                f"this server is not {name or 'without a name'}; open it as {', '.join(sorted(hosts))}",
            )
        length = headers.get("content-length", "0")
        if not length.isdigit() or int(length) > _limit(scope["path"]):
            return 413, _too_large(scope["path"])
        if scope["method"] in _SAFE:
            return None
        origin = headers.get("origin")
        if (origin is not None and urlsplit(origin).netloc.lower() != host.lower()) or headers.get(
            "sec-fetch-site", "same-origin"
        ) not in ("same-origin", "none"):
            # Browsers name the site that a form or a script belongs to; programs that are no browsers send neither.
            return 403, "this was sent by a page of another site; use the pages of this server"
        return None

    def _visitor(
        self, scope: Scope, headers: Mapping[str, str]
    ) -> tuple[User | None, str | None, str | None]:
        """Return the user, the key of the session, and the cookie to set where a session begins."""
        scheme, _, token = headers.get("authorization", "").partition(" ")
        if scheme.lower() == "bearer":
            return self._sessions.of_bearer(token.strip()), None, None
        key = _cookie(headers.get("cookie", ""))
        user = self._sessions.user_of(key)
        if user is not None:
            return user, key, None
        if self._sessions.users is not None:
            return None, None, None
        if scope["path"].startswith("/api/"):
            return self._sessions.host_user, None, None
        fresh = self._sessions.begin()
        assert fresh is not None
        return self._sessions.host_user, fresh, session_cookie(fresh, encrypted=self._settings.is_encrypted)

    def _headers(self, message: MutableMapping[str, Any], cookie: str | None) -> list[tuple[bytes, bytes]]:
        present = {name.lower() for name, _ in message.get("headers", [])}
        added = dict(HEADERS)
        if b"cache-control" not in present:
            added["Cache-Control"] = "no-store"
        if self._settings.certificate is not None:
            added["Strict-Transport-Security"] = "max-age=31536000"
        if cookie is not None:
            added["Set-Cookie"] = cookie
        return [(name.lower().encode(), value.encode()) for name, value in added.items()]

    async def _send_away(self, scope: Scope, send: Send) -> None:
        if scope["path"].startswith("/api/"):
            message = (
                "send a token: the header Authorization: Bearer TOKEN (monitor serve --add-user makes one)"
            )
            await _plain(send, 401, message, ("WWW-Authenticate", "Bearer"))
            return
        query = scope.get("query_string", b"").decode("latin-1")
        target = quote(scope["path"] + (f"?{query}" if query else "")) if scope["method"] in _SAFE else "/"
        await _plain(send, 303, "log in first", ("Location", f"{LOGIN}?then={target}"))


def session_cookie(key: str, *, encrypted: bool) -> str:
    """Return the header that sets the session's cookie: no script reads it, no other site sends it."""
    return f"{COOKIE}={key}; Path=/; HttpOnly; SameSite=Strict{'; Secure' if encrypted else ''}"


def _cookie(header: str) -> str | None:
    try:
        morsel = SimpleCookie(header).get(COOKIE)
    except CookieError:
        return None
    return None if morsel is None else morsel.value


def _is_public(path: str) -> bool:
    return any(path == public or (public.endswith("/") and path.startswith(public)) for public in PUBLIC)


def _is_form(scope: Scope, headers: Mapping[str, str]) -> bool:
    """Whether a page of ours sent what people filled in."""
    kind = headers.get("content-type", "").partition(";")[0].strip().lower()
    return (
        scope["method"] == "POST"
        and not scope["path"].startswith("/api/")
        and kind in ("application/x-www-form-urlencoded", "multipart/form-data")
    )


def _limit(path: str) -> int:
    """The most bytes of a body: the questions of the contract check the size of a document themselves."""
    return UPLOAD_BYTES if path.startswith(UPLOADS) else DOCUMENT_BYTES


def _too_large(path: str) -> str:
    return f"this is too large: {_limit(path) // 2**20} MiB may be sent at a time; pack the folder, or send less of it"


def _counted(receive: Receive, limit: int, text: str) -> Receive:
    """Count what comes: a body in pieces announces no length; and do not wait for the next piece without end."""
    total, is_whole = 0, False

    async def counting() -> MutableMapping[str, Any]:
        nonlocal total, is_whole
        try:
            # After the whole body comes only that the connection ends, which takes as long as the answer.
            message = await asyncio.wait_for(receive(), None if is_whole else BODY_PAUSE_S)
        except TimeoutError as error:
            raise TooSlowError(
                f"nothing more of this request came for {BODY_PAUSE_S:g} s; send it again"
            ) from error
        is_whole = not message.get("more_body", False)
        total += len(message.get("body", b""))
        if total > limit:
            raise TooLargeError(text)
        return message

    return counting


async def _plain(
    send: Send, status: int, text: str, *headers: tuple[str, str], as_page: bool = False
) -> None:
    """Send a sentence as JSON, which a program reads and a person too; to who sent a form as a page, ``as_page``."""
    every = {
        "Content-Type": f"{'text/html' if as_page else 'application/json'}; charset=utf-8",
        **HEADERS,
        "Cache-Control": "no-store",
        **dict(headers),
    }
    body = (_page(text) if as_page else json.dumps({"error": text}, ensure_ascii=False)).encode()
    await send(
        {
            "type": "http.response.start",
            "status": status,
            "headers": [(name.lower().encode(), value.encode("utf-8")) for name, value in every.items()],
        }
    )
    await send({"type": "http.response.body", "body": body})


def _page(text: str) -> str:
    """A page of its own: what stands before the application knows none of its templates."""
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8"><title>refused</title>'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        '<link rel="stylesheet" href="/static/pages.css"></head><body><main><h1>Refused</h1>'
        f'<p class="refusal" role="alert">{escape(text)}</p><p>The browser leads back to what was filled in; '
        '<a href="/">or go to the fleet</a>.</p>'
        "</main></body></html>"
    )
