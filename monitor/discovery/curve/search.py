"""The scan of a curve's effects, one after the other, the outliers judged under the most convincing of them first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from monitor.discovery.curve.acceptance import Acceptance
from monitor.discovery.curve.candidates import at_best, see, separable
from monitor.discovery.curve.outliers import Outlier, outliers
from monitor.discovery.curve.scene import Scene, effect_of, scene_of
from monitor.discovery.machine.scan import Finding, ScanResult, scan
from monitor.discovery.machine.visible import Visible
from monitor.methods.curve.fit import CurveFit, fit
from monitor.methods.curve.problem import CurveProblem
from monitor.statistics.noise import Noise

#: Effects, noise and outliers are found in turn; a curve that has not settled by then is told as it is.
MOST_ROUNDS = 5


@dataclass(frozen=True)
class Round:
    scene: Scene
    visible: Visible
    result: ScanResult
    acceptance: Acceptance
    under: CurveFit
    scanned: int

    def alone(self) -> Round:
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


class Views:
    """What is seen of a problem in one noise under every set of left-out rows, so that nothing is computed twice."""

    def __init__(self, problem: CurveProblem, rate: float, noise: Noise) -> None:
        self.problem, self.rate, self.noise = problem, rate, noise
        self.known: dict[bytes, tuple[Scene, Visible, Acceptance]] = {}

    def view(self, suspect: Sequence[Outlier]) -> tuple[Scene, Visible, Acceptance]:
        """Scene, candidates and acceptance."""
        out = np.zeros(len(self.problem.curve), dtype=bool)
        out[[one.row for one in suspect]] = True
        key = out.tobytes()
        if key not in self.known:
            scene = scene_of(fit(replace(self.problem, left_out=out)), self.noise)
            visible = see(scene)
            self.known[key] = (scene, visible, Acceptance(scene, visible, self.rate))
        return self.known[key]

    def look(self, suspect: Sequence[Outlier], most: int) -> Round:
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
        return Round(scene, visible, result, acceptance, under, scanned)


def _standing(acceptance: Acceptance, findings: Sequence[Finding]) -> tuple[Finding, ...]:
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


def exhausted(views: Views, suspect: tuple[Outlier, ...], most: int) -> tuple[Round, tuple[Outlier, ...]]:
    """One effect after the other, until nothing stands: readings that look like outliers are judged under the most
    convincing effects before weaker ones are looked for.

    A drift over several days hides a daily cycle and looks like correlated noise until the cycle is in the model: what
    the scan finds but does not stand alone gets its company in the next round, before it is given up.
    """
    now = views.look(suspect, 0)
    short: tuple[Round, tuple[Outlier, ...]] | None = None
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
