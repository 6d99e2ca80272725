"""Which effect a curve lacks: the same scan as for a machine, over plain columns.

Fit, scan, take what was found into the fit, name the outliers, look whether neighbouring rows resemble each
other, and begin again under that until nothing changes. A finding has to stand three things: the false
discovery rate of the scan, a test that allows for correlated noise (what neighbours share is not sold as an
effect), and the error on rows that took no part in its fit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy import linalg

from monitor.discovery.curve_candidates import (
    POWERS,
    Scene,
    at_best,
    effect_of,
    orthonormal_to_full_precision,
    scene_of,
    see,
    separable,
)
from monitor.discovery.curve_outliers import Outlier, outliers
from monitor.discovery.evidence import Evidence, Pool, orthonormal, weigh, without
from monitor.discovery.held_out import held_out_rms
from monitor.discovery.scan import Finding, ScanResult, scan
from monitor.discovery.visible import SMALLEST_SHARE, Candidate, Visible
from monitor.effects.curve import SEARCHED, CurveEffect, coefficient_names
from monitor.effects.curve_words import calendar_period, describe_curve
from monitor.effects.words import Words
from monitor.methods.curve import CurveFit, CurveProblem, fit, inverse_normal
from monitor.records import Array
from monitor.statistics.noise import WHITE, Assessed, Noise, assess, p_value_against_noise, p_value_in_noise

#: Effects, noise and outliers are found in turn; a curve that has not settled by then is told as it is.
MOST_ROUNDS = 5
#: Tides have a dozen lines; more than these are beyond what one scan should tell.
MOST_EFFECTS = 12
#: Rows are dealt into ten folds at random, always the same way.
FOLDS, DEAL = 10, 20261121
#: As for machines: rivals whose evidence comes this close are not ruled out.
UNDECIDED = 12.0
#: Effects that are asked together whether they, rather than noise, make neighbours resemble each other, and the level
#: of that question (docs/trials-curve.md has how often it is wrong).
MOST_TOGETHER = 5
#: Fewer cycles than these over the range of an input can be a bend.
MOST_BENDS = 2.0
AGAINST_NOISE = 0.05
#: A line and a cycle together: slow noise (correlation 0.97 and independent readings) is taken for them at 0.05 in
#: every fifth series of 100 rows.
LINE_AGAINST_NOISE = 1e-6
COINCIDES = 0.999


@dataclass(frozen=True)
class CurveMissing:
    """A missing effect, everything in the unit of the response or as its ``units`` say.

    ``effect`` is found from the data, ``written`` how it is to be added: a searched value rounded to its
    uncertainty, or a period of the calendar that it agrees with.
    """

    effect: CurveEffect
    written: str
    words: Words
    names: tuple[str, ...]
    units: tuple[str, ...]
    coefficients: Array
    u: Array
    amplitude: float
    u_amplitude: float
    peak: float
    u_value: float | None
    p_value: float
    q_value: float
    rms_before: float
    rms_after: float
    held_out_before: float | None
    held_out_after: float | None
    bic_before: float
    bic_after: float
    rivals: tuple[tuple[str, bool], ...]


@dataclass(frozen=True)
class CurveExplanation:
    """The answer: the model as given (``first``), what it lacks, the readings that were left out, the noise that is
    left, and what the rows say nothing of."""

    first: CurveFit
    final: CurveFit
    missing: tuple[CurveMissing, ...]
    suspect: tuple[Outlier, ...]
    noise: Assessed
    blind: tuple[str, ...]
    refused: tuple[tuple[str, str], ...]


def folds(count: int) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """The fold (n,) of every row; below twenty rows each is its own."""
    if count < 2 * FOLDS:
        return np.arange(count)
    return np.random.default_rng(DEAL).permutation(count) % FOLDS


@dataclass
class _Acceptance:
    """The last word on a finding; keeps the p-values that it came to."""

    scene: Scene
    visible: Visible
    rate: float
    p_values: dict[str, float] = field(default_factory=dict)
    known: dict[tuple[str, ...], float] = field(default_factory=dict)
    odds: dict[tuple[tuple[str, ...], tuple[str, ...]], float] = field(default_factory=dict)

    def is_a_bend(self, others: Sequence[Candidate], found: Candidate) -> bool:
        """Whether a polynomial in the same input does as well at its price as a cycle, an exponential or a step: then
        it is the simpler answer and has its turn."""
        effect = effect_of(found)
        x = self.scene.fit.problem.inputs.numbers.get(effect.column, np.zeros(1))
        many = effect.shape == "sin" and float(np.ptp(x)) > MOST_BENDS * float(effect.value or 1.0)
        if effect.shape not in SEARCHED or many:
            return False
        problem, rows = self.scene.fit.settled, self.scene.fit.problem.order
        y = problem.curve.measured[rows]
        chosen = [effect_of(one) for one in others]
        ends = []
        for last in (effect, *(CurveEffect(effect.column, f"poly{power}") for power in POWERS[1:])):
            left, rank = _left(y, problem.columns([*problem.effects, *chosen, last])[2][rows])
            ends.append(len(y) * np.log(max(left, 1e-300)) + (rank + (last is effect)) * np.log(len(y)))
        return bool(min(ends[1:]) <= ends[0])

    def line(self, others: Sequence[Candidate], found: Candidate) -> Candidate | None:
        """The straight line in the same input, where it is not in the model yet: a bend must say something beside it,
        or the line is the simpler answer."""
        column = effect_of(found).column
        for one in self.pool.candidates:
            effect = effect_of(one)
            if effect.column == column and effect.order == 1 and effect_of(found).order != 1:
                return None if any(effect_of(other) == effect for other in others) else one
        return None

    @cached_property
    def pool(self) -> Pool:
        return Pool(tuple(one for one in self.visible.candidates if one.share > SMALLEST_SHARE))

    def falls(self, others: Sequence[Candidate], found: Candidate) -> bool:
        """Whether Schwarz's criterion of ordinary least squares falls: an effect that only shows in whitened rows
        takes next to nothing of the error away."""
        fitted, rows = self.scene.fit, self.scene.fit.problem.order
        y = fitted.problem.curve.measured[rows]
        problem, chosen = fitted.settled, [effect_of(one) for one in others]
        # The lower powers that come along with a power count too.
        before = _left(y, problem.columns([*problem.effects, *chosen])[2][rows])
        after = _left(y, problem.columns([*problem.effects, *chosen, effect_of(found)])[2][rows])
        price = (after[1] - before[1] + effect_of(found).free) * np.log(len(y))
        return bool(len(y) * np.log(before[0] / max(after[0], 1e-300)) > price)

    @cached_property
    def families(self) -> int:
        """How many kinds of effects are looked at."""
        return len({one.family for one in self.visible.candidates if one.share > SMALLEST_SHARE})

    def p_value(self, others: Sequence[Candidate], found: Candidate) -> float:
        """In correlated noise, everything that was searched paid for."""
        fitted, rows = self.scene.fit, self.scene.fit.problem.order
        columns = [fitted.design, *(self.scene.columns(effect_of(one)) for one in others)]
        key = (found.family, *sorted(one.family for one in others))
        if key in self.known:
            return self.known[key]
        measured = fitted.problem.curve.measured
        p = p_value_in_noise(
            measured[rows], np.column_stack(columns)[rows], self.scene.columns(effect_of(found))[rows]
        )
        self.known[key] = min(1.0, p * found.variant.tries)
        return self.known[key]

    def stands(self, others: Sequence[Candidate], found: Candidate) -> bool:
        """Whether correlated noise is no better explanation.

        Alone: the effect stands out from the noise that its model leaves, and its model is likelier than noise
        alone. In company: a line and cycles of one input look like correlated noise as long as one of them is not in
        the model, so they are asked together, and the rows have to be independent once all are in.
        """
        asked = found.family
        found = at_best(self.scene, self.visible, [*others, found], len(others))
        p = self.p_values[asked] = self.p_values[found.family] = self.p_value(others, found)
        if p * self.families <= self.rate and self.likelier(others, [found], AGAINST_NOISE):
            return True
        line = effect_of(found).order == 1
        if not (line or effect_of(found).shape == "sin"):
            return False
        if self.alone(others, found) * self.families > self.rate:
            return False
        kind = (effect_of(found).column, "sin")
        same = (
            [] if line else [one for one in others if (effect_of(one).column, effect_of(one).shape) == kind]
        )
        rest = [one for one in others if one not in same]
        together = [found, *same]
        # Slow noise is a line and some cycles too: one cycle has to make a line plain.
        most, level = (2, LINE_AGAINST_NOISE) if line else (max(MOST_TOGETHER, len(same) + 1), AGAINST_NOISE)
        while len(together) <= most:
            enough = len(together) > 1 and self.likelier(rest, together, level)
            if enough and not self.noise_after([*rest, *together]).noticed:
                return True
            more = self.next_one([*rest, *together], kind)
            if more is None:
                return False
            together.append(more)
        return False

    def design(self, others: Sequence[Candidate]) -> tuple[Array, Array]:
        """Response (m,) and columns (m, c) of the model with others, rows in the order of time."""
        fitted, rows = self.scene.fit, self.scene.fit.problem.order
        columns = [fitted.design, *(self.scene.columns(effect_of(one)) for one in others)]
        return fitted.problem.curve.measured[rows], np.column_stack(columns)[rows]

    def likelier(self, others: Sequence[Candidate], together: Sequence[Candidate], level: float) -> bool:
        """Whether effects together, their search paid for, explain the rows better than noise alone."""
        key = tuple(sorted(one.family for one in others)), tuple(sorted(one.family for one in together))
        if key not in self.odds:
            y, x = self.design(others)
            added = np.column_stack([self.scene.columns(effect_of(one)) for one in together])
            price = np.prod([float(one.variant.tries) for one in together]) / math.factorial(len(together))
            self.odds[key] = p_value_against_noise(y, x, added[self.scene.fit.problem.order]) * float(price)
        return self.odds[key] <= level

    def alone(self, others: Sequence[Candidate], found: Candidate) -> float:
        """p-value in independent noise, the search paid for."""
        y, x = self.design(others)
        own = self.scene.columns(effect_of(found))[self.scene.fit.problem.order]
        return p_value_in_noise(y, x, own, white=True) * found.variant.tries

    def noise_after(self, chosen: Sequence[Candidate]) -> Assessed:
        """The noise that is left with the chosen ones in the model."""
        return assess(*self.design(chosen))

    def next_one(self, chosen: Sequence[Candidate], kind: tuple[str, str]) -> Candidate | None:
        """The most convincing candidate of a kind (column, shape) beside the chosen ones, at its best value."""
        stack = np.concatenate([self.visible.added, *(one.columns for one in chosen)], axis=1)
        taken = {one.family for one in chosen}
        apart = separable(self.scene.fit.problem)
        found = weigh(self.pool, self.visible.residual, stack, self.visible.degrees_of_freedom)
        # What explains most, whatever its price: the price is paid for all together.
        for one in sorted(found, key=lambda one: -one.explained):
            effect = effect_of(one.candidate)
            if (effect.column, effect.shape) != kind or (one.candidate.family in taken and not effect.free):
                continue
            if apart(chosen, one.candidate):
                return at_best(self.scene, self.visible, [*chosen, one.candidate], len(chosen))
        return None

    def __call__(self, others: Sequence[Candidate], found: Candidate) -> bool:
        line = self.line(others, found)
        if line is not None and not self.stands([*others, line], found):
            return False
        if not self.stands(others, found) or not self.falls(others, found) or self.is_a_bend(others, found):
            return False
        before = np.concatenate([self.visible.added, *(one.columns for one in others)], axis=1)
        after = np.concatenate([before, found.columns], axis=1)
        fold = folds(len(self.visible.residual))
        dof = self.visible.degrees_of_freedom
        one = held_out_rms(self.visible.residual, before, fold, dof, 1.0)
        two = held_out_rms(self.visible.residual, after, fold, dof, 1.0)
        return one is None or two is None or two < one


def _left(y: Array, columns: Array) -> tuple[float, int]:
    """Sum of squares that columns leave of y, and their rank."""
    basis = orthonormal_to_full_precision(columns)
    return float(np.sum(without(basis, y[:, None]) ** 2)), basis.shape[1]


@dataclass(frozen=True)
class _Round:
    scene: Scene
    visible: Visible
    result: ScanResult
    acceptance: _Acceptance
    under: CurveFit
    scanned: int

    def alone(self) -> _Round:
        """The round with those findings only that stand out from correlated noise by themselves."""
        kept, ask = list(self.result.findings), self.acceptance
        while kept:
            candidates = [one.candidate for one in kept]
            p = [ask.p_value([o for o in candidates if o is not one], one) for one in candidates]
            worst = int(np.argmax(p))
            if p[worst] * ask.families <= ask.rate:
                break
            kept.pop(worst)
        if len(kept) == len(self.result.findings):
            return self
        found = [effect_of(one.candidate) for one in kept]
        under = fit(self.scene.fit.settled.with_effects(found)) if found else self.scene.fit
        return replace(self, result=replace(self.result, findings=tuple(kept)), under=under)


class _Views:
    """What is seen of a problem in one noise under every set of left-out rows, so that nothing is computed twice."""

    def __init__(self, problem: CurveProblem, rate: float, noise: Noise) -> None:
        self.problem, self.rate, self.noise = problem, rate, noise
        self.known: dict[bytes, tuple[Scene, Visible, _Acceptance]] = {}

    def view(self, suspect: Sequence[Outlier]) -> tuple[Scene, Visible, _Acceptance]:
        """Scene, candidates and acceptance."""
        out = np.zeros(len(self.problem.curve), dtype=bool)
        out[[one.row for one in suspect]] = True
        key = out.tobytes()
        if key not in self.known:
            scene = scene_of(fit(replace(self.problem, left_out=out)), self.noise)
            visible = see(scene)
            self.known[key] = (scene, visible, _Acceptance(scene, visible, self.rate))
        return self.known[key]

    def look(self, suspect: Sequence[Outlier], most: int) -> _Round:
        """One scan, and the model with what it found."""
        scene, visible, acceptance = self.view(suspect)
        result = scan(
            visible,
            rate=self.rate,
            most=most,
            accept=acceptance,
            best_value=lambda chosen, place: at_best(scene, visible, chosen, place),
            allowed=separable(scene.fit.problem),
            # A rival takes the place of an effect where it still says something beside it, noise allowed for.
            better=lambda chosen, rival: acceptance.p_value(chosen, rival) * acceptance.families <= self.rate,
        )
        scanned = len(result.findings)
        result = replace(result, findings=_standing(acceptance, result.findings))
        found = [effect_of(one.candidate) for one in result.findings]
        under = fit(scene.fit.settled.with_effects(found)) if found else scene.fit
        return _Round(scene, visible, result, acceptance, under, scanned)


def _standing(acceptance: _Acceptance, findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Findings that still stand in correlated noise with all the others in the model: the weakest is asked first."""
    kept = list(findings)
    while kept:
        candidates = [one.candidate for one in kept]
        p = [
            acceptance.p_value([*candidates[:place], *candidates[place + 1 :]], one)
            for place, one in enumerate(candidates)
        ]
        worst = int(np.argmax(p))
        others = [one for place, one in enumerate(candidates) if place != worst]
        if acceptance.stands(others, candidates[worst]):
            break
        kept.pop(worst)
    return tuple(kept)


