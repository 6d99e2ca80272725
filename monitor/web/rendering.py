"""Renders the templates of ``reports/pages`` for a request; every text from outside is escaped."""

from __future__ import annotations

import json
import secrets
from functools import cache
from typing import Any
from urllib.parse import urlencode, urlsplit

from jinja2 import Environment, FunctionLoader, StrictUndefined
from markupsafe import Markup
from starlette.requests import Request
from starlette.responses import HTMLResponse

from monitor import __version__
from monitor.reporting.confounding import charted, whether_with_condition, whether_with_cycle
from monitor.reporting.plain_names import plain_name
from monitor.reporting.resources import report_text
from monitor.reporting.step_words import step_in_words
from monitor.web import words
from monitor.web.faults import Refusal
from monitor.web.forms import Typed, own_address
from monitor.web.sessions import Sessions
from monitor.web.static import maps_style


def page(request: Request, template: str, *, status: int = 200, **context: Any) -> HTMLResponse:
    """Return a page; every template also has the user, the path and the proof that its forms carry."""
    sessions: Sessions = request.app.state.sessions
    session = getattr(request.state, "session", None)
    text = _environment().get_template(template).render(
        user=getattr(request.state, "user", None),
        path=request.url.path,
        here=f"{request.url.path}?{request.url.query}" if request.url.query else request.url.path,
        proof=sessions.proof(session) if session else "",
        once=secrets.token_urlsafe(12),
        logs_in=sessions.users is not None,
        reads_only=request.app.state.settings.reading_only,
        **context,
    )  # fmt: skip
    return HTMLResponse(text, status_code=status)


def refusal_page(request: Request, refusal: Refusal, back: str = "") -> HTMLResponse:
    """Return the page that says what was wrong; ``back`` is the address of the form, where it was one."""
    return page(request, "refusal.html", status=refusal.status, refusal=refusal, back=back)


def again_page(request: Request, typed: Typed, why: str, status: int = 200) -> HTMLResponse:
    """Return the page that shows what a form held that was not taken, and sends it where that is wanted."""
    source = urlsplit(request.headers.get("referer", ""))
    path = source.path if source.path not in ("", "/login") else "/"
    back = f"{path}?{source.query}" if source.query else path
    return page(request, "again.html", status=status, typed=typed, why=why, back=own_address(back))


def prepare() -> None:
    """Compile the templates of the first page, which whoever opens it first would wait for."""
    for name in ("fleet.html", "machine.html"):
        _environment().get_template(name)


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=FunctionLoader(lambda name: report_text(f"pages/{name}")),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["without_option"] = words.without_option
    environment.globals |= {
        "charted": charted,
        "whether_with_condition": whether_with_condition,
        "whether_with_cycle": whether_with_cycle,
        "version": __version__,
        "link": link,
        "maps_style": maps_style,
        "plain_name": plain_name,
        "number": words.number,
        "with_u": words.with_u,
        "step_in_words": step_in_words,
        "channel": words.channel,
        "probability": words.probability,
        "day": words.day,
        "counted": words.counted,
        "so_far": words.so_far,
        "aligned": words.aligned,
        "as_fine_as": words.as_fine_as,
        "importing": words.importing,
        "asked_for": words.asked_for,
        "earliest_and_latest": words.earliest_and_latest,
        "listed": words.listed,
        "what_breaks": words.what_breaks,
        "embedded": _embedded,
    }
    return environment


def link(path: str, **query: Any) -> str:
    """Return an address with its query; what is None is left out."""
    named = {key: value for key, value in query.items() if value is not None}
    return f"{path}?{urlencode(named)}" if named else path


def _embedded(document: Any) -> Markup:
    """Return a document as JSON that can stand in a script element of type application/json, which never runs."""
    text = json.dumps(document, ensure_ascii=False, allow_nan=False, default=str)
    escaped = text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")
    return Markup(escaped)
