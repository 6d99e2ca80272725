"""What is said of a curve in a few sentences: what the model lacks, the noise, the readings that were left out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from monitor.discovery.curve.explain import CurveExplanation
from monitor.methods.curve.problem import problem_of
from monitor.records import CurveCampaign, Verdict
from monitor.workflow.explain.compare_answer import CurveComparison
from monitor.workflow.explain.correlation_words import correlation
from monitor.workflow.explain.explain_answer import CurveMissing
from monitor.workflow.identify.answer import CurveNoise

#: So many rows on average at each value of a column make it look set rather than read.
ROWS_A_SETTING = 4
#: So many outliers, none further from the next than this, are a stretch of the series rather than single readings.
FEWEST_TOGETHER, NEAR = 5, 3


def curve_sentences(
    explanation: CurveExplanation,
    comparison: CurveComparison,
    missing: Sequence[CurveMissing],
    noise: CurveNoise,
    outliers: Sequence[int],
) -> str:
    """The finding in a few sentences; ``noise`` is what the missing effects leave, ``outliers`` are row numbers."""
    sentences = [*_missing_sentences(missing)] if missing else [_no_effect(explanation, comparison.verdict)]
    hint = _exchanged(explanation.first.problem.curve)
    if hint is not None:
        sentences.append(hint)
    if missing and explanation.final.exact:
        sentences.append("With all of it the model fits exactly, to the rounding of the numbers.")
    if noise.noticed:
        sentences.append(_noise_sentence(noise))
    if outliers:
        sentences += _outlier_sentences(outliers, comparison.response)
    return " ".join(sentences)


def _missing_sentences(missing: Sequence[CurveMissing]) -> list[str]:
    sentences = []
    certain = [effect for effect in missing if effect.certain]
    likely = [effect for effect in missing if not effect.certain]
    if certain:
        sentences.append(f"The model lacks {certain[0].effect}: {certain[0].description.meaning}.")
        if len(certain) > 1:
            sentences.append(f"After that {', then '.join(effect.effect for effect in certain[1:])}.")
    if likely:
        sentences.append(_likely(likely, bool(certain)))
    rivals = missing[0].indistinguishable_from
    if rivals:
        sentences.append(f"These rows cannot rule out {', '.join(rivals)} in its place.")
    return sentences


def _likely(likely: Sequence[CurveMissing], more: bool) -> str:
    """What is said of effects that noise alone might bring forth; ``more`` beside others that are certain."""
    doubt = max(effect.noise_alone_p for effect in likely)
    names = likely[0].effect + (f": {likely[0].description.meaning}" if not more else "")
    names += "".join(f", then {effect.effect}" for effect in likely[1:])
    return (
        f"{'Also likely' if more else 'Likely'}, not certain: {names}. Noise whose neighbouring rows resemble each "
        f"other would by itself look so in about {doubt:.0%} of such series; a longer one can tell."
    )


def _no_effect(explanation: CurveExplanation, verdict: Verdict) -> str:
    if verdict is Verdict.SOMETHING_IS_MISSING:
        return (
            "The model does not explain the measurements, but no effect that the columns allow explains more."
        )
    if explanation.first.exact:
        return "The model fits exactly, to the rounding of the numbers; nothing is left to explain."
    return "Nothing is missing that these rows can show."


def _exchanged(curve: CurveCampaign) -> str | None:
    """A hint where the response looks like what was set and an input of the base like what was read."""
    values = len(np.unique(curve.measured))
    if values * ROWS_A_SETTING > len(curve):
        return None
    for effect in problem_of(curve).base:
        levels = len(np.unique(curve.columns[effect.column])) if effect.column in curve.columns else 0
        if effect.column != curve.time and 2 * levels > len(curve):
            return (
                f"{curve.response} takes only {values} different values and {effect.column} {levels}: if "
                f"{curve.response} was set and {effect.column} was read, exchange them in response and base."
            )
    return None


def _noise_sentence(noise: CurveNoise) -> str:
    alike = noise.lag_one > 0
    worth = (
        f"for a mean they are worth {noise.effective_rows:.0f} of {noise.rows} rows, and " if alike else ""
    )
    return (
        f"Neighbouring rows {'resemble' if alike else 'alternate against'} each other ({correlation(noise)}): "
        f"{worth}all uncertainties and tests allow for it."
    )


def _outlier_sentences(rows: Sequence[int], response: str) -> list[str]:
    numbers = ", ".join(map(str, rows))
    sentences = [
        f"Row {numbers} contradicts the rest and was left out."
        if len(rows) == 1
        else f"Rows {numbers} contradict the rest and were left out."
    ]
    stretch = _stretch(rows)
    if stretch is not None:
        count, first, last = stretch
        sentences.append(
            f"{count} of them lie between rows {first} and {last}: a stretch in which {response} "
            "behaved otherwise rather than single wrong readings."
        )
    return sentences


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
