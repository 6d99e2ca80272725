"""The search beside joint curves: forward steps on an orthonormal basis, every pose one observation.

Where a robot has curves of many lines, thousands of readings of hundreds of poses are left to a few effects: what gives
way, lags, plays, warms up, and the tracker. Each step takes the candidate that explains most at its price (Schwarz's
criterion), if it stands with every pose as one observation and lowers the error of blocks of poses left out; weights of
links take the place of the load at the flange that they contain, and what later steps made doubtful falls.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from monitor.discovery.machine.evidence.held_out import poses_of
from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.joints.joint_curves import Pursuit, protecting
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, ChainVariant, scene_of
from monitor.discovery.machine.shapes.refine import refine
from monitor.discovery.machine.shapes.tables import ChainScan
from monitor.discovery.machine.suspects.wander import base_instead
from monitor.discovery.search.candidate import side_by_side
from monitor.discovery.search.evidence import pool_of
from monitor.discovery.search.projection import orthonormal, without
from monitor.discovery.search.scan import ScanResult, except_for, findings_without_rivals
from monitor.discovery.search.steps import step_by_step
from monitor.records import Array

# More effects beside the curves than this are beyond what one session separates.
MOST_EFFECTS = 12
# So many of the best candidates of a step are tried.
MOST_TRIED = 5


def search_beside_curves(
    fit: Fit, variants: Sequence[ChainVariant], rate: float
) -> tuple[ChainScene, ChainScan]:
    """The scene of a fit that has the joint curves, and what is found in it at the false-alarm probability ``rate``."""
    scene = scene_of(fit, protecting(fit, variants))
    steps = _StepsBesideCurves(scene, rate)
    tests = len(steps.pool)
    selected = step_by_step(steps, [], most=MOST_EFFECTS, most_steps=tests + 1)
    selected = base_instead(scene, selected, rate) or selected
    findings = findings_without_rivals(scene, selected, tests)
    return scene, ScanResult(tuple(sorted(findings, key=lambda finding: -finding.evidence.score)))


class _StepsBesideCurves:
    """The steps of a search; a family is selected once at most."""

    def __init__(self, scene: ChainScene, rate: float) -> None:
        self.scene = scene
        self.pool = pool_of(scene).candidates
        self.level = rate / max(len(self.pool), 1)
        self._selected_once: set[str] = set()

    def best(self, selected: Sequence[ChainCandidate], fallen: Collection[str]) -> ChainCandidate | None:
        """The candidate that explains most at its price and stands."""
        rest = [candidate for candidate in self.pool if candidate.family not in self._selected_once]
        return _best(self._beside(selected), rest, self.level)

    def admitted(self, selected: Sequence[ChainCandidate], best: ChainCandidate) -> list[ChainCandidate]:
        """The selected candidates that stand beside another one and are not part of it."""
        self._selected_once.add(best.family)
        # What the new effect contains has nothing of its own.
        more = [*(other for other in selected if not _contains(best, other)), best]
        # At a time constant of the grid a warm-up leaves a bend, which the next step would take for an effect.
        more[-1] = refine(self.scene, more, len(more) - 1).candidate
        index = 0
        while index < len(more) - 1:
            pursuit = self._beside(except_for(more, index))
            new = pursuit.new(more[index].columns[pursuit.order])
            if _stands(pursuit, more[index], new, self.level):
                index += 1
            else:
                more = except_for(more, index)
        return more

    def standing(self, selected: Sequence[ChainCandidate]) -> list[ChainCandidate]:
        """All of them: they were asked when the last one was admitted."""
        return list(selected)

    def ahead(self, selected: Sequence[ChainCandidate], fallen: Collection[str], most: int) -> None:
        """None: with thousands of poses each effect foretells what was left out by itself."""

    def _beside(self, selected: Sequence[ChainCandidate]) -> Pursuit:
        fit = self.scene.fit
        return Pursuit(fit, side_by_side(fit.solution.last.residual.size, selected), poses_of(fit))


def _best(pursuit: Pursuit, rest: Sequence[ChainCandidate], level: float) -> ChainCandidate | None:
    """The candidate that explains most at its price and stands; None where none does."""
    total = float(pursuit.residual @ pursuit.residual)
    count = len(pursuit.residual)
    scores = []
    for candidate in rest:
        new = pursuit.new(candidate.columns[pursuit.order])
        explained = float(np.sum((new.T @ pursuit.residual) ** 2))
        price = new.shape[1] * np.log(count) + 2.0 * np.log(candidate.variant.odds)
        scores.append(-count * np.log1p(-min(explained / total, 1.0 - 1e-12)) - price)
    for index in np.argsort(scores)[::-1][:MOST_TRIED]:
        candidate = rest[int(index)]
        new = pursuit.new(candidate.columns[pursuit.order])
        if scores[index] > 0.0 and _stands(pursuit, candidate, new, level):
            return candidate
    return None


def _stands(pursuit: Pursuit, candidate: ChainCandidate, new: Array, level: float) -> bool:
    """Whether an effect with ``new`` columns stands: by poses, held out, and of a plausible size."""
    if new.shape[1] == 0 or pursuit.p_value(new) * candidate.variant.odds > level:
        return False
    if pursuit.held_out(new) >= pursuit.held_out():
        return False
    return not pursuit.cancels(candidate, new)


def _contains(whole: ChainCandidate, part: ChainCandidate) -> bool:
    """Whether hardly anything of one candidate lies outside another."""
    lengths = np.linalg.norm(part.columns, axis=0)
    rest = np.linalg.norm(without(orthonormal(whole.columns), part.columns), axis=0)
    return bool(np.all(rest <= 1e-3 * lengths))
