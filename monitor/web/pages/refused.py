"""Why a form was refused: at an address of its own with the way back to the form, or at the form as filled in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from urllib.parse import parse_qsl, urlsplit

from fastapi import APIRouter, Request
from starlette.responses import RedirectResponse, Response

from monitor.web.access import ROOT
from monitor.web.faults import Refusal
from monitor.web.forms import own_address
from monitor.web.rendering import link, refusal_page

#: Statuses of what somebody can mend in the form; 403 and what is larger than allowed are answered at once.
MENDED_IN_THE_FORM = frozenset({400, 404, 422})
GONE = Refusal(404, "why this was refused is not held any more; nothing was stored: send the form again")


@dataclass(frozen=True)
class RefusedForm:
    """A form that was refused, with the texts that it held."""

    refusal: Refusal
    texts: Mapping[str, str]


def routes() -> APIRouter:
    """Return the route of the page."""
    router = APIRouter()

    @router.get("/refused")
    def refused(request: Request, why: str) -> Response:
        """Show why a form was refused; loaded again it shows the same."""
        held = request.app.state.outcomes.outcome_of(request.state.user.name, why)
        # An outcome of another form, such as a filled-in certificate, is none of this page's.
        return refusal_page(request, *(held if _is_of_this_page(held) else (GONE, "")))

    return router


def _is_of_this_page(held: object) -> bool:
    return isinstance(held, tuple) and len(held) == 2 and isinstance(held[0], Refusal)


def leads_to_its_refusal(request: Request, refusal: Refusal) -> bool:
    """Whether it was a form that was refused, for what can be mended in it."""
    is_form = request.method == "POST" and not request.url.path.startswith(ROOT)
    user = getattr(request.state, "user", None)
    return is_form and user is not None and refusal.status in MENDED_IN_THE_FORM


def led_back_to_the_form(
    request: Request, form: RefusedForm, page: str, query: Mapping[str, str], fragment: str
) -> Response:
    """Hold a form; return the way to its ``page``, as it was looked at, which shows it with the refusal.

    ``query`` is what the page needs at least.
    """
    key = request.app.state.outcomes.hold(request.state.user.name, form)
    return led_back(request, page, {**query, "refused": key}, fragment)


def led_back(request: Request, page: str, query: Mapping[str, str], fragment: str = "") -> Response:
    """Return the way back to a page as it was looked at when its form was sent, with ``query`` besides."""
    source = urlsplit(request.headers.get("referer", ""))
    looked_at = dict(parse_qsl(source.query)) if source.path == page else {}
    looked_at.pop("refused", None)
    address = link(page, **{**looked_at, **query})
    return RedirectResponse(f"{address}#{fragment}" if fragment else address, status_code=303)


def refused_form(request: Request, key: str) -> RefusedForm | None:
    """Return the form that a page has to show again; None where there is none, or it is not held any more."""
    held = request.app.state.outcomes.outcome_of(request.state.user.name, key) if key else None
    return held if isinstance(held, RefusedForm) else None


def led_to_its_refusal(request: Request, refusal: Refusal) -> Response:
    """Hold why a form was refused; return the way to the page that says so."""
    source = urlsplit(request.headers.get("referer", ""))
    back = (
        own_address(f"{source.path}?{source.query}" if source.query else source.path) if source.path else ""
    )
    key = request.app.state.outcomes.hold(request.state.user.name, (refusal, back))
    return RedirectResponse(link("/refused", why=key), status_code=303)
