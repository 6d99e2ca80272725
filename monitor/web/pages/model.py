"""Model against measurement: where it fails, what is missing, add it, watch the error fall, take it out again."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fastapi import APIRouter, Request
from starlette.concurrency import run_in_threadpool
from starlette.responses import JSONResponse, RedirectResponse, Response

from monitor.exceptions import InputError
from monitor.web.charts.residuals import (
    MAGNIFICATIONS,
    driver_chart,
    explained_vectors,
    failing_charts,
    falling_chart,
    first_magnification,
    pose_names,
    ranking_chart,
    scene_chart,
    scene_vectors,
)
from monitor.web.desk import Desk
from monitor.web.forms import Form, asked_once, read_form, whole_number
from monitor.web.pages.campaign import named_campaign
from monitor.web.rendering import link, page
from monitor.web.ticket import Ticket
from monitor.web.words import listed

if TYPE_CHECKING:
    from monitor.workflow.model.answer import ChangeModelAnswer

#: So long the script's question for an effect's arrows is held before it has to ask again.
FETCH_S = 20.0
#: Names of the boxes of effects that are added together, before their ranks.
TICKED = "ticked-"


def routes() -> APIRouter:
    """Return the routes of the page, of its two buttons and of what its script asks for."""
    router = APIRouter()

    @router.get("/model")
    def model(
        request: Request, campaign: str, model: str = "", effect: str = "", driver: str = "", changed: bool = False,
        overtaken: bool = False,
    ) -> Response:  # fmt: skip
        """Compare a model with a campaign; with an effect tried beside it.

        What was ``changed``, here or, ``overtaken``, elsewhere, is read from the version: no link can say it.
        """
        # Loaded where it is met: whoever opens the first page waits for what is loaded before.
        from monitor.workflow.explain.explain_answer import MachineExplanation

        ask, user = request.app.state.asker, request.state.user
        row = named_campaign(request, campaign)
        answers = _Answers(request, campaign, model, effect, driver, in_machine=row.rows is None)
        compare, explanation = answers.compare, answers.explanation
        missing = explanation.missing if isinstance(explanation, MachineExplanation) else ()
        residuals, steps = answers.residuals, answers.steps
        # Runs may be left out of an explanation for which nothing is compared.
        answered = compare or explanation
        label = model if answered is None else answered.comparison.model
        versions = ask(user, "models").models
        current = _version(versions, label)
        return page(
            request, "model.html",
            row=row, campaign=campaign, compare=compare, explanation=explanation, copied=answers.copied,
            missing=() if explanation is None else explanation.missing, refusals=answers.refusals,
            model=label, asked=model,
            effect=effect, changed=changed, overtaken=overtaken, effects=[candidate.effect for candidate in missing],
            scene=None if residuals is None else scene_chart(residuals),
            vectors=None if residuals is None else scene_vectors(residuals),
            residuals=residuals, magnifications=MAGNIFICATIONS,
            magnification=None if residuals is None else first_magnification(residuals),
            poses=[] if residuals is None else pose_names(residuals),
            driven=answers.driven, against=None if answers.driven is None else driver_chart(answers.driven),
            failing=[] if compare is None else failing_charts(compare),
            ranking=ranking_chart(missing) if len(missing) > 1 else None,
            falling=falling_chart(steps, missing[0] if missing else None, _expected(compare)), steps=steps,
            versions=_of_method(versions, row.method, label), current=current, latest=_latest(versions, label),
            pinned=pinned, changes=changes,
            waiting=answers.waiting,
        )  # fmt: skip

    router.get("/model/explained")(_explained)

    @router.post("/model/add")
    async def add(request: Request) -> Response:
        """Add an effect, or those that are ticked together: a new version of the model, or a new model."""
        async with read_form(request) as form:
            campaign, (effect, *beside) = form.text("campaign"), _effects(form)
            document = {"effect": effect, "beside": beside, "campaign": campaign, "to": form.text("to")}
            document |= form.filled("new_name", "note")
        overtaken = None if form.filled("new_name") else _overtaken(request, form)
        if overtaken is not None:
            return overtaken
        return _back(campaign, await asked_once(request, form, "add effect", document))

    @router.post("/model/undo")
    async def undo(request: Request) -> Response:
        """Take an effect out again: a new version without it."""
        async with read_form(request) as form:
            campaign, effect = form.text("campaign"), form.text("effect")
            document = {"effect": effect, "model": form.text("model")}
        overtaken = _overtaken(request, form)
        if overtaken is not None:
            return overtaken
        return _back(campaign, await asked_once(request, form, "remove effect", document))

    return router


def _effects(form: Form) -> list[str]:
    """Return the effect of a card, or those that are ticked, by rank. Raises InputError where none is."""
    if "effect" in form.texts:
        return [form.text("effect")]
    ranks = {
        name.removeprefix(TICKED): effect for name, effect in form.texts.items() if name.startswith(TICKED)
    }
    if not ranks:
        raise InputError("no effect is ticked; tick those that are added together")
    return [ranks[rank] for rank in sorted(ranks, key=lambda rank: whole_number("rank", rank))]


async def _explained(request: Request, campaign: str, effect: str, model: str = "") -> Response:
    """Send what an effect explains of every residual, for the script.

    202 while it is being computed, 409 where somebody took the question back.
    """
    document = {"campaign": campaign, **({"model": model} if model else {}), "effect": effect}
    desk: Desk = request.app.state.desk
    ticket = await run_in_threadpool(desk.ask, request.state.user, "residuals", document)
    await ticket.settled(FETCH_S)
    if ticket.is_taken_back:
        return JSONResponse(None, 409)
    residuals = ticket.answer()
    return JSONResponse(None, 202) if residuals is None else JSONResponse(explained_vectors(residuals))


class _Answers:
    """What the page shows of a model and a campaign, as far as it is computed; ``refusals`` say why a part is not."""

    def __init__(
        self, request: Request, campaign: str, model: str, effect: str, driver: str, *, in_machine: bool
    ) -> None:
        user, desk = request.state.user, request.app.state.desk
        asked = {"campaign": campaign, **({"model": model} if model else {})}
        # All are asked before any is waited for.
        tickets: dict[str, Ticket] = {"explain": desk.ask(user, "explain", asked)}
        if in_machine:
            tried = asked | ({"effect": effect} if effect else {})
            tickets["residuals"] = desk.ask(user, "residuals", tried)
            by_driver = tried | ({"driver": driver} if driver else {})
            tickets["driven"] = desk.ask(user, "residuals by driver", by_driver)
        tickets["compare"] = desk.ask(user, "compare", asked)
        self.refusals = dict.fromkeys(("explain", "residuals", "driven", "compare", "history"), "")
        self.waiting: Ticket | None = None
        self.compare = self._take("compare", tickets["compare"])
        if self.compare is not None:
            version = {"campaign": campaign, "model": self.compare.comparison.model}
            tickets["history"] = desk.ask(user, "model history", version)
        explained = self._take("explain", tickets["explain"])
        self.explanation = None if explained is None else explained.explanation
        # Both name the same; while one is computed, or was refused, the other has it.
        self.copied = next(
            (each.copied_readings for each in (self.compare, explained) if each is not None), None
        )
        self.residuals = self._take("residuals", tickets.get("residuals"))
        self.driven = self._take("driven", tickets.get("driven"))
        history = self._take("history", tickets.get("history"))
        self.steps = () if history is None else history.steps

    def _take(self, name: str, ticket: Ticket | None) -> Any:
        """The answer of a ticket; None while it is computed, which is noted, and where it was refused."""
        if ticket is None:
            return None
        answer, self.refusals[name], waiting = ticket.outcome()
        self.waiting = self.waiting or waiting
        return answer


def _expected(compare: Any) -> float | None:
    """The RMS that the stated uncertainty of the readings would leave; None while nothing is compared."""
    return None if compare is None else compare.comparison.expected_rms_um


def pinned(label: str) -> str:
    """Return the name of a version that stays its name when there are more: ``samba@1`` for ``samba``."""
    return label if "@" in label or not label else f"{label}@1"


def _overtaken(request: Request, form: Form) -> Response | None:
    """The way to the newer version that somebody, or another window, made since the page of the form was."""
    shown = form.texts.get("latest", "")
    if not shown or request.app.state.presses.is_known(form.press):
        return None
    latest = _latest(request.app.state.asker(request.state.user, "models").models, shown)
    if latest is None or pinned(latest.model) == shown:
        return None
    address = link("/model", campaign=form.text("campaign"), model=pinned(latest.model), overtaken=1)
    return RedirectResponse(address, status_code=303)


def changes(version: Any) -> str:
    """Return what a version adds to its parent and takes out of it, three of them at most."""
    return listed([*(f"+ {name}" for name in version.added), *(f"− {name}" for name in version.removed)], 3)


def _back(campaign: str, answer: ChangeModelAnswer) -> Response:
    address = link("/model", campaign=campaign, model=answer.model.version.model, changed=1)
    return RedirectResponse(address, status_code=303)


def _latest(versions: Any, label: str) -> Any:
    """The latest version of the model of a label; None for a model that was never stored."""
    name = label.partition("@")[0]
    of_model = [version for version in versions if version.name == name]
    return max(of_model, key=lambda version: version.version, default=None)


def _of_method(versions: Any, method: str, shown: str) -> list[Any]:
    """The versions that descend from a method's own model, whose base effects alone fit its campaigns; and what is
    shown, whatever it is."""
    parents = {pinned(version.model): version.parent for version in versions}

    def root(label: str) -> str:
        while parents.get(label):
            label = pinned(parents[label])
        return label.partition("@")[0]

    return [
        version for version in versions if version.model == shown or root(pinned(version.model)) == method
    ]


def _version(versions: Any, name: str) -> Any:
    """The version by its label, ``samba`` or ``samba@2``; None for a model that was never stored."""
    base, _, number = name.partition("@")
    return next(
        (version for version in versions if version.name == base and version.version == int(number or 1)),
        None,
    )