def explain_curve(problem: CurveProblem, *, rate: float = 0.01, most: int = MOST_EFFECTS) -> CurveExplanation:
    """What a curve's model lacks. ``rate`` is the false discovery rate of each scan.

    Raises DataError where the model cannot be fitted.
    """
    first = fit(problem)
    if first.exact:
        return CurveExplanation(first, first, (), (), noise_of(first), (), ())
    suspect: tuple[Outlier, ...] = ()
    now, suspect = _exhausted(_Views(problem, rate, WHITE), suspect, most)
    noise = noise_of(now.under)
    if noise.noticed:
        # Some cycles were taken for the sake of company that did not come: each has to stand alone now.
        now = now.alone()
        noise = noise_of(now.under)
    rounds = [now]
    if noise.noticed:
        # What independent rows would show was found; now what stands out once the resemblance is filtered out.
        more = replace(now.under.settled, left_out=problem.left_out)
        now, suspect = _exhausted(_Views(more, rate, noise.noise), suspect, most - len(now.result.findings))
        noise = noise_of(now.under)
        rounds.append(now)
    out = now.under.problem.left_out
    missing = _tell(rounds, noise)
    named = {one.effect.family for one in missing}
    return CurveExplanation(
        first=first,
        final=now.under,
        missing=missing,
        suspect=tuple(one for one in suspect if out[one.row]),
        noise=noise,
        blind=tuple(
            dict.fromkeys(
                one.family
                for one in rounds[0].visible.candidates
                if one.share <= SMALLEST_SHARE and one.family not in named
            )
        ),
        refused=rounds[0].visible.refused,
    )


