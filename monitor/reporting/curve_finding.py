"""What is said of a curve in a few sentences: what the model lacks, the noise, the readings that were left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

#: So many outliers, none further from the next than this, are a stretch of the series rather than single readings.
FEWEST_TOGETHER, NEAR = 5, 3


@dataclass(frozen=True)
class LikelyEffect:
    """A missing effect as a sentence says it: ``certain`` where noise whose neighbours resemble each other is ruled
    out, which would do as well with the probability ``noise_alone``; ``others`` are not ruled out instead of it."""

    effect: str
    meaning: str
    certain: bool
    noise_alone: float
    others: Sequence[str]


@dataclass(frozen=True)
class NeighbourNoise:
    """Noise whose neighbouring ``rows`` resemble each other: ``lag_one`` is the correlation of neighbours, ``slow`` its
    factor with each further row, ``effective_rows`` how many independent rows a mean is worth."""

    lag_one: float
    slow: float
    rows: int
    effective_rows: float


@dataclass(frozen=True)
class Exchanged:
    """A response that looks set, with so few different values, and an input of the base that looks read."""

    values: int
    column: str
    levels: int


@dataclass(frozen=True)
class CurveFinding:
    """What an explanation of a curve has found.

    ``explained``: the model explains the measurements; ``exact``: it fits to the rounding of the numbers, with
    all that is missing if anything is; ``noise`` is what the missing effects leave, ``outliers`` are row numbers.
    """

    response: str
    explained: bool
    exact: bool
    missing: Sequence[LikelyEffect]
    exchanged: Exchanged | None
    noise: NeighbourNoise | None
    outliers: Sequence[int]


def curve_sentences(finding: CurveFinding) -> str:
    """The finding in a few sentences."""
    sentences = _missing_sentences(finding.missing) if finding.missing else [_no_effect(finding)]
    exchanged, response = finding.exchanged, finding.response
    if exchanged is not None:
        sentences.append(
            f"{response} takes only {exchanged.values} different values and {exchanged.column} {exchanged.levels}: if "
            f"{response} was set and {exchanged.column} was read, exchange them in response and base."
        )
    if finding.missing and finding.exact:
        sentences.append("With all of it the model fits exactly, to the rounding of the numbers.")
    if finding.noise is not None:
        sentences.append(_noise_sentence(finding.noise))
    if finding.outliers:
        sentences += _outlier_sentences(finding.outliers, response)
    return " ".join(sentences)


def correlation(lag_one: float, slow: float) -> str:
    """The correlation of neighbouring rows, and how slowly it fades: what a mean is worth depends on both."""
    neighbours = f"correlation {lag_one:.2f}"
    return f"{neighbours}, times {slow:.2f} with each further row" if lag_one > 0.0 else neighbours


def _missing_sentences(missing: Sequence[LikelyEffect]) -> list[str]:
    sentences = []
    certain = [effect for effect in missing if effect.certain]
    likely = [effect for effect in missing if not effect.certain]
    if certain:
        sentences.append(f"The model lacks {certain[0].effect}: {certain[0].meaning}.")
        if len(certain) > 1:
            sentences.append(f"After that {', then '.join(effect.effect for effect in certain[1:])}.")
    if likely:
        sentences.append(_likely(likely, bool(certain)))
    rivals = missing[0].others
    if rivals:
        sentences.append(f"These rows cannot rule out {', '.join(rivals)} in its place.")
    return sentences


def _likely(likely: Sequence[LikelyEffect], more: bool) -> str:
    """What is said of effects that noise alone might bring forth; ``more`` beside others that are certain."""
    doubt = max(effect.noise_alone for effect in likely)
    names = likely[0].effect + (f": {likely[0].meaning}" if not more else "")
    names += "".join(f", then {effect.effect}" for effect in likely[1:])
    return (
        f"{'Also likely' if more else 'Likely'}, not certain: {names}. Noise whose neighbouring rows resemble each "
        f"other would by itself look so in about {doubt:.0%} of such series; a longer one can tell."
    )


def _no_effect(finding: CurveFinding) -> str:
    if not finding.explained:
        return (
            "The model does not explain the measurements, but no effect that the columns allow explains more."
        )
    if finding.exact:
        return "The model fits exactly, to the rounding of the numbers; nothing is left to explain."
    return "Nothing is missing that these rows can show."


def _noise_sentence(noise: NeighbourNoise) -> str:
    alike = noise.lag_one > 0
    worth = (
        f"for a mean they are worth {noise.effective_rows:.0f} of {noise.rows} rows, and " if alike else ""
    )
    neighbours = correlation(noise.lag_one, noise.slow)
    return (
        f"Neighbouring rows {'resemble' if alike else 'alternate against'} each other ({neighbours}): "
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
