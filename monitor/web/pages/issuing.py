"""Issue or amend a certificate: a form with a box for all that the laboratory states, and refusals at their boxes."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from fastapi import APIRouter, Request
from starlette.concurrency import run_in_threadpool
from starlette.responses import RedirectResponse, Response

from monitor.exceptions import InputError, MonitorError
from monitor.reporting.certificate.completeness import (
    IncompleteCertificateError,
    MissingItem,
    RefusedGroundsError,
)
from monitor.reporting.certificate.grounds import GroundKind, ground_sentence
from monitor.reporting.texts import texts_of
from monitor.said import check_number_of_certificate
from monitor.web.asking import Asker, check_role
from monitor.web.faults import Refusal, refusal_of
from monitor.web.forms import Form, read_form, whole_number
from monitor.web.laboratory_form import box_of, form_words, groups, laboratory_file, texts_of_file
from monitor.web.pages.campaign import named_campaign
from monitor.web.rendering import link, page
from monitor.web.sending import attachment
from monitor.web.users import User

#: The largest laboratory's file that fills the form.
FILE_BYTES = 2**20
#: The file that the answers are kept in.
FILE_NAME = "laboratory.toml"
#: What refusals say of a file that nobody wrote, as the form says it.
_WORDS_OF_FORM = {
    f"{FILE_NAME} was refused:": "these boxes were refused:",
    ", without quotes": "",
    " without quotes": "",
}
#: What stands in the place of the number on a preview.
PREVIEW = "preview {}"
NO_RUN = "choose the run that is certified"
GONE = Refusal(
    404, "what was filled in here is not held any more; nothing of it was stored: fill it in again"
)


@dataclass(frozen=True)
class _Outcome:
    """What a button of the form led to: a certificate's ``number``, a ``preview`` (PDF; ``has_preview`` once it is
    held), or a ``refusal`` with what is wrong at each box."""

    number: str = ""
    notes: tuple[str, ...] = ()
    preview: bytes = b""
    has_preview: bool = False
    refusal: Refusal | None = None
    faults: Mapping[str, str] = field(default_factory=dict)

    @property
    def is_of_grounds(self) -> bool:
        """Whether a box that accepts a ground has a fault."""
        return any(box.startswith("accept.") for box in self.faults)


def routes() -> APIRouter:
    """Return the routes of the form and its buttons."""
    router = APIRouter()

    @router.get("/certificate/new")
    def form(
        request: Request, campaign: str, run: str = "", replaces: str = "", filled: str = ""
    ) -> Response:
        """Show the form, empty, or as it was filled in when one of its buttons was pressed."""
        texts = {"campaign": campaign, "run": run, "replaces": replaces, "laboratory.language": "en"}
        held = request.app.state.outcomes.outcome_of(request.state.user.name, filled) if filled else None
        if held is not None:
            return _shown(request, *held)
        return _shown(request, texts, _Outcome(refusal=GONE if filled else None))

    @router.post("/certificate/new")
    async def press(request: Request) -> Response:
        """Do what the button that was pressed says."""
        async with read_form(request) as filled:
            button = filled.texts.get("button", "")
            texts = dict(filled.texts)
            if button == "keep":
                try:
                    return attachment(FILE_NAME, laboratory_file(texts).encode("utf-8"))
                except InputError as error:
                    outcome = _refused(error, "")
            elif button == "fill":
                texts, outcome = _with_file(texts, filled)
            else:
                outcome = await run_in_threadpool(_pressed_once, request, filled, texts)
        return RedirectResponse(_held(request, texts, outcome), status_code=303)

    @router.get("/certificate/preview.pdf")
    def preview(request: Request) -> Response:
        """Send the user's latest preview, to be looked at."""
        return Response(
            request.app.state.previews.document_of(request.state.user.name),
            media_type="application/pdf",
            headers={"Content-Disposition": 'inline; filename="preview.pdf"'},
        )

    return router


def _held(request: Request, texts: Mapping[str, str], outcome: _Outcome) -> str:
    """Hold what a button led to, and a preview; return the address that shows it."""
    state, user = request.app.state, request.state.user
    if outcome.preview:
        state.previews.hold(user.name, outcome.preview)
        outcome = replace(outcome, preview=b"", has_preview=True)
    key = state.outcomes.hold(user.name, (texts, outcome))
    names = {name: texts.get(name) or None for name in ("run", "replaces")}
    return link("/certificate/new", campaign=texts.get("campaign", ""), **names, filled=key)


def _from_file(form: Form) -> dict[str, str]:
    if not form.files:
        raise InputError("choose the laboratory's file, which monitor certificate template writes")
    content = form.files[0].content.read(FILE_BYTES + 1)
    if len(content) > FILE_BYTES:
        raise InputError("this file is too large to be a laboratory's")
    return texts_of_file(content)


def _with_file(texts: dict[str, str], form: Form) -> tuple[dict[str, str], _Outcome]:
    """The boxes with what the file has; as they were, with the refusal, where it is none."""
    try:
        return texts | _from_file(form), _Outcome()
    except InputError as error:
        return texts, _Outcome(refusal=refusal_of(error))


def _pressed_once(request: Request, form: Form, texts: Mapping[str, str]) -> _Outcome:
    """What a button led to; a form that is sent twice issues one certificate."""
    state = request.app.state
    outcome: _Outcome = state.presses.once(
        form.press,
        lambda: _pressed(state.asker, request.state.user, texts, state.working_folder),
        lambda outcome: bool(outcome.number),
    )
    return outcome


