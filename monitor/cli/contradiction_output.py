"""Who contradicts all others, and the mistake of the file that explains it, for `compare`, `explain`, `identify`."""

from __future__ import annotations

from collections.abc import Sequence

from monitor.cli import output
from monitor.reporting.machine_finding import MistakeFound, mistake_sentence, what_to_do
from monitor.units import MICROMETRE
from monitor.workflow.identify.answer import LikelyMistake
from monitor.workflow.instruments.answer import AgainstOthers, Suspect

#: Of disagreements that chance makes more rarely no digits are shown: normal tails are not known so far out.
LEAST_PERCENT = 0.001


def likely_mistakes(mistakes: Sequence[LikelyMistake] | None) -> None:
    """Print what looks wrong in the file; nothing where nothing does."""
    if not mistakes:
        return
    mm = MICROMETRE.to_internal
    in_words = [
        MistakeFound(each.what, mm(each.rms_as_recorded_um), mm(each.rms_undone_um), each.explains)
        for each in mistakes
    ]
    output.say(f"{mistake_sentence(in_words)} Nothing was changed: {what_to_do(in_words)}")


def chance(by_chance: float) -> str:
    """How often chance does such a thing, in words."""
    percent = 100.0 * by_chance
    return f"at most {percent:.1g} %" if percent >= LEAST_PERCENT else f"less than {LEAST_PERCENT:g} %"


def against_others(beside: AgainstOthers) -> None:
    """Print who contradicts all others."""
    names, suspects = " or ".join(suspect.name for suspect in beside.suspects), beside.suspects
    agree = all(suspect.others_agree for suspect in suspects)
    said = f"setups in run {beside.run} contradict each other"
    if not suspects:
        who = (
            "No single setup or instrument explains it: more than one is wrong, or the model lacks something"
        )
    elif len(suspects) == 1:
        said = f"{names} in run {beside.run} contradicts all others together"
        rest = "the others agree" if agree else "nothing is left that could contradict"
        who = (
            f"Without {names} {rest}: look first at {_where(suspects)}; where they are right, the model lacks what the "
            "others do not meet"
        )
    else:
        if beside.is_of_two:
            said = f"{suspects[0].name} and {suspects[1].name} in run {beside.run} contradict each other"
        rest = "the others agree" if agree else "nothing contradicts"
        who = f"Without {names} {rest}, so that any of these may be the wrong one: look at {_where(suspects)}"
    output.say(
        f"{said} by {beside.size:.1f} u in "
        f"{beside.directions} {'direction' if beside.directions == 1 else 'directions'}; chance alone makes as much in "
        f"{chance(beside.by_chance)} of campaigns. {who}"
    )


def _where(suspects: Sequence[Suspect]) -> str:
    """What to look at: of a number that is stated nothing was read."""
    read = [suspect.name for suspect in suspects if not suspect.is_stated]
    parts = [f"signs, unit, points and rows of {' and '.join(read)}"] if read else []
    parts += [
        f"{suspect.name}, one number for {', '.join(suspect.setups)} (its certificate, the digits and the unit in the "
        "file, the temperature)"
        for suspect in suspects
        if suspect.is_stated
    ]
    return " and at ".join(parts)
