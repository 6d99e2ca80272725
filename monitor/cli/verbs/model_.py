"""Models and their versions: what they contain, adding and removing effects, and the error falling step by step."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from monitor.cli import curve_output, output
from monitor.cli.database import opened
from monitor.cli.parser import common, told
from monitor.exceptions import NotFoundError
from monitor.workflow import models
from monitor.workflow.explain import comparison

EXAMPLE = 'monitor model add "EXX:reversal" --to samba --as with-reversal --campaign hidden-reversal-x'


def options(parser: ArgumentParser) -> None:
    verbs = parser.add_subparsers(dest="what", metavar="list|show|add|remove|history", required=True)
    listed = verbs.add_parser("list", **told("all models and versions", "monitor model list"))
    listed.set_defaults(run=_list)
    shown = verbs.add_parser("show", **told("what a model contains", "monitor model show with-reversal"))
    shown.add_argument("name", metavar="NAME")
    shown.set_defaults(run=_show)
    added = verbs.add_parser("add", **told("a new version with one more effect", EXAMPLE))
    added.add_argument("effect", metavar="EFFECT")
    added.add_argument("--to", required=True, metavar="NAME", help="the model, or a version of it: NAME@2")
    added.add_argument("--as", dest="as_", metavar="NEW", help="another name for the new version")
    added.add_argument("--note", default="", help="why")
    added.add_argument("--campaign", metavar="CAMPAIGN", help="where the error is shown before and after")
    added.set_defaults(run=_add)
    removed = verbs.add_parser(
        "remove",
        **told("a new version without one effect", "monitor model remove EXX:reversal --from with-reversal"),
    )
    removed.add_argument("effect", metavar="EFFECT")
    removed.add_argument("--from", dest="from_", required=True, metavar="NAME")
    removed.add_argument("--as", dest="as_", metavar="NEW")
    removed.set_defaults(run=_remove)
    past = verbs.add_parser(
        "history",
        **told("the error falling, step by step", "monitor model history with-reversal --figures figures"),
    )
    past.add_argument("name", metavar="NAME")
    past.add_argument("--campaign", metavar="CAMPAIGN", help="default: where it was last compared")
    past.add_argument("--figures", type=Path, metavar="DIR")
    past.set_defaults(run=_history)
    for one in (listed, shown, added, removed, past):
        common(one)


def _list(options: Namespace) -> int:
    with opened(options) as db:
        found = models.list_(db)
    if options.json:
        output.document(found)
        return 0
    rows = [
        [
            one["model"],
            one["parent"] or "",
            ", ".join(one["effects"]) or "the method's base effects alone",
            one["note"],
        ]
        for one in found["models"]
    ]
    output.table("", ["model", "parent", "effects added to the base", "note"], rows, text_columns=4)
    return 0


def _show(options: Namespace) -> int:
    with opened(options) as db:
        found = models.show(db, options.name)
    if options.json:
        output.document(found)
        return 0
    output.say(f"{found['model']}" + (f", from {found['parent']}" if found["parent"] else ""))
    for machine, effects in found["base"].items():
        told = "base of" if "~" in effects[0] else "free in every run of"
        output.say(f"  {told} {machine}: {' '.join(effects)}")
    for effect in found["effects"]:
        output.say(
            f"  shared by all runs: {effect}: {found['meaning'].get(effect, 'no machine here has it')}"
        )
    return 0


def _add(options: Namespace) -> int:
    # One transaction: a campaign that is not there leaves no model behind.
    with opened(options) as db, output.working("fitting"), db.transaction():
        made = models.add(db, options.effect, options.to, options.as_, options.note, options.campaign)
        document = models.show(db, f"{made.name}@{made.version}")
        try:
            document["history"] = comparison.history(db, f"{made.name}@{made.version}", options.campaign)
        except NotFoundError:
            if options.campaign is not None:
                raise
            document["history"] = []
    return _told(_with_default(document, options.as_), options.json)


def _with_default(document: models.Document, as_: str | None) -> models.Document:
    """Without --as the name itself has another meaning from now on: said, since others use it too."""
    name, version = document["name"], document["version"]
    changed = version > 1 and as_ in (None, name)
    document["note_on_name"] = (
        f"'{name}' without a version means {document['model']} from now on, for everybody and every campaign; "
        f"{name}@{version - 1} is what it was (--as NAME leaves {name} alone)"
        if changed
        else None
    )
    return document


def _remove(options: Namespace) -> int:
    with opened(options) as db:
        made = models.remove(db, options.effect, options.from_, options.as_)
        document = models.show(db, f"{made.name}@{made.version}")
    document["history"] = []
    return _told(_with_default(document, options.as_), options.json)


def _told(document: models.Document, as_json: bool) -> int:
    if as_json:
        output.document(document)
        return 0
    output.say(
        f"model {document['model']} now has: {', '.join(document['effects']) or 'the base effects alone'}"
    )
    if document["note_on_name"]:
        output.say(document["note_on_name"])
    if document["history"]:
        _steps(document["history"][-2:])
        for one in document["history"][-1]["no_number"]:
            output.say(f"no number: {', '.join(one['parameters'])}: {one['why']}")
    return 0


def _history(options: Namespace) -> int:
    with opened(options) as db, output.working("fitting every version"):
        steps = comparison.history(db, options.name, options.campaign)
    files = []
    if options.figures is not None:
        if "unit" in steps[0]:
            from monitor.workflow.explain.curve_figures import curve_history_figure

            files = curve_history_figure(steps, options.figures)
        else:
            from monitor.workflow.figures import history_figure

            files = history_figure(steps, options.figures)
    if options.json:
        output.document(steps)
        return 0
    _steps(steps)
    for file in files:
        output.say(file)
    return 0


def _steps(steps: list[comparison.Document]) -> None:
    if "unit" in steps[0]:
        curve_output.steps(steps)
        return
    rows = [
        [
            one["model"],
            one["added"] or (f"without {one['removed']}" if one["removed"] else "base"),
            output.micrometres(one["rms_um"]),
            output.micrometres(one["heldout_rms_um"]),
            output.micrometres(one["repeatability_um"]),
            output.probability(one["lack_of_fit_p"]),
        ]
        for one in steps
    ]
    output.table(
        f"on campaign {steps[0]['campaign']}",
        ["model", "added", "RMS / µm", "held-out / µm", "repeatability / µm", "lack of fit p"],
        rows,
        text_columns=2,
    )