def _shown(request: Request, texts: Mapping[str, str], outcome: _Outcome) -> Response:
    # Loaded where it is met: whoever opens the first page waits for what is loaded before.
    from monitor.workflow.certificate.request import METHODS, RULES

    campaign = texts.get("campaign", "")
    named_campaign(request, campaign)
    runs = request.app.state.asker(request.state.user, "runs", {"campaign": campaign}).runs
    return page(
        request, "certificate_new.html", status=outcome.refusal.status if outcome.refusal else 200,
        campaign=campaign, texts=texts, runs=runs, groups=groups(texts, outcome.faults), outcome=outcome,
        not_applicable=form_words(texts)("boxes.not_applicable"),
        methods=METHODS, rules=RULES, grounds=tuple(GroundKind),
        accepts=outcome.is_of_grounds or any(texts.get(f"accept.{kind}") for kind in GroundKind),
    )  # fmt: skip


def _pressed(asker: Asker, user: User, texts: Mapping[str, str], working_folder: Path) -> _Outcome:
    """Preview or issue what the form says."""
    draft = texts.get("button") != "issue"
    question = "amend certificate" if texts.get("replaces") and not draft else "issue certificate"
    check_role(user, question)
    campaign = {"campaign": texts.get("campaign", "")}
    if not texts.get("run") and not texts.get("as_left") and len(asker(user, "runs", campaign).runs) > 1:
        return _Outcome(refusal=Refusal(400, NO_RUN), faults={"run": NO_RUN})
    with tempfile.TemporaryDirectory(dir=working_folder) as folder:
        laboratory = Path(folder, FILE_NAME)
        try:
            laboratory.write_text(laboratory_file(texts), encoding="utf-8")
            document = _document(texts, draft=draft)
            answer = asker(
                user, question, document, {"laboratory": laboratory, "out": Path(folder)}, storing=not draft
            )
            if draft:
                return _Outcome(preview=Path(answer.file).read_bytes(), notes=answer.notes or ())
        except MonitorError as error:
            return _refused(error, folder)
        return _Outcome(number=answer.certificate.number, notes=answer.notes or ())


def _document(texts: Mapping[str, str], *, draft: bool) -> dict[str, Any]:
    campaign = texts.get("campaign", "")
    document: dict[str, Any] = {"campaign": campaign}
    for name in ("run", "as_left"):
        if texts.get(name):
            document[name] = whole_number(name, texts[name])
    for name in ("method", "number", "issued_on", "conformity"):
        if texts.get(name):
            document[name] = texts[name]
    accepted = {kind.value: texts.get(f"accept.{kind}", "") for kind in GroundKind}
    document["accept"] = {kind: reason for kind, reason in accepted.items() if reason}
    document["with_map"] = bool(texts.get("with_map"))
    if draft:
        if texts.get("number"):
            # A preview has a number of its own; that of the form is judged as it will be.
            check_number_of_certificate(texts["number"])
        return {**document, "draft": True, "number": PREVIEW.format(campaign)[:60]}
    if texts.get("replaces"):
        return {**document, "replaces": texts["replaces"], "reason": texts.get("reason", "")}
    return document


def _refused(error: MonitorError, folder: str) -> _Outcome:
    """The refusal in words, and at every box that it names what is missing there."""
    if isinstance(error, RefusedGroundsError):
        return _refused_by_grounds(error)
    refusal = refusal_of(error, {**({f"{folder}/": ""} if folder else {}), **_WORDS_OF_FORM})
    lines = [line.strip() for line in refusal.error.splitlines()]
    faults: dict[str, str] = {}
    if isinstance(error, IncompleteCertificateError):
        faults = _gaps_at_boxes(error.missing)
        lines = [lines[0], *map(str, error.missing)]
    else:
        for line in lines:
            for box in _boxes_named(line):
                faults.setdefault(box, line.removeprefix("--accept "))
    return _Outcome(refusal=Refusal(refusal.status, lines[0], tuple(lines[1:])), faults=faults)


def _refused_by_grounds(error: RefusedGroundsError) -> _Outcome:
    """The grounds that speak against a certificate, each at the box that accepts it, and all else that it lacks."""
    texts = texts_of()
    faults = _gaps_at_boxes(error.missing)
    said: dict[GroundKind, list[str]] = {}
    for ground in error.grounds:
        said.setdefault(ground.kind, []).append(ground_sentence(ground, texts))
    for kind, sentences in said.items():
        faults[f"accept.{kind}"] = "; ".join(sentences)
    lines = [f"{kind}: {'; '.join(sentences)}" for kind, sentences in said.items()]
    what = f" and {len(error.missing)} items are missing" if error.missing else ""
    return _Outcome(
        refusal=Refusal(
            422,
            f"the certificate is refused: {', '.join(said)} {'speak' if len(said) > 1 else 'speaks'} against it{what}. "
            "Correct what is wrong; or, where the laboratory can answer for it, say why in its box below, which is "
            "printed on the certificate",
            (*lines, *map(str, error.missing)),
        ),
        faults=faults,
    )


def _gaps_at_boxes(missing: Sequence[MissingItem]) -> dict[str, str]:
    """What is missing, by the box that answers it."""
    faults: dict[str, str] = {}
    for gap in missing:
        for box in box_of(gap.key):
            faults.setdefault(box, f"{gap.item}{f', {gap.part}' if gap.part else ''} ({gap.clause})")
    return faults


def _boxes_named(line: str) -> list[str]:
    """The boxes that a line of a refusal begins with: ``standards.1.issued_on`` is one, ``customer.contact`` a key."""
    numbered = re.match(r"(\w+\.\d+\.\w+) ", line)
    if numbered:
        return [numbered[1]]
    ground = re.match(r"--accept ([a-z-]+): ", line)
    if ground:
        return [f"accept.{ground[1]}"]
    named = re.match(r"(\w+)\.(\w+) ", line)
    return box_of(f"[{named[1]}] {named[2]}") if named else []
