"""The page of a plan: what the present one promises, and what fewer, more or other indexations and balls would."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from fastapi import APIRouter, Request
from starlette.responses import Response

from monitor.exceptions import InputError
from monitor.web.charts.plan import plan_chart
from monitor.web.forms import whole_number
from monitor.web.rendering import page

#: A field of the form that asks for the standard uncertainty of a parameter begins so.
WANTED = "u_"


def routes() -> APIRouter:
    """Return the route of the page."""
    router = APIRouter()

    @router.get("/plan")
    def plan(request: Request, campaign: str, model: str = "", separate: str = "") -> Response:
        """Weigh the plan of a campaign, and the one that the form asks for."""
        # Loaded where it is met: whoever opens the first page waits for what is loaded before.
        from monitor.workflow.plan.answer import AnglePlanAnswer, BallPlanAnswer, InstrumentPlanAnswer
        from monitor.workflow.plan.request import PlanRequest

        query = request.query_params
        document: dict[str, Any] = {"campaign": campaign, **({"model": model} if model else {})}
        document |= _size(query) | _wanted(query)
        keep = [whole_number("keep", number) for number in query.getlist("keep")]
        if keep:
            document["keep"] = keep
        if separate:
            document["separate"] = PlanRequest.two_effects(separate)
        ticket = request.app.state.desk.ask(request.state.user, "plan", document)
        answer, refusal, waiting = ticket.outcome()
        return page(
            request, "plan.html",
            campaign=campaign, model=model, answer=answer, refusal=refusal, asked=document, separate=separate,
            is_of_angles=isinstance(answer, AnglePlanAnswer), is_of_tests=isinstance(answer, InstrumentPlanAnswer),
            waiting=waiting,
            chart=plan_chart(answer) if isinstance(answer, BallPlanAnswer) and answer.proposed else None,
        )  # fmt: skip

    return router


def _size(query: Mapping[str, str]) -> dict[str, int]:
    texts = {name: query.get(name, "") for name in ("balls", "poses")}
    return {name: whole_number(name, text) for name, text in texts.items() if text}


def _wanted(query: Mapping[str, str]) -> dict[str, dict[str, float]]:
    """The uncertainties that the form asks for. Raises InputError for what is no positive number."""
    wanted = {}
    for field, text in query.items():
        if field.startswith(WANTED) and text.strip():
            try:
                value = float(text.replace(",", "."))
            except ValueError:
                value = math.nan
            if not 0.0 < value < math.inf:
                name = field.removeprefix(WANTED)
                raise InputError(f"the wanted uncertainty of {name} is a positive number, not '{text}'")
            wanted[field.removeprefix(WANTED)] = value
    return {"wanted": wanted} if wanted else {}
