"""The page of the volumetric error over the strokes: of a run, or what changed between two runs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fastapi import APIRouter, Request
from starlette.responses import Response

from monitor.web.charts.volumetric import slice_charts, vectors_chart
from monitor.web.forms import whole_number
from monitor.web.pages.campaign import named_campaign
from monitor.web.rendering import page

if TYPE_CHECKING:
    from monitor.workflow.intake.campaigns import RunsAnswer

#: Points along each axis that the page offers.
POINTS = (3, 5, 7, 9)


def routes() -> APIRouter:
    """Return the route of the page."""
    router = APIRouter()

    @router.get("/map")
    def volumetric(
        request: Request, campaign: str, run: str = "", minus: str = "", pose: str = "", points: str = "",
        absolute: str = "",
    ) -> Response:  # fmt: skip
        """Show the error over the strokes at one rotary pose."""
        user, desk = request.state.user, request.app.state.desk
        numbers = {"run": run, "minus": minus, "pose": pose, "points": points}
        asked = {name: whole_number(name, text) for name, text in numbers.items() if text}
        document = {"campaign": campaign, **asked, **({"absolute": True} if absolute else {})}
        named_campaign(request, campaign)
        runs: RunsAnswer = request.app.state.asker(user, "runs", {"campaign": campaign})
        ticket = desk.ask(user, "map over the stroke", document)
        answer, refusal, waiting = ticket.outcome()
        return page(
            request, "map.html",
            campaign=campaign, topology=runs.topology, runs=runs.runs, run=run, minus=minus, pose=pose,
            points=points or "5", absolute=absolute, choices=POINTS, answer=answer, refusal=refusal,
            waiting=waiting,
            vectors=None if answer is None else vectors_chart(answer),
            slices=[] if answer is None else slice_charts(answer),
        )  # fmt: skip

    return router
