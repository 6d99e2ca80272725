"""The page of a campaign: its runs and conditions, whether the days differ, and which numbers belong together."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fastapi import APIRouter, Request
from starlette.responses import RedirectResponse, Response

from monitor.exceptions import InputError, NotFoundError
from monitor.web.asking import check_role
from monitor.web.charts.chart import Chart
from monitor.web.charts.statistics import cloud_chart, correlation_chart, p_value_chart, region_chart
from monitor.web.forms import asked_once, read_form, whole_number
from monitor.web.rendering import page

if TYPE_CHECKING:
    from monitor.store import CampaignRow
    from monitor.workflow.intake.campaigns import CampaignsAnswer, RunsAnswer
    from monitor.workflow.run_statistics.answer import StatisticsAnswer
    from monitor.workflow.uncertainty.answer import UncertaintyAnswer
    from monitor.workflow.uncertainty.cloud import CloudAnswer

#: Campaigns of the list: the latest; a machine's own stand on its page.
MOST_LISTED = 200


def routes() -> APIRouter:
    """Return the routes of the list of campaigns and of the page of one."""
    router = APIRouter()

    @router.get("/campaigns")
    def campaigns(
        request: Request, most: int = MOST_LISTED, containing: str = "", machine: str = "", method: str = ""
    ) -> Response:
        """List the latest so many campaigns, of all or of those that were searched."""
        ask, user = request.app.state.asker, request.state.user
        wanted = {"containing": containing, "machine": machine, "method": method}
        filled = {name: text for name, text in wanted.items() if text.strip()}
        every = ask(user, "campaigns", {"latest": most})
        answer = ask(user, "campaigns", {"latest": most, **filled}) if filled else every
        return page(
            request, "campaigns.html", most=most, answer=answer, wanted=wanted, filled=filled,
            machines=sorted({row.machine for row in every.campaigns} | {machine} - {""}),
            methods=sorted({row.method for row in every.campaigns} | {method} - {""}),
        )  # fmt: skip

    @router.get("/campaign")
    def campaign(
        request: Request, name: str, by: str = "day", first: str = "", second: str = "", run: str = ""
    ) -> Response:
        """Show a campaign; two of its parameters with the regions that hold all of them."""
        ask, user, desk = request.app.state.asker, request.state.user, request.app.state.desk
        row = named_campaign(request, name)
        if row.rows is not None:
            return page(request, "curve.html", row=row)
        runs: RunsAnswer = ask(user, "runs", {"campaign": name})
        asked = {"campaign": name, "by": by}
        statistics, why_no_statistics, waiting = desk.ask(user, "statistics", asked).outcome()
        trials = bool(request.query_params.get("trials"))
        regions, region, why_no_regions = None, None, ""
        if first or second:
            try:
                question, document = _regions_asked(name, first, second, run, trials=trials)
                regions, why_no_regions, computed = desk.ask(user, question, document).outcome()
                waiting = waiting or computed
                region = None if regions is None else _region(regions, first, second)
            except InputError as error:
                regions, why_no_regions = None, str(error)
        return page(
            request, "campaign.html",
            row=row, runs=runs, conditions=_conditions(runs), by=by, run=run,
            statistics=statistics, why_no_statistics=why_no_statistics,
            charts=[] if statistics is None else _charts(statistics),
            regions=regions, why_no_regions=why_no_regions, first=first, second=second,
            region=region,
            trials=trials, waiting=waiting,
        )  # fmt: skip

    @router.post("/campaign/withdraw")
    async def withdraw(request: Request) -> Response:
        """Let a campaign count no longer; of its certificates, which stay, the list says so."""
        async with read_form(request) as form:
            name, typed = form.text("campaign"), form.texts.get("typed", "")
            document = {"campaign": name, "reason": form.texts.get("reason", "")}
        check_role(request.state.user, "withdraw campaign")
        if typed != name:
            raise InputError(f"type the name of the campaign, '{name}', to withdraw it, not '{typed[:60]}'")
        answer = await asked_once(request, form, "withdraw campaign", document)
        return RedirectResponse("/certificates" if answer.certificates else "/campaigns", status_code=303)

    return router


def named_campaign(request: Request, name: str) -> CampaignRow:
    """Return the campaign of a name. Raises NotFoundError, which says when and why it was withdrawn if it was."""
    answer: CampaignsAnswer = request.app.state.asker(request.state.user, "campaigns", {"campaign": name})
    if answer.campaigns:
        return answer.campaigns[0]
    withdrawn = "".join(
        f" any more: it was withdrawn on {row.withdrawn_at:%Y-%m-%d} ({row.reason})"
        for row in answer.withdrawn[-1:]
    )
    raise NotFoundError(
        f"there is no campaign '{name}'{withdrawn}; the page Campaigns lists those that count"
    )


def _regions_asked(
    name: str, first: str, second: str, run: str, *, trials: bool
) -> tuple[str, dict[str, Any]]:
    """The question for the regions of a pair, by Monte Carlo or not. Raises InputError where it is none."""
    if not (first and second and first != second):
        raise InputError("choose two different parameters for the ellipse and the rectangle")
    of_run = {"campaign": name} | ({"run": whole_number("run", run)} if run else {})
    if trials:
        return "monte carlo cloud", {**of_run, "first": first, "second": second}
    return "uncertainty", {**of_run, "method": "guf"}


def _conditions(runs: RunsAnswer) -> list[str]:
    return list(dict.fromkeys(name for run in runs.runs for name in run.conditions))


#: With one degree of freedom every correlation is +1 or -1, whatever the parameters share.
_FEWEST_FREEDOMS = 2


def _charts(statistics: StatisticsAnswer) -> list[Chart]:
    histograms = [
        p_value_chart(name, histogram, statistics.coordinates.n)
        for name, histogram in statistics.coordinates.histograms.items()
    ]
    if statistics.degrees_of_freedom_pooled < _FEWEST_FREEDOMS:
        return histograms
    return [correlation_chart(statistics), *histograms]


def _region(regions: UncertaintyAnswer | CloudAnswer, first: str, second: str) -> Chart:
    # Loaded where it is met: whoever opens the first page waits for what is loaded before.
    from monitor.workflow.uncertainty.cloud import CloudAnswer

    if isinstance(regions, CloudAnswer):
        return cloud_chart(regions)
    for name in (first, second):
        if name not in regions.parameters:
            raise InputError(
                f"'{name}' has no number in this campaign; choose of {', '.join(regions.parameters)}"
            )
    return region_chart(regions, first, second)
