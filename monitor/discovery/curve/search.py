"""The scan of a curve's effects, one after the other, the outliers judged under the most convincing of them first."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from monitor.discovery.curve.acceptance import CurveAcceptance
from monitor.discovery.curve.candidates import scene_of
from monitor.discovery.curve.outliers import Outlier, outliers
from monitor.discovery.curve.scene import CurveCandidate, CurveScene, whitened_curve
from monitor.discovery.search.rounds import in_rounds
from monitor.discovery.search.scan import Finding, ScanResult, except_for, reduced, scan
from monitor.methods.curve.fit import CurveFit, fit
from monitor.methods.curve.problem import CurveProblem
from monitor.statistics.noise import Noise

#: Effects, noise and outliers are estimated in turn; a curve that has not settled by then is reported as it is.
MOST_ROUNDS = 5


@dataclass(frozen=True)
class SearchRound:
    """One scan of a scene; ``under`` is the fit with its findings, ``scanned`` how many there were before noise was
    allowed for."""

    scene: CurveScene
    acceptance: CurveAcceptance
    result: ScanResult[CurveCandidate]
    under: CurveFit
    scanned: int

    def alone(self) -> SearchRound:
        """The round with those findings only that stand out from correlated noise by themselves."""
        result = reduced(
            self.result, lambda findings: _weakest(self.acceptance, findings, self.acceptance.stands_alone)
        )
        if len(result.findings) == len(self.result.findings):
            return self
        return replace(self, result=result, under=_fit_with(self.scene.curve.fit, result.candidates))


def _fit_with(base: CurveFit, candidates: Sequence[CurveCandidate]) -> CurveFit:
    """A fit with candidates in its model."""
    effects = [candidate.effect for candidate in candidates]
    return fit(base.settled.with_effects(effects)) if effects else base


def _weakest(
    acceptance: CurveAcceptance,
    findings: Sequence[Finding[CurveCandidate]],
    stands: Callable[[Sequence[CurveCandidate], CurveCandidate], bool],
) -> int | None:
    """Index of the finding that stands out least from correlated noise beside the others; None where it ``stands``."""
    candidates = [finding.candidate for finding in findings]
    p_values = [
        acceptance.evidence.p_value(except_for(candidates, index), candidate)
        for index, candidate in enumerate(candidates)
    ]
    weakest = int(np.argmax(p_values))
    return None if stands(except_for(candidates, weakest), candidates[weakest]) else weakest


class CurveSearch:
    """The search of a problem in one noise; its scene under every set of left-out rows is computed once."""

    def __init__(self, problem: CurveProblem, rate: float, noise: Noise) -> None:
        self.problem, self.rate, self.noise = problem, rate, noise
        self._rules: dict[bytes, CurveAcceptance] = {}

    def _rules_without(self, suspect: Sequence[Outlier]) -> CurveAcceptance:
        """The scene without suspect rows, and the rules of its search."""
        out = np.zeros(len(self.problem.curve), dtype=bool)
        out[[outlier.row for outlier in suspect]] = True
        key = out.tobytes()
        if key not in self._rules:
            curve = whitened_curve(fit(replace(self.problem, left_out=out)), self.noise)
            self._rules[key] = CurveAcceptance(scene_of(curve), self.rate)
        return self._rules[key]

    def scanned(self, suspect: Sequence[Outlier], most: int) -> SearchRound:
        """One scan, and the model with its findings."""
        acceptance = self._rules_without(suspect)
        scanned = scan(acceptance.scene, acceptance, rate=self.rate, most=most)
        # What still stands with all the others in the model: the weakest is asked first.
        result = reduced(scanned, lambda findings: _weakest(acceptance, findings, acceptance.stands))
        under = _fit_with(acceptance.scene.curve.fit, result.candidates)
        return SearchRound(acceptance.scene, acceptance, result, under, len(scanned.findings))

    def exhausted(self, suspect: tuple[Outlier, ...], most: int) -> tuple[SearchRound, tuple[Outlier, ...]]:
        """One effect after the other, until nothing stands: readings that look like outliers are judged under the most
        convincing effects before weaker ones are looked for.

        A drift over several days hides a daily cycle and looks like correlated noise until the cycle is in the model:
        what the scan finds but does not stand alone is tried beside others in the next round, before it is given up.
        """
        latest = self.scanned(suspect, 0)
        short: tuple[SearchRound, tuple[Outlier, ...]] | None = None
        for count in range(1, most + 1):
            rounds = _Rounds(self, suspect, count)
            latest, _ = in_rounds(rounds, MOST_ROUNDS)
            suspect = rounds.suspect
            standing = len(latest.result.findings)
            if short is not None and standing <= len(short[0].result.findings):
                return short
            if latest.scanned < count or latest.under.exact:
                break
            short = (latest, suspect) if standing < count else None
        return latest, suspect


@dataclass
class _Rounds:
    """The rounds of a search of at most so many effects: they and the outliers in turn."""

    search: CurveSearch
    suspect: tuple[Outlier, ...]
    most: int

    def round(self) -> SearchRound:
        """One scan without the present outliers."""
        return self.search.scanned(self.suspect, self.most)

    def judged(self, current: SearchRound) -> SearchRound | None:
        """Judge the outliers under the effects that were found."""
        before, self.suspect = self.suspect, () if current.under.exact else outliers(current.under)
        unchanged = {outlier.row for outlier in before} == {outlier.row for outlier in self.suspect}
        return current if unchanged else None