def noise_of(fitted: CurveFit) -> Assessed:
    """The noise that a model leaves; none where it fits exactly."""
    if fitted.exact:
        return Assessed(WHITE, 1.0)
    rows = fitted.problem.order
    return assess(fitted.problem.curve.measured[rows], fitted.design[rows])


def _exhausted(views: _Views, suspect: tuple[Outlier, ...], most: int) -> tuple[_Round, tuple[Outlier, ...]]:
    """One effect after the other, until nothing stands: readings that look like outliers are judged under the most
    convincing effects before weaker ones are looked for.

    A drift over several days hides a daily cycle and looks like correlated noise until the cycle is in the model: what
    the scan finds but does not stand alone gets its company in the next round, before it is given up.
    """
    now = views.look(suspect, 0)
    short: tuple[_Round, tuple[Outlier, ...]] | None = None
    for count in range(1, most + 1):
        for _ in range(MOST_ROUNDS):
            now = views.look(suspect, count)
            before, suspect = suspect, () if now.under.exact else outliers(now.under)
            if {one.row for one in before} == {one.row for one in suspect}:
                break
        found = len(now.result.findings)
        if short is not None and found <= len(short[0].result.findings):
            return short
        if now.scanned < count or now.under.exact:
            break
        short = (now, suspect) if found < count else None
    return now, suspect


