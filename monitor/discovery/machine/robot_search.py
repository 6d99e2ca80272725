"""The search beside joint curves: forward steps on an orthonormal basis, every pose one observation.

Where a robot has curves of many lines, thousands of readings of hundreds of poses are left to a few effects: what gives
way, lags, plays, warms up, and the tracker. Each step takes the candidate that explains most at its price (Schwarz's
criterion), if it stands with every pose as one observation and lowers the error of blocks of poses left out; weights of
links take the place of the load at the flange that they contain, and what later steps made doubtful falls.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.held_out import poses_of
from monitor.discovery.machine.joint_curves import Pursuit, protecting
from monitor.discovery.machine.refine import refine
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, ChainVariant, scene_of
from monitor.discovery.machine.tables import ChainScan
from monitor.discovery.search.evidence import weigh_beside
from monitor.discovery.search.projection import orthonormal, without
from monitor.discovery.search.scan import Finding, ScanResult, except_for
from monitor.records import Array

# More effects beside the curves than this are beyond what one session separates.
MOST_EFFECTS = 12
# So many of the best candidates of a step are tried.
MOST_TRIED = 5
# An effect whose displacement is this many times as large as what it takes of the residual is nearly cancelled by
# others: no finding. A load that gives way moves poses at full reach some ten times as much as the usual one.
LARGEST_RATIO = 40.0


def search_beside_curves(
    fit: Fit, variants: Sequence[ChainVariant], rate: float
) -> tuple[ChainScene, ChainScan]:
    """The scene of a fit that has the joint curves, and what is found in it at the false-alarm probability ``rate``."""
    scene = scene_of(fit, protecting(fit, variants))
    pool = [candidate for candidate in scene.candidates if candidate.visible]
    selected: list[ChainCandidate] = []
    fallen: set[str] = set()
    while len(selected) < MOST_EFFECTS:
        pursuit = _beside(fit, selected)
        rest = [
            candidate for candidate in pool if candidate.family not in fallen and candidate not in selected
        ]
        best = _best(pursuit, rest, rate / len(pool))
        if best is None:
            break
        fallen.add(best.family)
        # What the new effect contains has nothing of its own.
        selected = [other for other in selected if not _contains(best, other)]
        selected.append(best)
        # At a time constant of the grid a warm-up leaves a bend, which the next step would take for an effect.
        selected[-1] = refine(scene, selected, len(selected) - 1).candidate
        selected = _standing(fit, selected, rate / len(pool))
    evidence = [
        weigh_beside(scene, [candidate], except_for(selected, index))[0]
        for index, candidate in enumerate(selected)
    ]
    findings = [Finding(each, min(1.0, each.p_value * len(pool)), (each,)) for each in evidence]
    return scene, ScanResult(tuple(sorted(findings, key=lambda finding: -finding.evidence.score)), ())


def _beside(fit: Fit, selected: Sequence[ChainCandidate]) -> Pursuit:
    none = np.zeros((fit.solution.last.residual.size, 0))
    columns = np.concatenate([none, *(candidate.columns for candidate in selected)], axis=1)
    return Pursuit(fit, columns, poses_of(fit))


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
    columns = without(pursuit.basis, candidate.columns[pursuit.order])
    sizes = np.linalg.pinv(columns, rcond=1e-6) @ pursuit.residual
    peak = float(np.linalg.norm(candidate.raw @ sizes, axis=1).max())
    taken = pursuit.fit.sigma * float(np.linalg.norm(new.T @ pursuit.residual))
    return peak <= LARGEST_RATIO * taken / float(np.sqrt(pursuit.fit.readings))


def _contains(whole: ChainCandidate, part: ChainCandidate) -> bool:
    """Whether hardly anything of one candidate lies outside another."""
    lengths = np.linalg.norm(part.columns, axis=0)
    rest = np.linalg.norm(without(orthonormal(whole.columns), part.columns), axis=0)
    return bool(np.all(rest <= 1e-3 * lengths))


def _standing(fit: Fit, selected: list[ChainCandidate], level: float) -> list[ChainCandidate]:
    """The selected candidates without those that do not stand beside the others, the last one first."""
    index = 0
    while index < len(selected) - 1:
        pursuit = _beside(fit, except_for(selected, index))
        new = pursuit.new(selected[index].columns[pursuit.order])
        if _stands(pursuit, selected[index], new, level):
            index += 1
        else:
            selected = except_for(selected, index)
    return selected
