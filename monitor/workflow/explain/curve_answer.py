"""What is said of a curve in a few sentences: what the model lacks, the noise, the readings that were left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from monitor.discovery.curve.explain import CurveExplanation
from monitor.discovery.search.comparison import Verdict
from monitor.methods.curve.problem import problem_of
from monitor.records import CurveCampaign

#: So many rows on average at each value of a column make it look set rather than read.
ROWS_A_SETTING = 4
#: So many outliers, none further from the next than this, are a stretch of the series rather than single readings.
FEWEST_TOGETHER, NEAR = 5, 3


def correlation(noise: Mapping[str, Any]) -> str:
    """The noise in words: both of its numbers, for what a mean is worth depends on how slowly it fades."""
    told = f"correlation {noise['lag_one']:.2f}"
    return f"{told}, times {noise['slow']:.2f} with each further row" if noise["lag_one"] > 0.0 else told


def _exchanged(curve: CurveCampaign) -> str | None:
    """A hint where the response looks like what was set and an input of the base like what was read."""
    values = len(np.unique(curve.measured))
    if values * ROWS_A_SETTING > len(curve):
        return None
    for effect in problem_of(curve).base:
        taken = len(np.unique(curve.columns[effect.column])) if effect.column in curve.columns else 0
        if effect.column != curve.time and 2 * taken > len(curve):
            return (
                f"{curve.response} takes only {values} different values and {effect.column} {taken}: if "
                f"{curve.response} was set and {effect.column} was read, exchange them in response and base."
            )
    return None


def _likely(likely: Sequence[Mapping[str, Any]], more: bool) -> str:
    """What is told of effects that noise alone might bring forth."""
    doubt = max(one["noise_alone_p"] for one in likely)
    named = likely[0]["effect"] + (f": {likely[0]['meaning']}" if not more else "")
    named += "".join(f", then {one['effect']}" for one in likely[1:])
    return (
        f"{'Also likely' if more else 'Likely'}, not certain: {named}. Noise whose neighbouring rows resemble each "
        f"other would by itself look so in about {doubt:.0%} of such series; a longer one can tell."
    )


def answer(document: Mapping[str, Any], found: CurveExplanation) -> str:
    """The finding in a few sentences."""
    parts = []
    missing = document["missing"]
    certain = [one for one in missing if one["certain"]]
    likely = [one for one in missing if not one["certain"]]
    if certain:
        parts.append(f"The model lacks {certain[0]['effect']}: {certain[0]['meaning']}.")
        if len(certain) > 1:
            parts.append(f"After that {', then '.join(one['effect'] for one in certain[1:])}.")
    if likely:
        parts.append(_likely(likely, bool(certain)))
    if missing:
        if missing[0]["indistinguishable_from"]:
            parts.append(
                f"These rows cannot rule out {', '.join(missing[0]['indistinguishable_from'])} in its place."
            )
    elif document["verdict"] == Verdict.SOMETHING_IS_MISSING:
        parts.append(
            "The model does not explain the measurements, but no effect that the columns allow explains more."
        )
    elif found.first.exact:
        parts.append("The model fits exactly, to the rounding of the numbers; nothing is left to explain.")
    else:
        parts.append("Nothing is missing that these rows can show.")
    hint = _exchanged(found.first.problem.curve)
    if hint is not None:
        parts.append(hint)
    if missing and found.final.exact:
        parts.append("With all of it the model fits exactly, to the rounding of the numbers.")
    noise = document["autocorrelation_after"]
    if noise["noticed"]:
        resembles = "resemble" if noise["lag_one"] > 0 else "alternate against"
        parts.append(
            f"Neighbouring rows {resembles} each other ({correlation(noise)}): "
            + (
                f"for a mean they are worth {noise['effective_rows']:.0f} of {noise['rows']} rows, and "
                if noise["lag_one"] > 0
                else ""
            )
            + "all uncertainties and tests allow for it."
        )
    if document["suspect_data"]:
        stretch = _stretch([one["sequence"] for one in document["suspect_data"]])
        rows = ", ".join(str(one["sequence"]) for one in document["suspect_data"])
        one = len(document["suspect_data"]) == 1
        parts.append(f"{'Row' if one else 'Rows'} {rows} {'contradicts' if one else 'contradict'} the rest and "
                     f"{'was' if one else 'were'} left out.")  # fmt: skip
        if stretch is not None:
            count, first, last = stretch
            parts.append(
                f"{count} of them lie between rows {first} and {last}: a stretch in which {document['response']} "
                "behaved otherwise rather than single wrong readings."
            )
    return " ".join(parts)


def _stretch(rows: Sequence[int]) -> tuple[int, int, int] | None:
    """How many rows of the longest stretch lie together, its first and its last; None where none does."""
    groups: list[list[int]] = []
    for row in sorted(rows):
        if groups and row - groups[-1][-1] <= NEAR:
            groups[-1].append(row)
        else:
            groups.append([row])
    longest = max(groups, key=len, default=[])
    together = len(longest) >= FEWEST_TOGETHER and 2 * len(longest) > longest[-1] - longest[0]
    return (len(longest), longest[0], longest[-1]) if together else None