def bic(fitted: CurveFit) -> float:
    """Schwarz's criterion: n log(RSS / n) + k log n, k with the searched values."""
    count = int((~fitted.problem.left_out).sum())
    return float(
        count * np.log(max(fitted.sum_of_squares, 1e-300) / count)
        + (count - fitted.degrees_of_freedom) * np.log(count)
    )


def held_out(fitted: CurveFit) -> float | None:
    """Held-out root mean square per degree of freedom of the base: folds of rows left out in turn."""
    kept = ~fitted.problem.left_out
    count = int(kept.sum())
    columns = np.linalg.qr(fitted.design / np.maximum(np.linalg.norm(fitted.design, axis=0), 1e-300))[0][kept]
    return held_out_rms(-fitted.residual[kept], columns, folds(count), count, 1.0)


def _tell(rounds: Sequence[_Round], noise: Assessed) -> tuple[CurveMissing, ...]:
    """What is told of every finding, the most convincing of every round first."""
    left_out = rounds[-1].under.problem.left_out
    told: list[CurveMissing] = []
    before = fit(replace(rounds[0].scene.fit.problem, left_out=left_out))
    for now in rounds:
        for finding in now.result.findings:
            after = fit(before.settled.with_effects([effect_of(finding.candidate)]))
            told.append(_missing(now, finding, len(told), (before, after, rounds[-1].under), noise))
            before = after
    return tuple(told)


