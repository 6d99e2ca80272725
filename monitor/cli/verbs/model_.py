"""Models and their versions: what they contain, adding and removing effects, and the error falling step by step."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from monitor.cli import output
from monitor.cli.database import ask, opened
from monitor.cli.parser import common, described
from monitor.cli.residual_output import files, four_digits
from monitor.workflow.explain.request import HistoryRequest
from monitor.workflow.model.answer import AffectedAnswer, ChangeModelAnswer
from monitor.workflow.model.request import (
    AddEffectRequest,
    RemoveEffectRequest,
    ShowModelRequest,
    UseModelRequest,
)
from monitor.workflow.model.show import list_all_models, show_model
from monitor.workflow.model.use import use_model

if TYPE_CHECKING:
    from monitor.workflow.explain.version_answer import CurveVersion, MachineVersion

EXAMPLE = 'monitor model add "EXX:reversal" --to samba --as with-reversal --campaign hidden-reversal-x'


def options(parser: ArgumentParser) -> None:
    verbs = parser.add_subparsers(dest="what", metavar="list|show|add|remove|use|history", required=True)
    listed = verbs.add_parser("list", **described("all models and versions", "monitor model list"))
    listed.set_defaults(run=_list)
    shown = verbs.add_parser("show", **described("what a model contains", "monitor model show with-reversal"))
    shown.add_argument("name", metavar="NAME", help="a model, or a version of it: NAME@2")
    shown.set_defaults(run=_show)
    added = verbs.add_parser("add", **described("a new version with further effects", EXAMPLE))
    added.add_argument("effect", nargs="+", metavar="EFFECT", help="an effect such as EXX:reversal")
    added.add_argument("--to", required=True, metavar="NAME", help="the model, or a version of it: NAME@2")
    added.add_argument("--as", dest="as_", metavar="NEW", help="another name for the new version")
    added.add_argument("--note", default="", help="why")
    added.add_argument("--campaign", metavar="CAMPAIGN", help="where the error is shown before and after")
    added.add_argument(
        "--dry-run", action="store_true", help="only say for whom the model would change; nothing is written"
    )
    added.set_defaults(run=_add)
    removed = verbs.add_parser(
        "remove",
        **described(
            "a new version without one effect", "monitor model remove EXX:reversal --from with-reversal"
        ),
    )
    removed.add_argument("effect", metavar="EFFECT", help="an effect such as EXX:reversal")
    removed.add_argument(
        "--from", dest="from_", required=True, metavar="NAME", help="the model, or a version of it: NAME@2"
    )
    removed.add_argument("--as", dest="as_", metavar="NEW", help="another name for the new version")
    removed.set_defaults(run=_remove)
    used = verbs.add_parser(
        "use",
        **described(
            "follow a machine by this model from now on: trend, report, certificate, fleet",
            "monitor model use with-reversal --machine HU40-T --reason 'backlash of X since May'",
        ),
    )
    used.add_argument("name", metavar="NAME", help="the model, or a version of it: NAME@2")
    used.add_argument("--machine", required=True, metavar="ID", help="the machine")
    used.add_argument("--reason", required=True, metavar="TEXT", help="why; it is stored")
    used.set_defaults(run=_use)
    past = verbs.add_parser(
        "history",
        **described(
            "the error falling, step by step", "monitor model history with-reversal --figures figures"
        ),
    )
    past.add_argument("name", metavar="NAME", help="a model, or a version of it: NAME@2")
    past.add_argument("--campaign", metavar="CAMPAIGN", help="default: where it was last compared")
    past.add_argument("--figures", type=Path, metavar="DIR", help="draw how the error falls")
    past.set_defaults(run=_history)
    for verb in (listed, shown, added, removed, used, past):
        common(verb)


def _list(options: Namespace) -> int:
    with opened(options) as db:
        answer = ask(db, list_all_models)
    if options.json:
        output.document(answer)
        return 0
    rows = [
        [
            model.model,
            model.parent or "",
            ", ".join(model.effects) or "the method's base effects alone",
            model.note,
        ]
        for model in answer.models
    ]
    output.table("", ["model", "parent", "effects added to the base", "note"], rows, text_columns=4)
    return 0


def _show(options: Namespace) -> int:
    with opened(options) as db:
        answer = ask(db, show_model, ShowModelRequest(options.name))
    if options.json:
        output.document(answer)
        return 0
    version = answer.version
    output.say(version.model + (f", from {version.parent}" if version.parent else ""))
    for machine, effects in answer.base.items():
        subject = "base of" if "~" in effects[0] else "free in every run of"
        frames = answer.refers_to.get(machine, {})
        output.say(f"  {subject} {machine}: {' '.join(effects)}")
        for line in _by_frame(effects, frames):
            output.say(f"    {line}")
    for effect in version.effects:
        output.say(f"  shared by all runs: {effect}: {answer.meaning.get(effect, 'no machine here has it')}")
        frames_of_effect = {frames[effect] for frames in answer.refers_to.values() if effect in frames}
        if frames_of_effect:
            output.say(f"    relative to: {' or '.join(sorted(frames_of_effect))}")
    return 0


def _by_frame(effects: Sequence[str], frames: Mapping[str, str]) -> list[str]:
    """Lines that say which effects refer to what."""
    grouped: dict[str, list[str]] = {}
    for effect in effects:
        if effect in frames:
            grouped.setdefault(frames[effect], []).append(effect)
    return [f"relative to {frame}: {' '.join(names)}" for frame, names in grouped.items()]


def _add(options: Namespace) -> int:
    # What fits a model takes a third of a second to load: `model list` and `model show` do without it.
    from monitor.workflow.model.change import add_effect, affected

    effect, *beside = options.effect
    request = AddEffectRequest(effect, options.to, options.as_, options.note, options.campaign, tuple(beside))
    with opened(options) as db:
        changed = ask(db, affected, request)
        if not options.json and (changed.in_use or options.dry_run):
            _will_change(changed)
        if options.dry_run:
            if options.json:
                output.document(changed)
            return 0
        with output.working("fitting"):
            answer = ask(db, add_effect, request)
    return _changed(answer, options.json)


def _will_change(changed: AffectedAnswer) -> None:
    """Say before anything is written for whom the model changes."""
    if not changed.in_use:
        output.say("a new model: nothing changes for any machine until `monitor model use` gives it one")
        return
    name = changed.name
    output.say(
        f"this makes {name}@{changed.next_version}, which '{name}' means from then on, for everybody (--as NEW leaves "
        f"{name} alone)"
    )
    if changed.changed:
        output.say(
            f"followed by it from then on, and identified anew: {', '.join(changed.changed)} "
            f"(`monitor model use NEW --machine ID` gives a model to one machine)"
        )
    if changed.keep:
        output.say(f"these keep the model that was chosen for them: {', '.join(changed.keep)}")


def _use(options: Namespace) -> int:
    request = UseModelRequest(options.name, options.machine, options.reason)
    with opened(options) as db, output.working("identifying"):
        answer = ask(db, use_model, request)
    if options.json:
        output.document(answer)
        return 0
    output.say(
        f"{answer.machine} is followed by {answer.model} ({answer.method}) from now on, before by {answer.before}"
    )
    if answer.identified:
        output.say(f"identified by it: {', '.join(answer.identified)}")
    for campaign, why in answer.failed.items():
        output.say(f"left out of its history, as it cannot be identified: {campaign}: {why}")
    return 0


def _remove(options: Namespace) -> int:
    from monitor.workflow.model.change import remove_effect

    with opened(options) as db:
        answer = ask(db, remove_effect, RemoveEffectRequest(options.effect, options.from_, options.as_))
    return _changed(answer, options.json)


def _changed(answer: ChangeModelAnswer, as_json: bool) -> int:
    if as_json:
        output.document(answer)
        return 0
    version = answer.model.version
    output.say(f"model {version.model} now has: {', '.join(version.effects) or 'the base effects alone'}")
    if answer.note_on_name:
        output.say(answer.note_on_name)
    if answer.history:
        _steps(answer.history[-2:])
        for refusal in answer.history[-1].no_number:
            output.say(f"no number: {', '.join(refusal.parameters)}: {refusal.why}")
    return 0


def _history(options: Namespace) -> int:
    from monitor.workflow.explain.versions import history

    with opened(options) as db, output.working("fitting every version"):
        answer = ask(db, history, HistoryRequest(options.name, options.campaign, options.figures))
    if options.json:
        output.document(answer.steps)
        return 0
    _steps(answer.steps)
    files(answer.figures)
    return 0


def _steps(steps: Sequence[MachineVersion | CurveVersion]) -> None:
    """The error of every version, and of a curve its Bayesian information criterion."""
    # Loaded here, as below: lists of models have no steps, and the answers of `compare` take longer than a list.
    from monitor.workflow.explain.version_answer import CurveVersion

    unit = steps[0].unit
    curve = isinstance(steps[0], CurveVersion)
    columns = [
        "model",
        "added",
        *([] if curve else ["relative to"]),
        f"RMS / {unit}",
        f"held-out / {unit}",
        f"repeatability / {unit}",
        "lack of fit p",
    ]
    output.table(
        f"on campaign {steps[0].campaign}",
        [*columns, "BIC"] if curve else columns,
        [_step(step) for step in steps],
        text_columns=2 if curve else 3,
    )


def _step(step: MachineVersion | CurveVersion) -> list[str]:
    from monitor.workflow.explain.version_answer import CurveVersion, MachineVersion

    curve = step if isinstance(step, CurveVersion) else None
    number = output.micrometres if curve is None else four_digits
    return [
        step.model,
        step.added or (f"without {step.removed}" if step.removed else "base"),
        *([", ".join(step.refers_to.values())] if isinstance(step, MachineVersion) else []),
        number(step.rms),
        number(step.heldout_rms),
        number(step.repeatability),
        output.probability(step.lack_of_fit_p),
        *([] if curve is None else [f"{curve.bic:.1f}"]),
    ]
