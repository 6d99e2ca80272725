"""What is said of a machine in a few sentences: what its model lacks, what looks wrong in the file, what changed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from monitor.discovery import Explanation, Mistake
from monitor.discovery.machine.rounds import Limit
from monitor.discovery.machine.suspects import MOST_BAD_POINTS
from monitor.records import Verdict
from monitor.units import MICROMETRE
from monitor.workflow.explain.explain_answer import (
    ChangedParameter,
    ChangedTarget,
    MachineMissing,
    MovedTarget,
)

#: A residual beyond so many stated standard uncertainties after the search leaves no result of it standing.
HOPELESS_TIMES = 100.0
# What is said first where more is left than any effect leaves, and no simple exchange brings it down.
GROSS = (
    "More is left than the effects of a machine leave: look first for exchanged columns or targets, a wrong sign or "
    "unit, or the geometry in campaign.toml; of the simple mistakes that were tried none alone explains it. "
)
# What is said where the search ended at a limit.
LIMITS = {
    Limit.EFFECTS: (
        "The search ended at the most effects that it looks for: more may be missing; add these to the model and "
        "look again."
    ),
    Limit.BAD_POINTS: f"The search for bad points ended at {MOST_BAD_POINTS}: there may be more.",
    Limit.ROUNDS: (
        "Effects and bad points had not settled when the search ended: look again with these effects in the model."
    ),
}
ONE_RUN = (
    "one run cannot show what varies from run to run, what stepped between runs, or how well a reading repeats; "
    "measure the same plan again"
)


def is_hopeless(explanation: Explanation) -> bool:
    """Whether the search left a residual beyond anything that effects of a machine leave."""
    return explanation.final.rms > HOPELESS_TIMES * explanation.final.sigma


def machine_sentences(
    explanation: Explanation,
    verdict: Verdict,
    missing: Sequence[MachineMissing],
    bad_points: int,
    changes: Sequence[MovedTarget | ChangedTarget | ChangedParameter],
) -> str:
    """The finding in one or two sentences, for people who look rather than read."""
    if explanation.mistakes:
        return (
            mistake_sentence(explanation.mistakes)
            + " Nothing was changed, and no effect was looked for: correct the file first."
        )
    sentences = [*_missing_sentences(missing, verdict)]
    if bad_points:
        sentences.append(f"{bad_points} bad point{'s were' if bad_points > 1 else ' was'} left out.")
    target_word = explanation.final.problem.target_word
    for change in changes:
        subject, verb = (
            (change.parameter, "stepped")
            if isinstance(change, ChangedParameter)
            else (f"{target_word} {change.target}", "moved")
        )
        sentences.append(f"{subject} {verb} by {change.size:.1f} {change.unit} at run {change.run}.")
    sentences += [LIMITS[limit] for limit in explanation.limits]
    if explanation.unfitted:
        sentences.append(
            f"Could not be fitted and {'was' if len(explanation.unfitted) == 1 else 'were'} skipped: "
            f"{', '.join(explanation.unfitted)}."
        )
    return (GROSS if is_hopeless(explanation) else "") + " ".join(sentences)


def _missing_sentences(missing: Sequence[MachineMissing], verdict: Verdict) -> list[str]:
    if not missing:
        return [
            "The model does not explain the measurements, but no effect of the catalogue explains more."
            if verdict is Verdict.SOMETHING_IS_MISSING
            else "Nothing is missing that this plan can see."
        ]
    first = missing[0]
    sentences = [f"The model lacks {first.effect}: {first.description.meaning}."]
    if first.shape_unknown:
        sentences.append(f"The catalogue does not have its shape; {first.nearest_shape} comes nearest.")
        if len(missing) > 1:
            sentences.append("The other effects hold whatever its shape is.")
    if first.varies_from_run_to_run:
        sentences.append("It varies from run to run and no recorded column follows it.")
    if first.indistinguishable_from:
        sentences.append(f"These data cannot tell it apart from {', '.join(first.indistinguishable_from)}.")
    return sentences


def mistake_sentence(mistakes: Sequence[Mistake]) -> str:
    """What looks wrong in the file, in one sentence."""
    first = mistakes[0]
    ways = " or ".join(mistake.what for mistake in mistakes)
    before = (
        f"residual {_length(first.rms_as_recorded)} as recorded"
        if np.isfinite(first.rms_as_recorded)
        else "as recorded the readings fit no machine of this file"
    )
    return f"It looks as if {ways}: {before}, residual {_length(first.rms_undone)} with that undone."


def _length(mm: float) -> str:
    return f"{mm:.2g} mm" if mm >= 0.1 else f"{MICROMETRE.to_display(mm):.2g} µm"