def _missing(
    now: _Round, finding: Finding, place: int, fits: tuple[CurveFit, CurveFit, CurveFit], noise: Assessed
) -> CurveMissing:
    """One finding at ``place``; ``fits`` are those before it, with it, and with everything."""
    before, after, final = fits
    at = len(now.scene.fit.problem.base) + len(before.problem.added)
    effect = final.effects[at]
    inputs = final.problem.inputs
    own = [n for n, name in enumerate(final.names) if name in _own_names(final, effect)]
    coefficients, covariance = final.estimate[own], allowed_for(final, noise)[np.ix_(own, own)]
    u_value = None
    if effect.free and np.isfinite(final.u_values[at]):
        u_value = final.u_values[at] * inflation(final, noise, at)
    columns = final.design[:, own]
    contribution = columns @ np.nan_to_num(coefficients)
    amplitude, u_amplitude = _amplitude(effect, coefficients, covariance)
    written = _written(final, effect, u_value)
    clock = effect.column == final.problem.curve.time
    unit = inputs.units.get(effect.column, "")
    p_value = finding.evidence.p_value
    if noise.noticed:
        p_value = max(p_value, now.acceptance.p_values.get(finding.candidate.family, p_value))
    return CurveMissing(
        effect=effect,
        written=written.text,
        words=describe_curve(written, final.problem.curve.response, unit, clock=clock),
        names=tuple(final.names[n] for n in own),
        units=tuple(final.units[n] for n in own),
        coefficients=coefficients,
        u=np.sqrt(np.diag(covariance)),
        amplitude=amplitude,
        u_amplitude=u_amplitude,
        peak=float(np.abs(contribution - contribution.mean()).max()),
        u_value=u_value,
        p_value=p_value,
        q_value=min(1.0, p_value * now.acceptance.families),
        rms_before=before.rms,
        rms_after=after.rms,
        held_out_before=held_out(before),
        held_out_after=held_out(after),
        bic_before=bic(before),
        bic_after=bic(after),
        rivals=_rivals(now, finding, now.result.findings),
    )


def _own_names(fitted: CurveFit, effect: CurveEffect) -> tuple[str, ...]:
    return coefficient_names(effect, fitted.problem.inputs)


