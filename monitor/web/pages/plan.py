"""The page of a plan: what the present one promises, and what fewer, more or other indexations and balls would."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from fastapi import APIRouter, Request
from starlette.datastructures import QueryParams
from starlette.responses import Response

from monitor.exceptions import InputError
from monitor.web.charts.plan import plan_chart
from monitor.web.forms import whole_number
from monitor.web.pages.campaign import named_campaign
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

        named_campaign(request, campaign)
        query, user, desk = request.query_params, request.state.user, request.app.state.desk
        present: dict[str, Any] = {"campaign": campaign, **({"model": model} if model else {})}
        document, wrong = present, ""
        try:
            document = present | _asked(query)
        except InputError as error:
            wrong = str(error)
        answer, refusal, waiting = desk.ask(user, "plan", document).outcome()
        if refusal and document != present:
            # What was asked for is refused: the present plan is shown, with the boxes as they were filled in.
            wrong, document = refusal, present
            answer, refusal, waiting = desk.ask(user, "plan", present).outcome()
        # A campaign without runs, a curve, has no plan, so that no answer comes.
        runs = None if answer is None else request.app.state.asker(user, "runs", {"campaign": campaign})
        return page(
            request, "plan.html",
            campaign=campaign, topology="" if runs is None else runs.topology, model=model, answer=answer,
            refusal=wrong or refusal, asked=document, typed=query, separate=separate,
            is_of_angles=isinstance(answer, AnglePlanAnswer), is_of_tests=isinstance(answer, InstrumentPlanAnswer),
            waiting=waiting,
            chart=plan_chart(answer) if isinstance(answer, BallPlanAnswer) and answer.proposed else None,
        )  # fmt: skip

    return router


def _asked(query: QueryParams) -> dict[str, Any]:
    """What the forms ask of a plan. Raises InputError for what a box cannot hold."""
    from monitor.workflow.plan.request import PlanRequest

    asked: dict[str, Any] = _size(query) | _wanted(query)
    keep = [whole_number("keep", number) for number in query.getlist("keep")]
    if keep:
        asked["keep"] = keep
    if query.get("separate"):
        asked["separate"] = PlanRequest.two_effects(query["separate"])
    return asked


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