def allowed_for(fitted: CurveFit, noise: Assessed) -> Array:
    """Covariance (k, k) of the coefficients with correlated noise allowed for: (X'X)^-1 X' R X (X'X)^-1 s^2."""
    return _covariance(fitted, noise)[: len(fitted.names), : len(fitted.names)]


def inflation(fitted: CurveFit, noise: Assessed, at: int) -> float:
    """Factor by which correlated noise widens the standard uncertainty of the searched value of effect ``at``."""
    free = [n for n, one in enumerate(fitted.effects) if one.free and one.shape != "step"]
    place = len(fitted.names) + free.index(at)
    plain = _covariance(fitted, Assessed(WHITE, 1.0))[place, place]
    return float(np.sqrt(_covariance(fitted, noise)[place, place] / plain))


def _covariance(fitted: CurveFit, noise: Assessed) -> Array:
    x = fitted.design[fitted.problem.order]
    inverse = inverse_normal(x)
    variance = fitted.deviation**2
    if not noise.noticed:
        return np.asarray(variance * inverse)
    middle = x.T @ linalg.matmul_toeplitz(noise.noise.correlations(len(x)), x)
    # What the fit takes out of correlated noise is missing from the residual; the trace puts it back.
    taken = float(np.trace(inverse @ middle))
    count = len(x)
    variance = fitted.sum_of_squares / max(count - taken, 1.0)
    return np.asarray(variance * inverse @ middle @ inverse)


def _amplitude(effect: CurveEffect, coefficients: Array, covariance: Array) -> tuple[float, float]:
    """The coefficient; the length of a cosine and a sine; the root mean square of the deviations of groups."""
    if len(coefficients) == 1:
        return float(coefficients[0]), float(np.sqrt(covariance[0, 0]))
    if effect.shape == "group":
        size = len(coefficients) + 1
        centre = np.eye(size)[:, 1:] - 1.0 / size
        deviations = centre @ coefficients
        spread = float(np.sqrt(np.sum(deviations**2) / (size - 1)))
        slope = centre.T @ deviations / ((size - 1) * max(spread, 1e-300))
        return spread, float(np.sqrt(slope @ covariance @ slope))
    length = float(np.linalg.norm(coefficients))
    direction = coefficients / max(length, 1e-300)
    return length, float(np.sqrt(direction @ covariance @ direction))


def _written(fitted: CurveFit, effect: CurveEffect, u: float | None) -> CurveEffect:
    """The effect as it is to be added: rounded to its uncertainty, or a period of the calendar."""
    if not effect.free or effect.value is None:
        return effect
    clock = effect.column == fitted.problem.curve.time
    if effect.shape == "sin" and clock and u is not None:
        known = calendar_period(effect.value, u, fitted.problem.inputs.units.get(effect.column, ""))
        if known is not None:
            return replace(effect, value=known, free=False)
    if u is None or not np.isfinite(u) or u <= 0.0:
        return effect.at(float(f"{effect.value:.6g}"))
    return effect.at(float(np.round(effect.value, max(1 - int(np.floor(np.log10(u))), 0))))


def _rivals(now: _Round, finding: Finding, findings: Sequence[Finding]) -> tuple[tuple[str, bool], ...]:
    """Effects that the rows do not rule out, and whether they coincide with the one found."""
    own = finding.evidence
    others = [one.candidate.columns for one in findings if one is not finding]
    basis = orthonormal(np.concatenate([now.visible.added, *others], axis=1))
    vector = without(basis, own.candidate.columns)
    least = max(own.likelihood - UNDECIDED, 0.0)
    chosen = effect_of(own.candidate)
    told = []
    for one in finding.rivals:
        effect = effect_of(one.candidate)
        if one.candidate is own.candidate or one.likelihood < least or one.score == -np.inf:
            continue
        if (effect.column, effect.shape) == (chosen.column, chosen.shape):
            continue
        told.append((_named(one), _share(basis, one, vector) > COINCIDES))
    return tuple(sorted(told, key=lambda pair: not pair[1]))


def _named(one: Evidence) -> str:
    effect = effect_of(one.candidate)
    return effect.at(float(f"{effect.value:.4g}")).text if effect.free and effect.value else effect.text


def _share(basis: Array, one: Evidence, vector: Array) -> float:
    own = orthonormal(without(basis, one.candidate.columns))
    total = float(np.sum(vector**2))
    return float(np.sum((own.T @ vector) ** 2)) / max(total, 1e-300)
